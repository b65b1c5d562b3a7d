// SPDX-License-Identifier: MIT OR Apache-2.0
//! The points of a voxel that were seen in one go.

use bentwing_voxels::Moments;

/// Moments of points, and sums over their times and the motor's angles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passage {
    pub moments: Moments,
    first_time: f64,
    last_time: f64,
    time: f64,
    angle: f64,
}

impl Passage {
    /// Of one point, relative to an origin that all merged passages share.
    #[inline]
    pub(crate) fn of_point(p: [f64; 3], time: f64, angle: f64) -> Self {
        Self {
            moments: Moments::of_point(p),
            first_time: time,
            last_time: time,
            time,
            angle,
        }
    }

    /// Adds the points of `other`.
    #[inline]
    pub(crate) fn merge(&mut self, other: &Self) {
        self.moments.merge(&other.moments);
        self.first_time = self.first_time.min(other.first_time);
        self.last_time = self.last_time.max(other.last_time);
        self.time += other.time;
        self.angle += other.angle;
    }

    /// Times of the first and the last point, s.
    #[inline]
    pub(crate) fn span(&self) -> (f64, f64) {
        (self.first_time, self.last_time)
    }

    /// Mean time, s.
    pub(crate) fn mean_time(&self) -> f64 {
        self.time / f64::from(self.moments.n())
    }

    /// Mean angle of the motor, rad.
    pub(crate) fn mean_angle(&self) -> f64 {
        self.angle / f64::from(self.moments.n())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_merged_passage_spans_both_and_has_their_mean_time_and_angle() {
        let mut one = Passage::of_point([0.0; 3], 0.3, 1.0);
        for (time, angle) in [(0.1, 2.0), (0.2, 3.0), (0.4, 6.0)] {
            one.merge(&Passage::of_point([1.0; 3], time, angle));
        }
        assert_eq!((one.moments.n(), one.span()), (4, (0.1, 0.4)));
        assert!((one.mean_time() - 0.25).abs() < 1e-15);
        assert!((one.mean_angle() - 3.0).abs() < 1e-15);
    }
}
