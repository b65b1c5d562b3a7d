// SPDX-License-Identifier: MIT OR Apache-2.0
//! The trajectory turns and accelerates as the IMU measured, sample by sample.

use bentwing_trajectory::{
    CorrectionSpline, Imu, Increment, InertialUnit, NodeForce, Trajectory, so3,
};
use nalgebra::{Matrix3, Vector3};

use super::shown_noise::ShownNoise;
use super::stencil::{StencilRows, add_stencil};
use crate::globals::OFF_DIAGONAL;
use crate::{GlobalVector, Globals, ImuNoise, N_GLOBALS, NormalEquations, index};

/// `e = dθ_n/dt − Log(R_nᵀ R_{n+1})/dt`, with the turn as the unit means it, rad/s, imu frame.
pub fn gyro_residual(
    trajectory: &Trajectory,
    globals: &Globals,
    n: usize,
    said: &Increment,
) -> Vector3<f64> {
    let dt = trajectory.dt();
    (globals.unit.turn(said, dt) - trajectory.steps()[n]) / dt
}

/// `e = F_n − R_nᵀ (a_n + g)`, with the force as the unit means it, m/s², imu frame;
/// `1 <= n < len - 1`.
pub fn accel_residual(
    trajectory: &Trajectory,
    globals: &Globals,
    n: usize,
    node: &NodeForce,
) -> Vector3<f64> {
    let force = trajectory.acceleration(n) + globals.gravity;
    globals.unit.force(node) - trajectory.rotations()[n].inverse() * force
}

/// What the IMU says at one sample: three rows of the control points `first .. first + 5`.
pub(crate) struct SampleRows {
    pub first: usize,
    /// Without those of axes that were at their limit.
    pub known: [bool; 3],
    pub residual: Vector3<f64>,
    pub knots: [[f64; 30]; 3],
    pub globals: [GlobalVector; 3],
}

