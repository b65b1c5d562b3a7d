// SPDX-License-Identifier: MIT OR Apache-2.0
//! How poses that are no longer estimated follow the calibration.
//!
//! A pose is the best one for the calibration it was estimated with; for another, another is. Were
//! final poses held, they would hold the calibration at its first value. Instead each keeps
//! `∂[δr, δt]/∂(global states)`, the slope of its conditional mean given the calibration, and moves
//! with it. Biases drift, but little against what was not known of them at first.

use bentwing_trajectory::{CorrectionSpline, Trajectory};
use nalgebra::Vector3;

use crate::solve::Solution;
use crate::{GlobalVector, N_GLOBALS, NormalEquations};

/// `∂[δr, δt]/∂(global states)` of a pose or a control point.
pub type PoseResponse = [GlobalVector; 6];

/// The response of a pose that nothing moves.
pub const UNMOVED: PoseResponse = [[0.0; N_GLOBALS]; 6];

/// Number of control points by which a window joins the past.
pub const N_JOINED: usize = 3;

/// Correction `[δr, δt]` of a pose for a correction of the global states.
pub fn followed(response: &PoseResponse, globals: &GlobalVector) -> [f64; 6] {
    response.map(|row| row.iter().zip(globals).map(|(a, b)| a * b).sum())
}

/// The first three control points of a spline that begins where the past ends: they reproduce value,
/// slope and curvature of the `responses` of `trajectory` at its start.
pub fn joined(
    responses: &[PoseResponse],
    trajectory: &Trajectory,
    spline: &CorrectionSpline,
) -> [PoseResponse; N_JOINED] {
    let mut controls = [UNMOVED; N_JOINED];
    let half = (0.5 * spline.h() / trajectory.dt()).round().max(1.0);
    let [Some(f0), Some(f1), Some(f2)] = [0, 1, 2].map(|k| responses.get(k * half as usize)) else {
        return controls;
    };
    let intervals = spline.h() / (half * trajectory.dt());
    for part in 0..6 {
        for g in 0..N_GLOBALS {
            let (f0, f1, f2) = (f0[part][g], f1[part][g], f2[part][g]);
            // Both per knot interval.
            let curvature = (f0 - 2.0 * f1 + f2) * intervals * intervals;
            let slope = 0.5 * (4.0 * f1 - 3.0 * f0 - f2) * intervals;
            let middle = f0 - curvature / 6.0;
            controls[0][part][g] = middle - slope + 0.5 * curvature;
            controls[1][part][g] = middle;
            controls[2][part][g] = middle + slope + 0.5 * curvature;
        }
    }
    controls
}

/// Responses of the samples of `trajectory` from those of the control points.
pub fn at_samples(
    controls: &[PoseResponse],
    trajectory: &Trajectory,
    spline: &CorrectionSpline,
) -> Vec<PoseResponse> {
    let at = |n| {
        let basis = spline.basis(trajectory.time(n));
        let mut response = UNMOVED;
        for (w, control) in basis.weights.iter().zip(&controls[basis.first..]) {
            let entries = response.as_flattened_mut().iter_mut();
            for (r, c) in entries.zip(control.as_flattened()) {
                *r += w * c;
            }
        }
        response
    };
    (0..trajectory.len()).map(at).collect()
}

/// Makes the first control points functions of the global states: they are no unknowns any more.
pub fn tie(equations: &mut NormalEquations, ties: &[PoseResponse]) {
    // `J_k δ_k = J_k T_k g`: the rows of k go to the columns of g.
    let mut arrows = vec![[[0.0; 6]; N_GLOBALS]; equations.n_controls()];
    for ((row, column), block) in equations.blocks() {
        let lower = |r: usize, c: usize| block[c][r];
        let symmetric = |r: usize, c: usize| block[r.min(c)][r.max(c)];
        if row == column {
            if let Some(tie) = ties.get(row) {
                add_product(&mut arrows[row], symmetric, tie);
            }
            continue;
        }
        if let Some(tie) = ties.get(column) {
            add_product(&mut arrows[row], lower, tie);
        }
        if let Some(tie) = ties.get(row) {
            add_product(&mut arrows[column], |r, c| lower(c, r), tie);
        }
    }
    for (k, tie) in ties.iter().enumerate() {
        let (own, gradient) = (*equations.arrow(k), *equations.knot_gradient(k));
        for g in 0..N_GLOBALS {
            for h in 0..=g {
                let entry = |i: usize| {
                    let both = own[h][i] + arrows[k][h][i];
                    tie[i][g] * both + tie[i][h] * own[g][i]
                };
                equations.add_corner(g, h, (0..6).map(entry).sum());
            }
            let pull: f64 = (0..6).map(|i| tie[i][g] * gradient[i]).sum();
            equations.global_gradient[g] += pull;
        }
    }
    for (k, added) in arrows.iter().enumerate() {
        let arrow = equations.arrow_mut(k).as_flattened_mut().iter_mut();
        for (to, from) in arrow.zip(added.as_flattened()) {
            *to += from;
        }
    }
}

/// `arrow += block · tie`.
fn add_product(
    arrow: &mut [[f64; 6]; N_GLOBALS],
    block: impl Fn(usize, usize) -> f64,
    tie: &PoseResponse,
) {
    for (g, column) in arrow.iter_mut().enumerate() {
        for (r, entry) in column.iter_mut().enumerate() {
            *entry += (0..6).map(|c| block(r, c) * tie[c][g]).sum::<f64>();
        }
    }
}

/// Sets the control points that follow the global states.
pub fn complete(step: &mut Solution, ties: &[PoseResponse]) {
    for (knot, tie) in step.knots.iter_mut().zip(ties) {
        *knot = followed(tie, &step.globals);
    }
}

/// Corrects poses for a correction of the global states.
pub fn follow(trajectory: &mut Trajectory, responses: &[PoseResponse], globals: &GlobalVector) {
    let correction = |response: &PoseResponse| {
        let d = followed(response, globals);
        [
            Vector3::new(d[0], d[1], d[2]),
            Vector3::new(d[3], d[4], d[5]),
        ]
    };
    let corrections: Vec<_> = responses.iter().map(correction).collect();
    trajectory.correct(&corrections);
}

#[cfg(test)]
mod tests {
    use bentwing_trajectory::TrajectoryError;

    use super::*;
    use crate::rows::RowGroup;
    use crate::solve::testing::equations;
    use crate::solve::{SolveError, Solver};

    const N: usize = 12;
    const NONE_FROZEN: [bool; N_GLOBALS] = [false; N_GLOBALS];

    fn response(seed: f64) -> PoseResponse {
        std::array::from_fn(|i| {
            std::array::from_fn(|g| (seed + 0.7 * i as f64 + 1.3 * g as f64).sin())
        })
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
        complete(&mut step, &ties());

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
            complete(&mut step, &ties());
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
}
