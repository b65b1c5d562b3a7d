// SPDX-License-Identifier: MIT OR Apache-2.0
//! Predicted poses from the last update on, to which the points of a sweep belong.

use bentwing_trajectory::so3;
use nalgebra::Vector3;

use crate::measure::Moment;
use crate::state::{Mounted, State, Tangent, at};

/// A predicted pose and the constant rate and acceleration from it to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub time: f64,
    pub pose: Mounted,
    pub v: Vector3<f64>,
    /// rad/s, imu frame.
    pub rate: Vector3<f64>,
    /// m/s², map frame.
    pub a: Vector3<f64>,
    /// Whether it is one of the poses asked for.
    pub is_asked: bool,
}

impl Node {
    /// The state at a time from which on nothing is known yet.
    pub(crate) fn of(state: &State, time: f64) -> Self {
        Self {
            time,
            pose: state.pose,
            v: state.v,
            rate: Vector3::zeros(),
            a: Vector3::zeros(),
            is_asked: false,
        }
    }
}

/// The pose at time `t`, `end` being that of the sweep; `nodes` are in time order and not none.
pub(crate) fn moment(nodes: &[Node], t: f64, end: f64) -> Moment {
    let after = nodes.partition_point(|n| n.time <= t).max(1);
    let n = &nodes[after - 1];
    let s = t - n.time;
    let R = n.pose.R * so3::exp(&(n.rate * s));
    Moment {
        R,
        p: n.pose.t + n.v * s + n.a * (0.5 * s * s),
        v: n.v + n.a * s,
        omega: R * n.rate,
        dt: end - t,
    }
}

/// Spreads the correction of the last node over the nodes since the time `from`: what was wrong
/// with velocity and biases has grown since then, so that the trajectory has no step.
pub(crate) fn correct(nodes: &mut [Node], from: f64, correction: &Tangent) {
    let Some(end) = nodes.last().map(|n| n.time) else {
        return;
    };
    let part = |i: usize| correction.fixed_rows::<3>(i).into_owned();
    let (turn, shift, change) = (part(at::ROTATION), part(at::POSITION), part(at::VELOCITY));
    for n in nodes {
        if n.time <= from || end <= from {
            continue;
        }
        let share = (n.time - from) / (end - from);
        n.pose.R = so3::turned(&(turn * share), &n.pose.R);
        n.pose.t += shift * share;
        n.v += change * share;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::tests::some_state;

    fn nodes() -> Vec<Node> {
        let mut second = Node::of(&some_state(), 0.01);
        second.pose.t += Vector3::new(0.02, 0.0, 0.0);
        let mut first = Node::of(&some_state(), 0.0);
        first.v = Vector3::new(2.0, 0.0, 0.0);
        first.rate = Vector3::new(0.0, 0.0, 1.0);
        second.v = first.v;
        vec![first, second]
    }

    #[test]
    fn between_nodes_the_motion_goes_on() {
        let nodes = nodes();
        let m = moment(&nodes, 0.005, 0.02);
        assert!((m.p - nodes[0].pose.t - Vector3::new(0.01, 0.0, 0.0)).norm() < 1e-12);
        assert!((m.R.angle_to(&nodes[0].pose.R) - 0.005).abs() < 1e-9);
        assert!((m.dt - 0.015).abs() < 1e-12);
        let beyond = moment(&nodes, 0.02, 0.02);
        assert!((beyond.p.x - nodes[1].pose.t.x - 0.02).abs() < 1e-12);
    }

    #[test]
    fn a_correction_grows_from_nothing() {
        let mut corrected = nodes();
        let mut d = Tangent::zeros();
        d.fixed_rows_mut::<3>(at::POSITION).fill(0.1);
        correct(&mut corrected, 0.0, &d);
        assert!((corrected[0].pose.t - nodes()[0].pose.t).norm() < 1e-15);
        assert!((corrected[1].pose.t - nodes()[1].pose.t).x - 0.1 < 1e-12);
    }
}
