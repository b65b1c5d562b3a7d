// SPDX-License-Identifier: MIT OR Apache-2.0
//! A motor between IMU and lidar, as it turns and not only as its encoder says.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::so3;

/// How a motor turns otherwise than its encoder reads, by the angle θ that it reads.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorErrors {
    /// Of `cos θ` and `sin θ`: what is added to the angle, rad, where the encoder's disc is off its axis.
    pub eccentricity: [f64; 2],
    /// Of `cos θ`, `sin θ`, `cos 2θ` and `sin 2θ`: how far the shaft leans about each of the two axes
    /// across it, rad, motor frame.
    pub wobble: [[f64; 4]; 2],
}

impl MotorErrors {
    /// Whether there are none.
    pub fn is_zero(&self) -> bool {
        *self == Self::default()
    }

    /// The factors of an eccentricity, and with the last two of a wobble, at an angle.
    pub fn harmonics(theta: f64) -> [f64; 4] {
        let ((s, c), (s2, c2)) = (theta.sin_cos(), (2.0 * theta).sin_cos());
        [c, s, c2, s2]
    }
}

/// A motor that turns the lidar:
/// `T_imu_lidar(θ) = T_imu_motor · Exp(lean(θ)) · Rot(axis, θ + zero + eccentricity(θ)) · T_motor_lidar`.
#[derive(Clone, Copy, Debug)]
pub struct Motor {
    /// Axis of rotation, unit vector, motor frame.
    pub axis: Vector3<f64>,
    /// Added to every encoder angle, rad.
    pub zero: f64,
    /// Lidar in the rotating motor frame.
    pub T_motor_lidar: Isometry3<f64>,
    /// How it turns otherwise than its encoder reads.
    pub errors: MotorErrors,
}

impl Motor {
    /// Rotation of the shaft in the motor frame where the encoder reads `theta`.
    pub fn turn(&self, theta: f64) -> UnitQuaternion<f64> {
        if self.errors.is_zero() {
            return so3::exp(&(self.axis * (theta + self.zero)));
        }
        so3::exp(&self.lean(theta)) * self.spin(theta)
    }

    /// Rotation about the axis alone.
    pub fn spin(&self, theta: f64) -> UnitQuaternion<f64> {
        let of_turn = MotorErrors::harmonics(theta);
        let askew = self.errors.eccentricity.iter().zip(of_turn);
        let angle = theta + self.zero + askew.map(|(e, h)| e * h).sum::<f64>();
        so3::exp(&(self.axis * angle))
    }

    /// How the shaft leans, a rotation vector, rad, motor frame.
    pub fn lean(&self, theta: f64) -> Vector3<f64> {
        let of_turn = MotorErrors::harmonics(theta);
        let size = |wobble: &[f64; 4]| wobble.iter().zip(of_turn).map(|(w, h)| w * h).sum::<f64>();
        let [u, v] = so3::orthogonal_pair(&self.axis);
        u * size(&self.errors.wobble[0]) + v * size(&self.errors.wobble[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    const MOTOR: Motor = Motor {
        axis: Vector3::new(0.0, 0.0, 1.0),
        zero: 0.25,
        T_motor_lidar: Isometry3 {
            rotation: UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(1.0, 0.0, 0.0, 0.0)),
            translation: nalgebra::Translation3::new(0.1, 0.0, 0.0),
        },
        errors: MotorErrors {
            eccentricity: [0.0; 2],
            wobble: [[0.0; 4]; 2],
        },
    };

    #[test]
    fn without_errors_it_turns_about_its_axis() {
        let turn = MOTOR.turn(FRAC_PI_2 - 0.25);
        assert!((turn * Vector3::x() - Vector3::y()).norm() < 1e-12);
        assert!(turn.angle_to(&MOTOR.spin(FRAC_PI_2 - 0.25)) < 1e-12);
    }

    #[test]
    fn an_encoder_off_its_axis_reads_too_little_and_too_much_once_a_turn() {
        let mut askew = MOTOR;
        askew.errors.eccentricity = [0.0, 0.01];
        let ahead = |theta: f64| so3::log(&(askew.turn(theta) * MOTOR.turn(theta).inverse())).z;
        assert!((ahead(FRAC_PI_2) - 0.01).abs() < 1e-12);
        assert!((ahead(-FRAC_PI_2) + 0.01).abs() < 1e-12);
        assert!(ahead(0.0).abs() < 1e-12);
    }

    #[test]
    fn a_shaft_that_wobbles_leans_once_and_twice_a_turn() {
        let mut bent = MOTOR;
        bent.errors.wobble = [[0.0; 4], [0.02, 0.0, 0.0, 0.03]];
        let [_, v] = so3::orthogonal_pair(&bent.axis);
        let leans = |theta: f64| {
            (bent.turn(theta) * Vector3::z() - Vector3::z()).dot(&v.cross(&Vector3::z()))
        };
        assert!((leans(0.0) - 0.02_f64.sin()).abs() < 1e-12);
        let expected = 0.02 * (FRAC_PI_2 / 2.0).cos() + 0.03;
        assert!((leans(FRAC_PI_2 / 2.0) - expected.sin()).abs() < 1e-12);
    }
}
