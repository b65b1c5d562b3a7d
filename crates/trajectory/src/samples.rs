// SPDX-License-Identifier: MIT OR Apache-2.0
//! The dense trajectory: poses of the IMU at a uniform rate.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use thiserror::Error;

use crate::so3;

/// Why a trajectory cannot be made from the samples given.
#[derive(Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum TrajectoryError {
    /// A pose and a velocity need two samples.
    #[error("a trajectory needs at least 2 samples, got {0}")]
    TooShort(usize),
    /// Positions and rotations come in pairs.
    #[error("{positions} positions but {rotations} rotations")]
    LengthMismatch {
        /// Number of positions given.
        positions: usize,
        /// Number of rotations given.
        rotations: usize,
    },
    /// The sample interval must be positive and finite.
    #[error("the sample interval must be positive, got {0} s")]
    Interval(f64),
}

/// A pose of the IMU in the map.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    /// Position, m, map frame.
    pub p: Vector3<f64>,
    /// Rotation `R_map_imu`.
    pub R: Matrix3<f64>,
}

/// Poses `T_map_imu` at `t0 + n·dt`; between samples p is linear and R is slerped.
///
/// At 100 Hz and flight accelerations this differs from the true motion by less than 0.03 mm
/// (Kaul 2015, section 2.1, stores trajectories as such samples).
#[derive(Clone, Debug)]
pub struct Trajectory {
    t0: f64,
    dt: f64,
    positions: Vec<Vector3<f64>>,
    rotations: Vec<UnitQuaternion<f64>>,
    /// `Log(R_nᵀ R_{n+1})`, kept so that interpolation costs one exponential.
    steps: Vec<Vector3<f64>>,
}

impl Trajectory {
    /// Makes a trajectory of at least two samples.
    ///
    /// # Errors
    /// When there are fewer than two samples, the lengths differ, or `dt` is not positive.
    pub fn new(
        t0: f64,
        dt: f64,
        positions: Vec<Vector3<f64>>,
        rotations: Vec<UnitQuaternion<f64>>,
    ) -> Result<Self, TrajectoryError> {
        if positions.len() != rotations.len() {
            return Err(TrajectoryError::LengthMismatch {
                positions: positions.len(),
                rotations: rotations.len(),
            });
        }
        if positions.len() < 2 {
            return Err(TrajectoryError::TooShort(positions.len()));
        }
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(TrajectoryError::Interval(dt));
        }
        let steps = steps_in_body(&rotations, Vec::new());
        Ok(Self {
            t0,
            dt,
            positions,
            rotations,
            steps,
        })
    }

    /// Time of the first sample, s.
    pub fn start(&self) -> f64 {
        self.t0
    }

    /// Time of the last sample, s.
    pub fn end(&self) -> f64 {
        self.time(self.len() - 1)
    }

    /// Sample interval, s.
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Number of samples, at least two.
    #[allow(clippy::len_without_is_empty, reason = "a trajectory is never empty")]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Time of sample `n`, s.
    pub fn time(&self, n: usize) -> f64 {
        self.t0 + n as f64 * self.dt
    }

    /// Positions of the samples, m, map frame.
    pub fn positions(&self) -> &[Vector3<f64>] {
        &self.positions
    }

    /// Rotations `R_map_imu` of the samples.
    pub fn rotations(&self) -> &[UnitQuaternion<f64>] {
        &self.rotations
    }

    /// `Log(R_nᵀ R_{n+1})` of each pair of neighbouring samples, rad, imu frame.
    pub fn steps(&self) -> &[Vector3<f64>] {
        &self.steps
    }

    /// Index of the sample before `t` and the fraction towards the next; both clamped to the ends.
    #[inline]
    pub fn locate(&self, t: f64) -> (usize, f64) {
        let x = ((t - self.t0) / self.dt).clamp(0.0, (self.len() - 1) as f64);
        let n = (x as usize).min(self.len() - 2);
        (n, x - n as f64)
    }

    /// Pose at `t`; beyond the ends the first or last sample.
    pub fn pose(&self, t: f64) -> Pose {
        let (n, u) = self.locate(t);
        let p = self.positions[n] + (self.positions[n + 1] - self.positions[n]) * u;
        let R = self.rotations[n] * so3::exp(&(self.steps[n] * u));
        Pose {
            p,
            R: so3::matrix(&R),
        }
    }

    /// Velocity (m/s, map frame) and angular rate (rad/s, map frame) at `t`.
    pub fn velocity(&self, t: f64) -> (Vector3<f64>, Vector3<f64>) {
        let (n, _) = self.locate(t);
        let v = (self.positions[n + 1] - self.positions[n]) / self.dt;
        (v, self.rotations[n] * (self.steps[n] / self.dt))
    }

    /// Acceleration of sample `n` by second difference, m/s², map frame; `1 <= n < len - 1`.
    pub fn acceleration(&self, n: usize) -> Vector3<f64> {
        let p = &self.positions;
        (p[n + 1] - 2.0 * p[n] + p[n - 1]) / (self.dt * self.dt)
    }

    /// Appends a sample.
    pub fn push(&mut self, p: Vector3<f64>, R: UnitQuaternion<f64>) {
        let last = self.rotations[self.len() - 1];
        self.steps.push(so3::log(&(last.inverse() * R)));
        self.positions.push(p);
        self.rotations.push(R);
    }

    /// Moves the last sample.
    pub(crate) fn set_last_position(&mut self, p: Vector3<f64>) {
        let last = self.positions.len() - 1;
        self.positions[last] = p;
    }

    /// Composes a correction into every sample: `p ← p + δt`, `R ← Exp(δr) R` (Kaul 2015, eq. 3).
    ///
    /// There is one `[δr, δt]` per sample.
    pub fn correct(&mut self, corrections: &[[f64; 6]]) {
        for (n, &[a, b, c, x, y, z]) in corrections.iter().enumerate() {
            self.positions[n] += Vector3::new(x, y, z);
            self.rotations[n] = so3::turned(&Vector3::new(a, b, c), &self.rotations[n]);
        }
        self.steps = steps_in_body(&self.rotations, std::mem::take(&mut self.steps));
    }
}

