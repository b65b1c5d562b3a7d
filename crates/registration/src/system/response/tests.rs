// SPDX-License-Identifier: MIT OR Apache-2.0

use bentwing_trajectory::TrajectoryError;

use nalgebra::Vector3;

use super::*;
use crate::system::solve::testing::equations;
use crate::{RowGroup, SolveError, Solver};

const N: usize = 12;
const NONE_FROZEN: [bool; N_GLOBALS] = [false; N_GLOBALS];

fn response(seed: f64) -> PoseResponse {
    std::array::from_fn(|i| std::array::from_fn(|g| (seed + 0.7 * i as f64 + 1.3 * g as f64).sin()))
}

fn ties() -> [PoseResponse; N_JOINED] {
    [1.0, 2.0, 3.0].map(response)
}

fn assert_near(a: &[f64], b: &[f64], tolerance: f64) {
    for (a, b) in a.iter().zip(b) {
        assert!(
            (a - b).abs() < tolerance * (1.0 + b.abs()),
            "{a} is not {b}"
        );
    }
}

#[test]
fn tied_control_points_are_where_stiff_rows_would_hold_them() -> Result<(), SolveError> {
    let mut tied = equations(N);
    tie(&mut tied, &ties());
    let factorized = Solver::default().factorize(&tied, N_JOINED, &NONE_FROZEN)?;
    let mut step = factorized.solve();
    step.complete(&ties());

    let mut stiff = equations(N);
    for (control, tie) in ties().iter().enumerate() {
        let mut group = RowGroup::new([control]);
        for (i, part) in tie.iter().enumerate() {
            group.clear_row();
            group.knots_mut()[i] = 1.0;
            for (entry, t) in group.globals_mut().iter_mut().zip(part) {
                *entry = -t;
            }
            group.add(0.0, 1e9);
        }
        group.flush(&mut stiff);
    }
    let factorized = Solver::default().factorize(&stiff, 0, &NONE_FROZEN)?;
    let expected = factorized.solve();
    assert_near(&step.globals, &expected.globals, 1e-5);
    for (knot, expected) in step.knots.iter().zip(&expected.knots) {
        assert_near(knot, expected, 1e-5);
    }
    Ok(())
}

#[test]
fn responses_tell_where_control_points_go_when_the_globals_are_held_elsewhere()
-> Result<(), SolveError> {
    let solved = |held_at: Option<f64>| {
        let mut tied = equations(N);
        tie(&mut tied, &ties());
        if let Some(value) = held_at {
            for g in 0..N_GLOBALS {
                tied.add_corner(g, g, 1e9);
                tied.global_gradient[g] -= 1e9 * value * (g as f64).cos();
            }
        }
        let factorized = Solver::default().factorize(&tied, N_JOINED, &NONE_FROZEN)?;
        let mut step = factorized.solve();
        step.complete(&ties());
        Ok::<_, SolveError>((step, factorized.marginals(&ties()).responses))
    };
    let (_, responses) = solved(None)?;
    let (here, there) = (solved(Some(0.1))?.0, solved(Some(0.3))?.0);
    let moved = std::array::from_fn(|g| 0.2 * (g as f64).cos());
    for (k, response) in responses.iter().enumerate() {
        let expected: Vec<f64> = (0..6)
            .map(|i| there.knots[k][i] - here.knots[k][i])
            .collect();
        assert_near(&followed(response, &moved), &expected, 1e-5);
    }
    Ok(())
}

#[test]
fn a_joined_spline_goes_on_with_value_and_slope() -> Result<(), TrajectoryError> {
    let n = 101;
    let poses = (
        vec![Vector3::zeros(); n],
        vec![nalgebra::UnitQuaternion::identity(); n],
    );
    let trajectory = Trajectory::new(2.0, 0.01, poses.0, poses.1)?;
    let spline = CorrectionSpline::covering(trajectory.start(), trajectory.end(), 0.2);
    let parabola = |t: f64| {
        let mut response = response(0.4);
        for entry in response.as_flattened_mut() {
            *entry += *entry * (3.0 * t - 5.0 * t * t);
        }
        response
    };
    let past: Vec<_> = (0..n).map(|i| parabola(0.01 * i as f64)).collect();
    let mut controls = vec![UNMOVED; spline.n_controls()];
    controls[..N_JOINED].copy_from_slice(&joined(&past, &trajectory, &spline));
    // The fourth control point counts with the third power of time.
    let going_on = at_samples(&controls, &trajectory, &spline);
    assert_near(going_on[0].as_flattened(), past[0].as_flattened(), 1e-12);
    let slope = |r: &[PoseResponse]| -> Vec<f64> {
        let pairs = r[1].as_flattened().iter().zip(r[0].as_flattened());
        pairs.map(|(b, a)| (b - a) / 0.01).collect()
    };
    assert_near(&slope(&going_on), &slope(&past), 0.02);
    Ok(())
}
