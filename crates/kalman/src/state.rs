// SPDX-License-Identifier: MIT OR Apache-2.0
//! The state and its tangent space (Fu 2023, the state of section 2.3.2, with two delays more).

use bentwing_trajectory::so3;
use nalgebra::{SMatrix, SVector, UnitQuaternion, Vector2, Vector3};

/// Dimension of the tangent space.
pub const DIM: usize = 31;
/// Covariances and Jacobians of the state.
pub type Square = SMatrix<f64, DIM, DIM>;
/// An error of the state: each rotation on the left, `R ← Exp(δ) R`, everything else added.
pub type Tangent = SVector<f64, DIM>;

/// Where the parts of a tangent begin.
pub mod at {
    /// Attitude, rad, map frame.
    pub const ROTATION: usize = 0;
    /// Position, m, map frame.
    pub const POSITION: usize = 3;
    /// Velocity, m/s, map frame.
    pub const VELOCITY: usize = 6;
    /// Bias of the gyro, rad/s, imu frame.
    pub const GYRO_BIAS: usize = 9;
    /// Bias of the accelerometer, m/s², imu frame.
    pub const ACCEL_BIAS: usize = 12;
    /// Direction of gravity, rad, two turns about the map's x and y.
    pub const GRAVITY: usize = 15;
    /// Rotation of the motor (of the lidar, where there is no motor) in the IMU frame, rad.
    pub const BASE_ROTATION: usize = 17;
    /// Its translation, m.
    pub const BASE_TRANSLATION: usize = 20;
    /// Rotation of the lidar in the frame that the motor turns, rad.
    pub const LIDAR_ROTATION: usize = 23;
    /// Its translation, m.
    pub const LIDAR_TRANSLATION: usize = 26;
    /// Lidar stamps minus IMU clock, s.
    pub const LATENCY: usize = 29;
    /// The encoder's angle at a stamp of the lidar is that of this much earlier, s.
    pub const ENCODER_DELAY: usize = 30;
}

/// Rotation and translation of one frame in another.
#[derive(Clone, Copy, Debug)]
pub struct Mounted {
    /// Rotation.
    pub R: UnitQuaternion<f64>,
    /// Translation, m.
    pub t: Vector3<f64>,
}

/// What the filter estimates.
#[derive(Clone, Copy, Debug)]
pub struct State {
    /// Attitude and position of the IMU in the map.
    pub pose: Mounted,
    /// Velocity of the IMU in the map, m/s.
    pub v: Vector3<f64>,
    /// Bias of the gyro, rad/s.
    pub gyro_bias: Vector3<f64>,
    /// Bias of the accelerometer, m/s².
    pub accel_bias: Vector3<f64>,
    /// Gravity, m/s², map frame, pointing up.
    pub gravity: Vector3<f64>,
    /// The motor in the IMU frame; the lidar, where there is no motor.
    pub base: Mounted,
    /// The lidar in the frame that the motor turns.
    pub lidar: Mounted,
    /// Lidar stamps minus IMU clock, s.
    pub latency: f64,
    /// The encoder's angle at a stamp of the lidar is that of this much earlier, s.
    pub encoder_delay: f64,
}

impl State {
    /// `x ⊞ δ`.
    #[must_use]
    pub fn plus(&self, d: &Tangent) -> Self {
        let part = |i: usize| d.fixed_rows::<3>(i).into_owned();
        let moved = |m: &Mounted, r: usize, t: usize| Mounted {
            R: so3::turned(&part(r), &m.R),
            t: m.t + part(t),
        };
        let turn = Vector3::new(d[at::GRAVITY], d[at::GRAVITY + 1], 0.0);
        Self {
            pose: moved(&self.pose, at::ROTATION, at::POSITION),
            v: self.v + part(at::VELOCITY),
            gyro_bias: self.gyro_bias + part(at::GYRO_BIAS),
            accel_bias: self.accel_bias + part(at::ACCEL_BIAS),
            gravity: so3::exp(&turn) * self.gravity,
            base: moved(&self.base, at::BASE_ROTATION, at::BASE_TRANSLATION),
            lidar: moved(&self.lidar, at::LIDAR_ROTATION, at::LIDAR_TRANSLATION),
            latency: self.latency + d[at::LATENCY],
            encoder_delay: self.encoder_delay + d[at::ENCODER_DELAY],
        }
    }

