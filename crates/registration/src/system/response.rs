// SPDX-License-Identifier: MIT OR Apache-2.0
//! How poses that are no longer estimated follow the calibration.
//!
//! A pose is the best one for the calibration it was estimated with; for another, another is. Were
//! final poses held, they would hold the calibration at its first value. Instead each keeps
//! `∂[δr, δt]/∂(global states)`, the slope of its conditional mean given the calibration, and moves
//! with it. Biases drift, but little against what was not known of them at first.

use bentwing_trajectory::{CorrectionSpline, Trajectory};

use super::normal_equations::NormalEquations;
use crate::globals::{GlobalVector, N_GLOBALS};

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

/// Corrects poses for a correction of the global states.
pub fn follow(trajectory: &mut Trajectory, responses: &[PoseResponse], globals: &GlobalVector) {
    let corrections: Vec<_> = responses.iter().map(|r| followed(r, globals)).collect();
    trajectory.correct(&corrections);
}

#[cfg(test)]
mod tests;