/// Fills `steps` (its storage reused) with `Log(R_nᵀ R_{n+1})`.
fn steps_in_body(
    rotations: &[UnitQuaternion<f64>],
    mut steps: Vec<Vector3<f64>>,
) -> Vec<Vector3<f64>> {
    steps.clear();
    steps.extend(
        rotations
            .windows(2)
            .map(|r| so3::log(&(r[0].inverse() * r[1]))),
    );
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spinning() -> Trajectory {
        let rate = Vector3::new(0.2, -0.1, 6.0);
        let n = 101;
        let positions = (0..n)
            .map(|i| Vector3::new(0.01 * f64::from(i), 0.0, 1.0))
            .collect();
        let rotations = (0..n)
            .map(|i| so3::exp(&(rate * 0.01 * f64::from(i))))
            .collect();
        Trajectory::new(5.0, 0.01, positions, rotations).unwrap()
    }

    #[test]
    fn interpolation_is_exact_for_constant_velocity_and_rate() {
        let trajectory = spinning();
        for t in [5.0, 5.003, 5.4999, 5.8, 6.0] {
            let pose = trajectory.pose(t);
            let expected = so3::exp(&(Vector3::new(0.2, -0.1, 6.0) * (t - 5.0)));
            assert!((pose.p.x - (t - 5.0)).abs() < 1e-12);
            assert!((pose.R - so3::matrix(&expected)).norm() < 1e-12);
        }
    }

    #[test]
    fn angular_rate_is_in_the_map_frame() {
        let trajectory = spinning();
        let (v, omega) = trajectory.velocity(5.503);
        assert!((v - Vector3::x()).norm() < 1e-9);
        assert!((omega - Vector3::new(0.2, -0.1, 6.0)).norm() < 1e-9);
    }

    #[test]
    fn beyond_the_ends_the_end_samples_hold() {
        let trajectory = spinning();
        assert_eq!(trajectory.pose(0.0).p, trajectory.positions()[0]);
        assert_eq!(trajectory.pose(99.0).p, trajectory.positions()[100]);
    }

    #[test]
    fn a_correction_turns_on_the_left_in_the_map_frame() {
        let mut trajectory = spinning();
        let before = trajectory.pose(5.5);
        let dr = Vector3::new(0.3, 0.0, 0.0);
        trajectory.correct(&[[0.3, 0.0, 0.0, 0.0, 1.0, 0.0]; 101]);
        let after = trajectory.pose(5.5);
        let turn = so3::matrix(&so3::exp(&dr));
        assert!((after.R - turn * before.R).norm() < 1e-12);
        assert!((after.p - before.p - Vector3::y()).norm() < 1e-12);
    }

    #[test]
    fn unusable_samples_are_refused() {
        let one = Trajectory::new(
            0.0,
            0.01,
            vec![Vector3::zeros()],
            vec![so3::exp(&Vector3::x())],
        );
        assert_eq!(one.unwrap_err(), TrajectoryError::TooShort(1));
    }
}
