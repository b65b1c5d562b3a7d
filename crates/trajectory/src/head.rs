// SPDX-License-Identifier: MIT OR Apache-2.0
//! The geometry of the sensor head: where the lidar is, seen from the IMU.

use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::{Motor, RangeBias, so3};

/// The lidar's clock: what is stamped t was measured at `t - latency - rate · (t - epoch)`.
#[derive(Clone, Copy, Debug, Default)]
pub struct LidarClock {
    /// Lidar stamps minus IMU clock at the epoch, s.
    pub latency: f64,
    /// How much faster than the IMU's it runs, s/s.
    pub rate: f64,
    /// The stamp at which the latency is `latency`, s.
    pub epoch: f64,
}

impl LidarClock {
    /// A clock that runs as fast as the IMU's.
    pub fn late_by(latency: f64) -> Self {
        Self {
            latency,
            ..Self::default()
        }
    }

    /// By how much a stamp is late, s.
    pub fn latency_at(&self, stamp: f64) -> f64 {
        self.latency + self.rate * (stamp - self.epoch)
    }

    /// When on the clock of the IMU it was that something is stamped so, s.
    pub fn measured(&self, stamp: f64) -> f64 {
        stamp - self.latency_at(stamp)
    }
}

/// Sensor head: lidar, IMU and, where there is one, the motor between them.
#[derive(Clone, Copy, Debug)]
pub struct Head {
    /// `T_imu_lidar`, or `T_imu_motor` for a motor-turned lidar.
    pub T_imu_base: Isometry3<f64>,
    /// How the lidar's stamps lead to times on the clock of the IMU.
    pub clock: LidarClock,
    /// The motor, if the lidar is turned by one.
    pub motor: Option<Motor>,
    /// What is wrong with the ranges.
    pub ranges: RangeBias,
}

impl Head {
    /// Rotation and translation of the lidar in the IMU frame at encoder angle `theta`.
    pub fn lidar_in_imu(&self, theta: f64) -> (Matrix3<f64>, Vector3<f64>) {
        let base = self.T_imu_base;
        let T = match &self.motor {
            None => base,
            Some(m) => base * m.turn(theta) * m.T_motor_lidar,
        };
        (so3::matrix(&T.rotation), T.translation.vector)
    }

    /// The measured point `p_lidar`, corrected, in the base frame (lidar frame, or motor frame before
    /// its rotation).
    pub fn point_in_base(&self, p_lidar: &Vector3<f64>, theta: f64) -> Vector3<f64> {
        let p = self.ranges.corrected(p_lidar);
        match &self.motor {
            None => p,
            Some(m) => {
                (m.turn(theta) * m.T_motor_lidar)
                    .transform_point(&p.into())
                    .coords
            }
        }
    }

    /// Whether points of the lidar are points in the base frame as they are.
    pub fn takes_points_as_measured(&self) -> bool {
        self.motor.is_none() && self.ranges.is_zero()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MotorErrors;

    #[test]
    fn a_fast_clock_is_later_and_later() {
        let clock = LidarClock {
            latency: 0.002,
            rate: 1e-4,
            epoch: 10.0,
        };
        assert!((clock.measured(10.0) - 9.998).abs() < 1e-12);
        assert!((clock.measured(30.0) - 29.996).abs() < 1e-12);
    }

    #[test]
    fn a_motor_head_follows_the_chain_of_frames() {
        let head = Head {
            T_imu_base: Isometry3::translation(0.0, 0.0, 1.0),
            clock: LidarClock::default(),
            motor: Some(Motor {
                axis: Vector3::z(),
                zero: 0.25,
                T_motor_lidar: Isometry3::translation(0.1, 0.0, 0.0),
                errors: MotorErrors::default(),
            }),
            ranges: RangeBias::default(),
        };
        let quarter = std::f64::consts::FRAC_PI_2 - 0.25;
        let (R, t) = head.lidar_in_imu(quarter);
        assert!((t - Vector3::new(0.0, 0.1, 1.0)).norm() < 1e-12);
        assert!((R * Vector3::x() - Vector3::y()).norm() < 1e-12);
        let p = head.point_in_base(&Vector3::new(1.0, 0.0, 0.0), quarter);
        assert!((p - Vector3::new(0.0, 1.1, 0.0)).norm() < 1e-12);
    }
}