impl SampleRows {
    /// Adds the rows, with the weight of a sigma and as much more noise than that as is shown.
    fn add(&self, rows: &mut StencilRows<'_>, stated: f64, shown: f64) {
        let group = rows.group(self.first);
        for row in (0..3).filter(|&row| self.known[row]) {
            group.knots_mut().copy_from_slice(&self.knots[row]);
            group
                .globals_mut()
                .copy_from_slice(&self.globals[row][index::INERTIAL]);
            group.add(
                self.residual[row],
                stated.powi(-2) * (shown / stated).powi(2),
            );
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
    shown: &ShownNoise,
) -> usize {
    let mut rows = StencilRows::new(equations);
    let mut n_blind = 0;
    for n in 0..trajectory.len() - 1 {
        let now = shown.at(trajectory.time(n), noise);
        match gyro_rows(trajectory, imu, globals, spline, n) {
            Some(said) => said.add(&mut rows, noise.gyro, now.gyro),
            None => n_blind += 1,
        }
        if n > 0
            && let Some(said) = accel_rows(trajectory, imu, globals, spline, n)
        {
            said.add(&mut rows, noise.accel, now.accel);
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
    let (from, to) = (trajectory.time(n), trajectory.time(n + 1));
    let said = imu.increment(from, to)?;
    let [known @ .., _, _, _] = imu.known(from, to);
    Some(SampleRows {
        known,
        ..gyro_rows_of(trajectory, globals, spline, n, &said)
    })
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
    let [_, _, _, known @ ..] = imu.known(trajectory.time(n - 1), trajectory.time(n + 1));
    Some(SampleRows {
        known,
        ..accel_rows_of(trajectory, globals, spline, n, &node)
    })
}

fn gyro_rows_of(
    trajectory: &Trajectory,
    globals: &Globals,
    spline: &CorrectionSpline,
    n: usize,
    said: &Increment,
) -> SampleRows {
    let dt = trajectory.dt();
    let times = [trajectory.time(n), trajectory.time(n + 1)];
    let stencil = spline.stencil(times, [-1.0 / dt, 1.0 / dt]);
    let R_next = so3::matrix(&trajectory.rotations()[n + 1]);
    let J = -so3::right_jacobian_inverse(&trajectory.steps()[n]) * R_next.transpose();
    let mut rows = SampleRows {
        first: stencil.first,
        known: [true; 3],
        residual: gyro_residual(trajectory, globals, n, said),
        knots: [[0.0; 30]; 3],
        globals: [[0.0; N_GLOBALS]; 3],
    };
    for row in 0..3 {
        add_stencil(&mut rows.knots[row], &stencil, &J, row, 0);
    }
    add_gyro_states(&mut rows.globals, &globals.unit, said, dt);
    rows
}

/// Derivatives of the mean rate by what the unit's gyro does.
fn add_gyro_states(rows: &mut [GlobalVector; 3], unit: &InertialUnit, said: &Increment, dt: f64) {
    let rate = said.turned / dt - unit.gyro_bias;
    let force = said.pushed / dt - unit.reference;
    let bias = -(Matrix3::identity() + unit.gyro);
    for (row, entries) in rows.iter_mut().enumerate() {
        for c in 0..3 {
            entries[index::GYRO_BIAS.start + c] = bias[(row, c)];
            entries[index::G_SENSITIVITY.start + 3 * row + c] = -force[c];
        }
        entries[index::GYRO_SCALE.start + row] = rate[row];
    }
    for (k, places) in unit.misalignments().iter().enumerate() {
        for &(row, c) in places {
            rows[row][index::GYRO_MISALIGNMENT.start + k] = rate[c];
        }
    }
}

/// Derivatives of the mean force by what the unit's accelerometer does.
fn add_accel_states(rows: &mut [GlobalVector; 3], unit: &InertialUnit, node: &NodeForce) {
    // Of the force by the entry (i, j) of the matrix.
    let by = |(i, j): (usize, usize)| {
        node.by_axis[j].column(i) - node.gain.column(i) * unit.reference[j]
    };
    let scales = [0, 1, 2].map(|axis| by((axis, axis)));
    let leans = OFF_DIAGONAL.map(by);
    for (row, entries) in rows.iter_mut().enumerate() {
        for (c, scale) in scales.iter().enumerate() {
            entries[index::ACCEL_BIAS.start + c] = -node.gain[(row, c)];
            entries[index::ACCEL_SCALE.start + c] = scale[row];
        }
        for (c, lean) in leans.iter().enumerate() {
            entries[index::ACCEL_MISALIGNMENT.start + c] = lean[row];
        }
    }
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
        known: [true; 3],
        residual: accel_residual(trajectory, globals, n, node),
        knots: [[0.0; 30]; 3],
        globals: [[0.0; N_GLOBALS]; 3],
    };
    for row in 0..3 {
        add_stencil(&mut rows.knots[row], &curvature, &-R_imu_map, row, 3);
        add_stencil(&mut rows.knots[row], &value, &J_rotation, row, 0);
        for c in 0..2 {
            rows.globals[row][index::GRAVITY.start + c] = J_gravity[(row, c)];
        }
    }
    add_accel_states(&mut rows.globals, &globals.unit, node);
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
            let said = Increment {
                turned: Vector3::new(0.01, -0.03, 0.05),
                pushed: Vector3::new(0.02, 0.01, 0.09),
            };
            let sigma = 0.7;
            assert_rows(
                &scene,
                |equations| {
                    let mut rows = StencilRows::new(equations);
                    let (t, g) = (&scene.trajectory, &scene.globals);
                    gyro_rows_of(t, g, &scene.spline(), n, &said).add(&mut rows, sigma, sigma);
                    rows.flush();
                },
                |t, g| (gyro_residual(t, g, n, &said) / sigma).as_slice().to_vec(),
            )?;
        }

        #[test]
        fn accelerometer_rows_agree_with_central_differences(scene in Scene::any(), n in 1..40_usize) {
            let turned = |angle: f64| so3::matrix(&so3::exp(&Vector3::new(angle, 0.02, -0.03)));
            let node = NodeForce {
                by_axis: [turned(0.1) * 0.3, turned(-0.2) * -1.0, turned(0.05) * 9.0],
                gain: turned(0.07) * 0.98,
            };
            let sigma = 0.3;
            assert_rows(
                &scene,
                |equations| {
                    let mut rows = StencilRows::new(equations);
                    let (t, g) = (&scene.trajectory, &scene.globals);
                    accel_rows_of(t, g, &scene.spline(), n, &node).add(&mut rows, sigma, sigma);
                    rows.flush();
                },
                |t, g| (accel_residual(t, g, n, &node) / sigma).as_slice().to_vec(),
            )?;
        }
    }
}