    /// `x ⊟ y`: what leads from `other` to this state.
    pub fn minus(&self, other: &Self) -> Tangent {
        let mut d = Tangent::zeros();
        let mut set = |i: usize, v: Vector3<f64>| d.fixed_rows_mut::<3>(i).copy_from(&v);
        for (a, b, r, t) in [
            (&self.pose, &other.pose, at::ROTATION, at::POSITION),
            (
                &self.base,
                &other.base,
                at::BASE_ROTATION,
                at::BASE_TRANSLATION,
            ),
            (
                &self.lidar,
                &other.lidar,
                at::LIDAR_ROTATION,
                at::LIDAR_TRANSLATION,
            ),
        ] {
            set(r, so3::log(&(a.R * b.R.inverse())));
            set(t, a.t - b.t);
        }
        set(at::VELOCITY, self.v - other.v);
        set(at::GYRO_BIAS, self.gyro_bias - other.gyro_bias);
        set(at::ACCEL_BIAS, self.accel_bias - other.accel_bias);
        let turn = gravity_turn(&other.gravity, &self.gravity);
        d.fixed_rows_mut::<2>(at::GRAVITY).copy_from(&turn);
        d[at::LATENCY] = self.latency - other.latency;
        d[at::ENCODER_DELAY] = self.encoder_delay - other.encoder_delay;
        d
    }

    /// Whether all numbers are finite.
    pub fn is_finite(&self) -> bool {
        let vectors = [
            self.pose.t,
            self.v,
            self.gyro_bias,
            self.accel_bias,
            self.gravity,
            self.base.t,
            self.lidar.t,
            self.pose.R.imag(),
            self.base.R.imag(),
            self.lidar.R.imag(),
        ];
        vectors.iter().all(|v| v.iter().all(|x| x.is_finite()))
            && self.latency.is_finite()
            && self.encoder_delay.is_finite()
    }
}

/// The horizontal turn that takes the direction `from` to the direction `to`, to which `from` is
/// close: two Newton steps on `Exp(δ) from = to`.
fn gravity_turn(from: &Vector3<f64>, to: &Vector3<f64>) -> Vector2<f64> {
    let mut turn = Vector3::zeros();
    for _ in 0..3 {
        let now = so3::exp(&turn) * from;
        let left = to - now;
        // δ × g = (δy gz, −δx gz, …)
        turn += Vector3::new(-left.y, left.x, 0.0) / now.z;
    }
    Vector2::new(turn.x, turn.y)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A state in which no two parts are alike.
    pub(crate) fn some_state() -> State {
        let mounted = |a: f64, t: f64| Mounted {
            R: so3::exp(&Vector3::new(a, -0.4 * a, 0.7)),
            t: Vector3::new(t, 0.3, -0.5 * t),
        };
        State {
            pose: mounted(0.5, 3.0),
            v: Vector3::new(1.0, -0.5, 0.2),
            gyro_bias: Vector3::new(0.01, -0.02, 0.005),
            accel_bias: Vector3::new(0.05, 0.02, -0.03),
            gravity: so3::exp(&Vector3::new(0.02, -0.03, 0.0)) * Vector3::new(0.0, 0.0, 9.8),
            base: mounted(-0.2, 0.1),
            lidar: mounted(1.2, 0.05),
            latency: 0.002,
            encoder_delay: -0.001,
        }
    }

    proptest! {
        #[test]
        fn minus_undoes_plus(values in prop::collection::vec(-0.1..0.1_f64, DIM)) {
            let d = Tangent::from_vec(values);
            let back = some_state().plus(&d).minus(&some_state());
            prop_assert!((back - d).norm() < 1e-6, "{}", (back - d).norm());
        }
    }
}
