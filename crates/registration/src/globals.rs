// SPDX-License-Identifier: MIT OR Apache-2.0
//! The slow states that are estimated along with the trajectory.

use bentwing_trajectory::{Head, so3};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// Number of global states.
pub const N_GLOBALS: usize = 20;
/// A vector of all global states or their corrections.
pub type GlobalVector = [f64; N_GLOBALS];
/// A matrix over all global states.
pub type GlobalMatrix = nalgebra::SMatrix<f64, N_GLOBALS, N_GLOBALS>;

/// Where each global state stands in a [`GlobalVector`].
pub mod index {
    use std::ops::Range;

    /// Lidar stamps minus IMU clock, s.
    pub const LATENCY: usize = 0;
    /// `R_imu_base ← Exp(θ) R_imu_base`, rad, imu frame.
    pub const EXTRINSIC_ROTATION: Range<usize> = 1..4;
    /// Translation of `T_imu_base`, m, imu frame.
    pub const EXTRINSIC_TRANSLATION: Range<usize> = 4..7;
    /// Gyro bias, rad/s.
    pub const GYRO_BIAS: Range<usize> = 7..10;
    /// Accelerometer bias, m/s².
    pub const ACCEL_BIAS: Range<usize> = 10..13;
    /// Rotation of gravity about the x and y axes of the map, rad.
    pub const GRAVITY: Range<usize> = 13..15;
    /// Added to every encoder angle, rad.
    pub const ENCODER_ZERO: usize = 15;
    /// Rotation of the lidar about two axes perpendicular to the motor's, rad, motor frame.
    pub const MOTOR_TILT: Range<usize> = 16..18;
    /// Translation of the lidar perpendicular to the motor's axis, m, motor frame.
    pub const MOTOR_OFFSET: Range<usize> = 18..20;
}

/// Values of the global states.
#[derive(Clone, Debug)]
pub struct Globals {
    /// Latency, extrinsics and motor.
    pub head: Head,
    /// rad/s, imu frame.
    pub gyro_bias: Vector3<f64>,
    /// m/s², imu frame.
    pub accel_bias: Vector3<f64>,
    /// m/s², map frame, pointing up.
    pub gravity: Vector3<f64>,
}

impl Globals {
    /// Applies a correction.
    pub fn correct(&mut self, delta: &GlobalVector) {
        let three = |r: std::ops::Range<usize>| Vector3::from_column_slice(&delta[r]);
        let head = &mut self.head;
        head.latency += delta[index::LATENCY];
        let base = &mut head.T_imu_base;
        base.rotation = so3::turned(&three(index::EXTRINSIC_ROTATION), &base.rotation);
        base.translation =
            Translation3::from(base.translation.vector + three(index::EXTRINSIC_TRANSLATION));
        self.gyro_bias += three(index::GYRO_BIAS);
        self.accel_bias += three(index::ACCEL_BIAS);
        let [gx, gy] = [delta[index::GRAVITY.start], delta[index::GRAVITY.start + 1]];
        self.gravity = so3::exp(&Vector3::new(gx, gy, 0.0)) * self.gravity;
        if let Some(motor) = &mut head.motor {
            motor.zero += delta[index::ENCODER_ZERO];
            let [u, v] = so3::orthogonal_pair(&motor.axis);
            let pair = |r: std::ops::Range<usize>| u * delta[r.start] + v * delta[r.start + 1];
            let lidar = &mut motor.T_motor_lidar;
            lidar.rotation = so3::turned(&pair(index::MOTOR_TILT), &lidar.rotation);
            lidar.translation =
                Translation3::from(lidar.translation.vector + pair(index::MOTOR_OFFSET));
        }
    }

    /// The correction that leads from `earlier` to here.
    pub fn moved_from(&self, earlier: &Self) -> GlobalVector {
        let mut delta = [0.0; N_GLOBALS];
        let mut set = |place: std::ops::Range<usize>, v: Vector3<f64>| {
            let n = place.len();
            delta[place].copy_from_slice(&v.as_slice()[..n]);
        };
        let turn = |a: UnitQuaternion<f64>, b: UnitQuaternion<f64>| so3::log(&(a * b.inverse()));
        let shift =
            |a: &Isometry3<f64>, b: &Isometry3<f64>| a.translation.vector - b.translation.vector;
        let (a, b) = (&self.head.T_imu_base, &earlier.head.T_imu_base);
        set(index::EXTRINSIC_ROTATION, turn(a.rotation, b.rotation));
        set(index::EXTRINSIC_TRANSLATION, shift(a, b));
        set(index::GYRO_BIAS, self.gyro_bias - earlier.gyro_bias);
        set(index::ACCEL_BIAS, self.accel_bias - earlier.accel_bias);
        set(
            index::GRAVITY,
            turn_about_x_and_y(&earlier.gravity, &self.gravity),
        );
        delta[index::LATENCY] = self.head.latency - earlier.head.latency;
        if let (Some(now), Some(then)) = (&self.head.motor, &earlier.head.motor) {
            delta[index::ENCODER_ZERO] = now.zero - then.zero;
            let (a, b) = (&now.T_motor_lidar, &then.T_motor_lidar);
            let (tilt, offset) = (turn(a.rotation, b.rotation), shift(a, b));
            for (k, u) in so3::orthogonal_pair(&now.axis).iter().enumerate() {
                delta[index::MOTOR_TILT.start + k] = u.dot(&tilt);
                delta[index::MOTOR_OFFSET.start + k] = u.dot(&offset);
            }
        }
        delta
    }
}

/// The rotation about x and y that turns the direction of `from` to that of `to`.
///
/// The shortest rotation turns a little about z as well; what it misses is turned again. Gravity is
/// within degrees of z, where that converges in a few steps.
fn turn_about_x_and_y(from: &Vector3<f64>, to: &Vector3<f64>) -> Vector3<f64> {
    let (from, to) = (from.normalize(), to.normalize());
    let mut found = Vector3::zeros();
    for _ in 0..20 {
        let turned = so3::exp(&found) * from;
        let step = turned.cross(&to);
        found += Vector3::new(step.x, step.y, 0.0);
    }
    found
}

/// What is known of the global states before a registration.
#[derive(Clone, Debug)]
pub struct GlobalPrior {
    /// Information matrix about its mean.
    pub information: GlobalMatrix,
    /// Correction that leads from the mean to the values the registration starts from.
    pub offset: GlobalVector,
    /// States that are not estimated at all.
    pub frozen: [bool; N_GLOBALS],
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraints::testing::Scene;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_way_back_is_the_correction(
            scene in Scene::any(), delta in prop::array::uniform20(-0.3..0.3_f64),
        ) {
            let mut corrected = scene.globals.clone();
            corrected.correct(&delta);
            let found = corrected.moved_from(&scene.globals);
            for i in 0..N_GLOBALS {
                prop_assert!((found[i] - delta[i]).abs() < 1e-9, "state {i}");
            }
        }
    }
}
