// SPDX-License-Identifier: MIT OR Apache-2.0
//! Extends a trajectory beyond its end: by the IMU, or at constant velocity.

use nalgebra::Vector3;

use crate::{Imu, Trajectory, so3};

/// Extends `trajectory` up to (not beyond) `until` by the inertial samples.
///
/// `R_{n+1} = R_n Exp(dθ_n − b_g dt)` and `p_{n+1} = 2 p_n − p_{n−1} + dt² (F_n − g)`, with `gravity`
/// pointing up. These equations also define the IMU residuals, so that a fresh prior has residual
/// zero. Where the IMU has a gap, and beyond its end, the motion goes on at constant velocity and
/// rate; returns the number of samples in gaps.
pub fn extend_inertial(
    trajectory: &mut Trajectory,
    imu: &Imu,
    gyro_bias: &Vector3<f64>,
    accel_bias: &Vector3<f64>,
    gravity: &Vector3<f64>,
    until: f64,
) -> usize {
    let dt = trajectory.dt();
    let mut n_blind = 0;
    while trajectory.end() + dt <= until + 1e-9 {
        let n = trajectory.len() - 1;
        let (t, t_next) = (trajectory.time(n), trajectory.time(n + 1));
        let turned = imu
            .rotation_increment(t, t_next)
            .map(|d| d - gyro_bias * dt);
        let step = turned.unwrap_or(trajectory.steps()[n - 1]);
        let R = trajectory.rotations()[n] * so3::exp(&step);
        let p = trajectory.positions()[n];
        let constant_velocity = 2.0 * p - trajectory.positions()[n - 1];
        // The force around node n needs the rotation after it.
        trajectory.push(constant_velocity, R);
        if let Some(node) = imu.node_force(trajectory, n) {
            let force = trajectory.rotations()[n] * (node.force - node.bias_gain * accel_bias);
            trajectory.set_last_position(constant_velocity + (force - gravity) * (dt * dt));
        } else if t_next < imu.end() {
            n_blind += 1;
        }
    }
    n_blind
}

/// Extends `trajectory` up to (not beyond) `until` at its last velocity and angular rate.
pub fn extend_constant_velocity(trajectory: &mut Trajectory, until: f64) {
    while trajectory.end() + trajectory.dt() <= until + 1e-9 {
        let n = trajectory.len() - 1;
        let p = 2.0 * trajectory.positions()[n] - trajectory.positions()[n - 1];
        let R = trajectory.rotations()[n] * so3::exp(&trajectory.steps()[n - 1]);
        trajectory.push(p, R);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    /// A spinning IMU on a circular path: position, velocity and attitude are analytic.
    fn truth(t: f64) -> (Vector3<f64>, UnitQuaternion<f64>, Vector3<f64>) {
        let w = 1.3;
        let p = Vector3::new(2.0 * (w * t).cos(), 2.0 * (w * t).sin(), 0.0);
        (p, so3::exp(&(Vector3::new(0.1, 0.0, 6.0) * t)), -p * w * w)
    }

    #[test]
    fn noiseless_inertial_samples_reproduce_a_circular_flight() {
        let (rate, gravity) = (Vector3::new(0.1, 0.0, 6.0), Vector3::new(0.0, 0.0, 9.81));
        let (bg, ba) = (
            Vector3::new(0.01, -0.02, 0.03),
            Vector3::new(0.1, 0.05, -0.07),
        );
        let times: Vec<f64> = (0..1300).map(|k| f64::from(k) * 0.005 - 0.0512).collect();
        let accel = times
            .iter()
            .map(|&t| truth(t).1.inverse() * (truth(t).2 + gravity) + ba)
            .collect();
        let imu = Imu::new(times.clone(), vec![rate + bg; times.len()], accel);
        let (p0, p1) = (truth(0.0), truth(0.01));
        let mut trajectory =
            Trajectory::new(0.0, 0.01, vec![p0.0, p1.0], vec![p0.1, p1.1]).unwrap();
        let n_blind = extend_inertial(&mut trajectory, &imu, &bg, &ba, &gravity, 5.0);
        assert_eq!(n_blind, 0);
        assert!((trajectory.end() - 5.0).abs() < 1e-9);
        // 5 s of dead reckoning; what remains is the linear interpolation of the force.
        assert!((trajectory.positions()[500] - truth(5.0).0).norm() < 5e-3);
        assert!(trajectory.rotations()[500].angle_to(&truth(5.0).1) < 1e-6);
    }
}
