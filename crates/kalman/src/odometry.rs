// SPDX-License-Identifier: MIT OR Apache-2.0
//! The high-rate odometry: predicted poses, also through a first-order low-pass (Fu 2023, 2.3.2 (3)).

use nalgebra::Vector3;

use crate::state::{Mounted, State};

/// The pose as it is known at its time, before the sweep it belongs to is complete.
#[derive(Clone, Copy, Debug)]
pub struct OdometryPose {
    /// s.
    pub time: f64,
    /// Carried by the inertial samples from the last update.
    pub pose: Mounted,
    /// `x_i ← λ x_i + (1 − λ) x_{i−1}`, the rotation on the shortest way.
    pub smoothed: Mounted,
    /// m/s, map frame.
    pub v: Vector3<f64>,
}

#[derive(Clone, Debug)]
pub(crate) struct HighRate {
    first: f64,
    interval: f64,
    factor: f64,
    n: u64,
    last: Option<Mounted>,
    poses: Vec<OdometryPose>,
}

impl HighRate {
    pub(crate) fn new(first: f64, interval: f64, factor: f64) -> Self {
        Self {
            first,
            interval,
            factor,
            n: 1,
            last: None,
            poses: Vec::new(),
        }
    }

    /// Time of the next pose, s.
    pub(crate) fn next(&self) -> f64 {
        self.first + self.interval * self.n as f64
    }

    pub(crate) fn add(&mut self, time: f64, state: &State) {
        let pose = state.pose;
        let smoothed = self.last.map_or(pose, |last| Mounted {
            R: last
                .R
                .try_slerp(&pose.R, self.factor, 1e-9)
                .unwrap_or(pose.R),
            t: last.t + (pose.t - last.t) * self.factor,
        });
        self.last = Some(smoothed);
        self.n += 1;
        self.poses.push(OdometryPose {
            time,
            pose,
            smoothed,
            v: state.v,
        });
    }

    pub(crate) fn take(&mut self) -> Vec<OdometryPose> {
        std::mem::take(&mut self.poses)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::tests::some_state;

    #[test]
    fn a_step_is_followed_by_the_low_pass() {
        let mut odometry = HighRate::new(0.0, 0.02, 0.62);
        let mut state = some_state();
        state.pose.t = Vector3::zeros();
        odometry.add(odometry.next(), &state);
        state.pose.t.x = 1.0;
        for _ in 0..3 {
            odometry.add(odometry.next(), &state);
        }
        let taken = odometry.take();
        let expected = [0.0, 0.62, 1.0 - 0.38_f64.powi(2), 1.0 - 0.38_f64.powi(3)];
        for (found, x) in taken.iter().zip(expected) {
            assert!((found.smoothed.t.x - x).abs() < 1e-12);
        }
        assert!((taken[3].time - 0.08).abs() < 1e-12 && taken[3].pose.t.x == 1.0);
    }
}
