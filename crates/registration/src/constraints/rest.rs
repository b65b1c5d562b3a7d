// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where the trajectory rests it goes on resting.
//!
//! A static start is known from the inertial data. A scan plane that does not turn sees no surfels, so
//! nothing else would hold it.

use std::ops::Range;

use bentwing_trajectory::{CorrectionSpline, Trajectory, so3};
use nalgebra::{Matrix3, Vector3};

use super::stencil::{StencilRows, add_stencil};
use crate::NormalEquations;

/// Slower than this nothing flies, m/s and rad/s: a trajectory that rests was made so.
const STILL: f64 = 1e-4;
/// A shorter rest is a turning point, s.
const MIN_REST: f64 = 0.5;
/// Standard deviations of the velocity at rest, m/s, and of the angular rate, rad/s, of one sample.
const VELOCITY_SIGMA: f64 = 1e-3;
const RATE_SIGMA: f64 = 1e-4;

/// The stretches of samples that rest.
pub fn stretches(trajectory: &Trajectory) -> Vec<Range<usize>> {
    let rests = |n: usize| {
        let (v, omega) = rates(trajectory, n);
        v.norm() < STILL && omega.norm() < STILL
    };
    let steps: Vec<usize> = (0..trajectory.len() - 1).collect();
    let runs = steps.chunk_by(|&a, &b| rests(a) == rests(b));
    let least = (MIN_REST / trajectory.dt()) as usize;
    runs.filter(|run| rests(run[0]) && run.len() >= least)
        .map(|run| run[0]..run[run.len() - 1] + 1)
        .collect()
}

/// Adds zero velocity and zero angular rate as rows of the samples in `stretches`.
pub fn add(
    equations: &mut NormalEquations,
    trajectory: &Trajectory,
    spline: &CorrectionSpline,
    stretches: &[Range<usize>],
) {
    let mut rows = StencilRows::new(equations);
    for n in stretches.iter().flat_map(Clone::clone) {
        add_step(&mut rows, trajectory, spline, n);
    }
    rows.flush();
}

/// Velocity, m/s, map frame, and angular rate, rad/s, imu frame, from sample `n` to the next.
fn rates(trajectory: &Trajectory, n: usize) -> (Vector3<f64>, Vector3<f64>) {
    let p = trajectory.positions();
    let dt = trajectory.dt();
    ((p[n + 1] - p[n]) / dt, trajectory.steps()[n] / dt)
}

fn add_step(
    rows: &mut StencilRows<'_>,
    trajectory: &Trajectory,
    spline: &CorrectionSpline,
    n: usize,
) {
    let dt = trajectory.dt();
    let times = [trajectory.time(n), trajectory.time(n + 1)];
    let stencil = spline.stencil(times, [-1.0 / dt, 1.0 / dt]);
    let R_next = so3::matrix(&trajectory.rotations()[n + 1]);
    let J = so3::right_jacobian_inverse(&trajectory.steps()[n]) * R_next.transpose();
    let (v, omega) = rates(trajectory, n);
    let group = rows.group(stencil.first);
    for row in 0..3 {
        group.clear_row();
        add_stencil(group.knots_mut(), &stencil, &Matrix3::identity(), row, 3);
        group.add(v[row], VELOCITY_SIGMA.powi(-2));
        group.clear_row();
        add_stencil(group.knots_mut(), &stencil, &J, row, 0);
        group.add(omega[row], RATE_SIGMA.powi(-2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraints::testing::{Scene, assert_rows};
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rest_rows_agree_with_central_differences(scene in Scene::any(), n in 1..40_usize) {
            assert_rows(
                &scene,
                |equations| {
                    let mut rows = StencilRows::new(equations);
                    add_step(&mut rows, &scene.trajectory, &scene.spline(), n);
                    rows.flush();
                },
                |t, _| {
                    let (v, omega) = rates(t, n);
                    [(v / VELOCITY_SIGMA).as_slice(), (omega / RATE_SIGMA).as_slice()].concat()
                },
            )?;
        }
    }

    #[test]
    fn a_start_at_rest_is_found_and_a_flight_is_none() {
        let at = |n: u32| Vector3::x() * (0.01 * f64::from(n.saturating_sub(100)));
        let positions: Vec<_> = (0..301).map(at).collect();
        let rotations = vec![UnitQuaternion::identity(); 301];
        let trajectory = Trajectory::new(0.0, 0.01, positions, rotations).unwrap();
        let found = stretches(&trajectory);
        assert_eq!((found.len(), &found[0]), (1, &(0..100)));
        assert!(stretches(&Scene::still_for(0.3)).is_empty());
    }
}
