// SPDX-License-Identifier: MIT OR Apache-2.0
//! The trajectory turns and accelerates as the IMU measured, sample by sample.

use bentwing_trajectory::{CorrectionSpline, Imu, NodeForce, Trajectory, so3};
use nalgebra::{Matrix3, Vector3};

use super::stencil::{StencilRows, add_stencil};
use crate::{GlobalVector, Globals, ImuNoise, N_GLOBALS, NormalEquations, index};

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

/// What the IMU says at one sample: three rows of the control points `first .. first + 5`.
pub(crate) struct SampleRows {
    pub first: usize,
    pub residual: Vector3<f64>,
    pub knots: [[f64; 30]; 3],
    pub globals: [GlobalVector; 3],
}

impl SampleRows {
    fn add(&self, rows: &mut StencilRows<'_>, sigma: f64) {
        let group = rows.group(self.first);
        for row in 0..3 {
            group.knots_mut().copy_from_slice(&self.knots[row]);
            group.globals_mut().copy_from_slice(&self.globals[row]);
            group.add(self.residual[row], sigma.powi(-2));
        }
    }
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
        match gyro_rows(trajectory, imu, globals, spline, n) {
            Some(said) => said.add(&mut rows, noise.gyro),
            None => n_blind += 1,
        }
        if n > 0
            && let Some(said) = accel_rows(trajectory, imu, globals, spline, n)
        {
            said.add(&mut rows, noise.accel);
        }
    }
    rows.flush();
    n_blind
}

/// What the gyro says of the turn from sample `n` to the next one; `None` in a gap.
pub(crate) fn gyro_rows(
    trajectory: &Trajectory,
    imu: &Imu,
    globals: &Globals,
    spline: &CorrectionSpline,
    n: usize,
) -> Option<SampleRows> {
    let turned = imu.rotation_increment(trajectory.time(n), trajectory.time(n + 1))?;
    Some(gyro_rows_of(trajectory, globals, spline, n, &turned))
}

/// What the accelerometer says around sample `n`; `None` in a gap. `1 <= n < len - 1`.
pub(crate) fn accel_rows(
    trajectory: &Trajectory,
    imu: &Imu,
    globals: &Globals,
    spline: &CorrectionSpline,
    n: usize,
) -> Option<SampleRows> {
    let node = imu.node_force(trajectory, n)?;
    Some(accel_rows_of(trajectory, globals, spline, n, &node))
}

fn gyro_rows_of(
    trajectory: &Trajectory,
    globals: &Globals,
    spline: &CorrectionSpline,
    n: usize,
    turned: &Vector3<f64>,
) -> SampleRows {
    let dt = trajectory.dt();
    let times = [trajectory.time(n), trajectory.time(n + 1)];
    let stencil = spline.stencil(times, [-1.0 / dt, 1.0 / dt]);
    let R_next = so3::matrix(&trajectory.rotations()[n + 1]);
    let J = -so3::right_jacobian_inverse(&trajectory.steps()[n]) * R_next.transpose();
    let mut rows = SampleRows {
        first: stencil.first,
        residual: gyro_residual(trajectory, globals, n, turned),
        knots: [[0.0; 30]; 3],
        globals: [[0.0; N_GLOBALS]; 3],
    };
    for row in 0..3 {
        add_stencil(&mut rows.knots[row], &stencil, &J, row, 0);
        rows.globals[row][index::GYRO_BIAS.start + row] = -1.0;
    }
    rows
}

fn accel_rows_of(
    trajectory: &Trajectory,
    globals: &Globals,
    spline: &CorrectionSpline,
    n: usize,
    node: &NodeForce,
) -> SampleRows {
    let (t, dt) = (trajectory.time(n), trajectory.dt());
    let times = [t - dt, t, t + dt];
    let d2 = 1.0 / (dt * dt);
    let curvature = spline.stencil(times, [d2, -2.0 * d2, d2]);
    let value = spline.stencil(times, [0.0, 1.0, 0.0]);
    let R_imu_map = so3::matrix(&trajectory.rotations()[n]).transpose();
    let force = trajectory.acceleration(n) + globals.gravity;
    let J_rotation = -R_imu_map * so3::hat(&force);
    let J_gravity: Matrix3<f64> = R_imu_map * so3::hat(&globals.gravity);
    let mut rows = SampleRows {
        first: curvature.first,
        residual: accel_residual(trajectory, globals, n, node),
        knots: [[0.0; 30]; 3],
        globals: [[0.0; N_GLOBALS]; 3],
    };
    for row in 0..3 {
        add_stencil(&mut rows.knots[row], &curvature, &-R_imu_map, row, 3);
        add_stencil(&mut rows.knots[row], &value, &J_rotation, row, 0);
        let g = &mut rows.globals[row];
        for c in 0..3 {
            g[index::ACCEL_BIAS.start + c] = -node.bias_gain[(row, c)];
        }
        for c in 0..2 {
            g[index::GRAVITY.start + c] = J_gravity[(row, c)];
        }
    }
    rows
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
            let sigma = 0.7;
            assert_rows(
                &scene,
                |equations| {
                    let mut rows = StencilRows::new(equations);
                    let (t, g) = (&scene.trajectory, &scene.globals);
                    gyro_rows_of(t, g, &scene.spline(), n, &turned).add(&mut rows, sigma);
                    rows.flush();
                },
                |t, g| (gyro_residual(t, g, n, &turned) / sigma).as_slice().to_vec(),
            )?;
        }

        #[test]
        fn accelerometer_rows_agree_with_central_differences(scene in Scene::any(), n in 1..40_usize) {
            let node = NodeForce {
                force: Vector3::new(0.3, -1.0, 9.0),
                bias_gain: Matrix3::identity() * 0.98,
            };
            let sigma = 0.3;
            assert_rows(
                &scene,
                |equations| {
                    let mut rows = StencilRows::new(equations);
                    let (t, g) = (&scene.trajectory, &scene.globals);
                    accel_rows_of(t, g, &scene.spline(), n, &node).add(&mut rows, sigma);
                    rows.flush();
                },
                |t, g| (accel_residual(t, g, n, &node) / sigma).as_slice().to_vec(),
            )?;
        }
    }
}
