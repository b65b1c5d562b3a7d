// SPDX-License-Identifier: MIT OR Apache-2.0
//! The trajectory turns and accelerates as the IMU measured, sample by sample.

use bentwing_trajectory::{CorrectionSpline, Imu, NodeForce, Trajectory, so3};
use nalgebra::{Matrix3, Vector3};

use super::stencil::{StencilRows, add_stencil};
use crate::{Globals, ImuNoise, NormalEquations, index};

/// `e = dθ_n/dt − b_g − Log(R_nᵀ R_{n+1})/dt`, rad/s, imu frame.
pub fn gyro_residual(
    trajectory: &Trajectory,
    globals: &Globals,
    n: usize,
    turned: &Vector3<f64>,
) -> Vector3<f64> {
    (turned - trajectory.steps()[n]) / trajectory.dt() - globals.gyro_bias
}

/// `e = F_n − M_n b_a − R_nᵀ (a_n + g)`, m/s², imu frame; `1 <= n < len - 1`.
pub fn accel_residual(
    trajectory: &Trajectory,
    globals: &Globals,
    n: usize,
    node: &NodeForce,
) -> Vector3<f64> {
    let force = trajectory.acceleration(n) + globals.gravity;
    node.force - node.bias_gain * globals.accel_bias - trajectory.rotations()[n].inverse() * force
}

/// Adds the rows of all samples; returns the number of samples without inertial data.
pub fn add(
    equations: &mut NormalEquations,
    trajectory: &Trajectory,
    imu: &Imu,
    globals: &Globals,
    spline: &CorrectionSpline,
    noise: &ImuNoise,
) -> usize {
    let mut rows = StencilRows::new(equations);
    let mut n_blind = 0;
    for n in 0..trajectory.len() - 1 {
        let turned = imu.rotation_increment(trajectory.time(n), trajectory.time(n + 1));
        match turned {
            Some(turned) => add_gyro(&mut rows, trajectory, globals, spline, noise, n, &turned),
            None => n_blind += 1,
        }
        if n > 0
            && let Some(node) = imu.node_force(trajectory, n)
        {
            add_accel(&mut rows, trajectory, globals, spline, noise, n, &node);
        }
    }
    rows.flush();
    n_blind
}

fn add_gyro(
    rows: &mut StencilRows<'_>,
    trajectory: &Trajectory,
    globals: &Globals,
    spline: &CorrectionSpline,
    noise: &ImuNoise,
    n: usize,
    turned: &Vector3<f64>,
) {
    let dt = trajectory.dt();
    let times = [trajectory.time(n), trajectory.time(n + 1)];
    let stencil = spline.stencil(times, [-1.0 / dt, 1.0 / dt]);
    let R_next = so3::matrix(&trajectory.rotations()[n + 1]);
    let J = -so3::right_jacobian_inverse(&trajectory.steps()[n]) * R_next.transpose();
    let e = gyro_residual(trajectory, globals, n, turned);
    let group = rows.group(stencil.first);
    for row in 0..3 {
        group.clear_row();
        add_stencil(group.knots_mut(), &stencil, &J, row, 0);
        group.globals_mut()[index::GYRO_BIAS.start + row] = -1.0;
        group.add(e[row], noise.gyro.powi(-2));
    }
}

fn add_accel(
    rows: &mut StencilRows<'_>,
    trajectory: &Trajectory,
    globals: &Globals,
    spline: &CorrectionSpline,
    noise: &ImuNoise,
    n: usize,
    node: &NodeForce,
) {
    let (t, dt) = (trajectory.time(n), trajectory.dt());
    let times = [t - dt, t, t + dt];
    let d2 = 1.0 / (dt * dt);
    let curvature = spline.stencil(times, [d2, -2.0 * d2, d2]);
    let value = spline.stencil(times, [0.0, 1.0, 0.0]);
    let R_imu_map = so3::matrix(&trajectory.rotations()[n]).transpose();
    let force = trajectory.acceleration(n) + globals.gravity;
    let J_rotation = -R_imu_map * so3::hat(&force);
    let J_gravity: Matrix3<f64> = R_imu_map * so3::hat(&globals.gravity);
    let e = accel_residual(trajectory, globals, n, node);
    let group = rows.group(curvature.first);
    for row in 0..3 {
        group.clear_row();
        add_stencil(group.knots_mut(), &curvature, &-R_imu_map, row, 3);
        add_stencil(group.knots_mut(), &value, &J_rotation, row, 0);
        let g = group.globals_mut();
        for c in 0..3 {
            g[index::ACCEL_BIAS.start + c] = -node.bias_gain[(row, c)];
        }
        for c in 0..2 {
            g[index::GRAVITY.start + c] = J_gravity[(row, c)];
        }
        group.add(e[row], noise.accel.powi(-2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraints::testing::{Scene, assert_rows};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn gyro_rows_agree_with_central_differences(scene in Scene::any(), n in 1..40_usize) {
            let turned = Vector3::new(0.01, -0.03, 0.05);
            let noise = ImuNoise { gyro: 0.7, accel: 1.0 };
            assert_rows(
                &scene,
                |equations| {
                    let mut rows = StencilRows::new(equations);
                    let (t, g) = (&scene.trajectory, &scene.globals);
                    add_gyro(&mut rows, t, g, &scene.spline(), &noise, n, &turned);
                    rows.flush();
                },
                |t, g| (gyro_residual(t, g, n, &turned) / noise.gyro).as_slice().to_vec(),
            )?;
        }

        #[test]
        fn accelerometer_rows_agree_with_central_differences(scene in Scene::any(), n in 1..40_usize) {
            let node = NodeForce {
                force: Vector3::new(0.3, -1.0, 9.0),
                bias_gain: Matrix3::identity() * 0.98,
            };
            let noise = ImuNoise { gyro: 1.0, accel: 0.3 };
            assert_rows(
                &scene,
                |equations| {
                    let mut rows = StencilRows::new(equations);
                    let (t, g) = (&scene.trajectory, &scene.globals);
                    add_accel(&mut rows, t, g, &scene.spline(), &noise, n, &node);
                    rows.flush();
                },
                |t, g| (accel_residual(t, g, n, &node) / noise.accel).as_slice().to_vec(),
            )?;
        }
    }
}
