// SPDX-License-Identifier: MIT OR Apache-2.0
//! Without an IMU: velocity and angular rate change little from sample to sample.

use bentwing_trajectory::{CorrectionSpline, Trajectory, so3};
use nalgebra::{Matrix3, Vector3};

use super::stencil::{StencilRows, add_stencil};
use crate::{NormalEquations, Settings};

/// Change of the angular rate around sample `n`, rad/s², imu frame; `1 <= n < len - 1`.
pub fn angular_residual(trajectory: &Trajectory, n: usize) -> Vector3<f64> {
    let steps = trajectory.steps();
    (steps[n] - steps[n - 1]) / (trajectory.dt() * trajectory.dt())
}

/// Adds white accelerations of the expected densities as rows of all samples.
pub fn add(
    equations: &mut NormalEquations,
    trajectory: &Trajectory,
    spline: &CorrectionSpline,
    settings: &Settings,
) {
    let mut rows = StencilRows::new(equations);
    for n in 1..trajectory.len() - 1 {
        add_accel(&mut rows, trajectory, spline, settings, n);
        add_angular(&mut rows, trajectory, spline, settings, n);
    }
    rows.flush();
}

fn add_accel(
    rows: &mut StencilRows<'_>,
    trajectory: &Trajectory,
    spline: &CorrectionSpline,
    settings: &Settings,
    n: usize,
) {
    let (t, dt) = (trajectory.time(n), trajectory.dt());
    let d2 = 1.0 / (dt * dt);
    let curvature = spline.stencil([t - dt, t, t + dt], [d2, -2.0 * d2, d2]);
    let e = trajectory.acceleration(n);
    let weight = dt / settings.motion_accel_density.powi(2);
    let group = rows.group(curvature.first);
    for row in 0..3 {
        group.clear_row();
        add_stencil(group.knots_mut(), &curvature, &Matrix3::identity(), row, 3);
        group.add(e[row], weight);
    }
}

fn add_angular(
    rows: &mut StencilRows<'_>,
    trajectory: &Trajectory,
    spline: &CorrectionSpline,
    settings: &Settings,
    n: usize,
) {
    let (t, dt) = (trajectory.time(n), trajectory.dt());
    let times = [t - dt, t, t + dt];
    let d2 = 1.0 / (dt * dt);
    let after = spline.stencil(times, [0.0, -d2, d2]);
    let before = spline.stencil(times, [d2, -d2, 0.0]);
    let R_imu_map = |n: usize| so3::matrix(&trajectory.rotations()[n]).transpose();
    let steps = trajectory.steps();
    let J_after = so3::right_jacobian_inverse(&steps[n]) * R_imu_map(n + 1);
    let J_before = so3::right_jacobian_inverse(&steps[n - 1]) * R_imu_map(n);
    let e = angular_residual(trajectory, n);
    let weight = dt / settings.motion_angular_density.powi(2);
    let group = rows.group(after.first);
    for row in 0..3 {
        group.clear_row();
        add_stencil(group.knots_mut(), &after, &J_after, row, 0);
        add_stencil(group.knots_mut(), &before, &J_before, row, 0);
        group.add(e[row], weight);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraints::testing::{Scene, assert_rows, settings};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn motion_rows_agree_with_central_differences(scene in Scene::any(), n in 1..40_usize) {
            let settings = settings();
            let scale = scene.trajectory.dt().sqrt();
            assert_rows(
                &scene,
                |equations| {
                    let mut rows = StencilRows::new(equations);
                    add_accel(&mut rows, &scene.trajectory, &scene.spline(), &settings, n);
                    add_angular(&mut rows, &scene.trajectory, &scene.spline(), &settings, n);
                    rows.flush();
                },
                |t, _| {
                    let a = t.acceleration(n) * (scale / settings.motion_accel_density);
                    let w = angular_residual(t, n) * (scale / settings.motion_angular_density);
                    [a.as_slice(), w.as_slice()].concat()
                },
            )?;
        }
    }
}
