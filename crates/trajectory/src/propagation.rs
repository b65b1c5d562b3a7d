// SPDX-License-Identifier: MIT OR Apache-2.0
//! Extends a trajectory beyond its end: by the IMU, or at constant velocity.

use nalgebra::Vector3;

use crate::{Imu, InertialUnit, Trajectory, so3};

/// Extends `trajectory` up to (not beyond) `until` by the inertial samples.
///
/// `R_{n+1} = R_n Exp(dθ_n)` and `p_{n+1} = 2 p_n − p_{n−1} + dt² (F_n − g)`, with turns and forces as
/// `unit` means them and `gravity` pointing up. These equations also define the IMU residuals, so that
/// a fresh prior has residual zero. Across a short gap of the IMU lead straight lines between its
/// samples; in a longer one, and beyond its end, the motion goes on at constant velocity and rate.
/// Returns the number of samples in gaps.
pub fn extend_inertial(
    trajectory: &mut Trajectory,
    imu: &Imu,
    unit: &InertialUnit,
    gravity: &Vector3<f64>,
    until: f64,
) -> usize {
    let dt = trajectory.dt();
    let bridged = imu.bridged();
    let mut n_blind = 0;
    while trajectory.end() + dt <= until + 1e-9 {
        let n = trajectory.len() - 1;
        let (t, t_next) = (trajectory.time(n), trajectory.time(n + 1));
        let turned = bridged
            .increment(t, t_next)
            .map(|said| unit.turn(&said, dt));
        let step = turned.unwrap_or(trajectory.steps()[n - 1]);
        let R = trajectory.rotations()[n] * so3::exp(&step);
        let p = trajectory.positions()[n];
        let constant_velocity = 2.0 * p - trajectory.positions()[n - 1];
        // The force around node n needs the rotation after it.
        trajectory.push(constant_velocity, R);
        if let Some(node) = bridged.node_force(trajectory, n) {
            let force = trajectory.rotations()[n] * unit.force(&node);
            trajectory.set_last_position(constant_velocity + (force - gravity) * (dt * dt));
        }
        if t_next < imu.end() && imu.node_force(trajectory, n).is_none() {
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
mod tests;
