// SPDX-License-Identifier: MIT OR Apache-2.0
//! A hall of 16 × 12 × 5 m with pillars and crates, all of them boxes.

use nalgebra::Vector3;

const HALL: Box3 = Box3([-8.0, -6.0, -1.5], [8.0, 6.0, 3.5]);
const THINGS: [Box3; 9] = [
    Box3([-6.2, -3.2, -1.5], [-5.8, -2.8, 3.5]),
    Box3([-6.2, 2.8, -1.5], [-5.8, 3.2, 3.5]),
    Box3([-0.2, -4.2, -1.5], [0.2, -3.8, 3.5]),
    Box3([-0.2, 3.8, -1.5], [0.2, 4.2, 3.5]),
    Box3([5.8, -3.2, -1.5], [6.2, -2.8, 3.5]),
    Box3([5.8, 2.8, -1.5], [6.2, 3.2, 3.5]),
    Box3([-7.5, -0.8, -1.5], [-6.3, 0.7, -0.3]),
    Box3([2.0, 4.6, -1.5], [3.5, 5.6, -0.6]),
    Box3([2.5, -5.7, -1.5], [4.9, -4.9, 0.4]),
];

struct Box3([f64; 3], [f64; 3]);

impl Box3 {
    /// Where a ray enters and leaves the box.
    fn crossing(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> (f64, f64) {
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..3 {
            let (a, b) = (
                (self.0[axis] - origin[axis]) / direction[axis],
                (self.1[axis] - origin[axis]) / direction[axis],
            );
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter, leave)
    }
}

/// Distance to the first surface, m; the origin is in the hall and in none of the things.
pub(crate) fn range(origin: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
    let mut range = HALL.crossing(origin, direction).1;
    for thing in &THINGS {
        let (enter, leave) = thing.crossing(origin, direction);
        if 0.0 < enter && enter < leave {
            range = range.min(enter);
        }
    }
    range
}
