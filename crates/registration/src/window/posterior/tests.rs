// SPDX-License-Identifier: MIT OR Apache-2.0

use super::*;
use crate::constraints::testing::Scene;
use crate::system::response::tie;
use crate::system::solve::testing;
use crate::{
    GlobalMatrix, N_GLOBALS, NormalEquations, RowGroup, Solution, SolveError, Solver, UNMOVED,
};
use nalgebra::Vector6;

const N_CLAMPED: usize = 3;
/// All but some, as with a head without motor.
const FROZEN: [bool; N_GLOBALS] = {
    let mut frozen = [false; N_GLOBALS];
    frozen[4] = true;
    frozen[17] = true;
    frozen
};

fn posterior(
    equations: &NormalEquations,
    ties: &[PoseResponse],
    spline: &CorrectionSpline,
) -> Result<Posterior, SolveError> {
    let mut tied = equations.clone();
    tie(&mut tied, ties);
    let factorized = Solver::default().factorize(&tied, ties.len(), &FROZEN)?;
    Ok(Posterior {
        factorized,
        ties: ties.to_vec(),
        spline: *spline,
    })
}

fn response(seed: f64) -> PoseResponse {
    std::array::from_fn(|i| {
        std::array::from_fn(|g| 0.1 * (seed + 0.7 * i as f64 + 1.3 * g as f64).sin())
    })
}

/// So many knot intervals that several groups of control points are solved for.
fn finely_knotted() -> (Trajectory, CorrectionSpline) {
    let trajectory = Scene::still_for(0.3);
    let spline = CorrectionSpline::covering(trajectory.start(), trajectory.end(), 0.07);
    (trajectory, spline)
}

/// The matrix of the equations, every unknown in it: control points, then global states.
fn dense(equations: &NormalEquations) -> DMatrix<f64> {
    let (n, first) = (
        6 * equations.n_controls() + N_GLOBALS,
        6 * equations.n_controls(),
    );
    let mut lower = DMatrix::zeros(n, n);
    for ((row, column), block) in equations.blocks() {
        for (c, entries) in block.iter().enumerate() {
            for (r, entry) in entries
                .iter()
                .enumerate()
                .filter(|(r, _)| row > column || *r >= c)
            {
                lower[(6 * row + r, 6 * column + c)] = *entry;
            }
        }
    }
    for k in 0..equations.n_controls() {
        for (g, column) in equations.arrow(k).iter().enumerate() {
            for (r, entry) in column.iter().enumerate() {
                lower[(first + g, 6 * k + r)] = *entry;
            }
        }
    }
    let corner: &GlobalMatrix = equations.corner();
    lower
        .view_mut((first, first), (N_GLOBALS, N_GLOBALS))
        .copy_from(&corner.lower_triangle());
    let diagonal = DMatrix::from_diagonal(&lower.diagonal());
    &lower + lower.transpose() - diagonal
}

/// From the free unknowns to all of them.
fn freedom(n_controls: usize, ties: &[PoseResponse]) -> DMatrix<f64> {
    let active: Vec<usize> = (0..N_GLOBALS).filter(|&g| !FROZEN[g]).collect();
    let (n_free, clamped) = (6 * (n_controls - ties.len()), 6 * ties.len());
    let mut map = DMatrix::zeros(6 * n_controls + N_GLOBALS, n_free + active.len());
    for i in 0..n_free {
        map[(clamped + i, i)] = 1.0;
    }
    for (j, &g) in active.iter().enumerate() {
        map[(6 * n_controls + g, n_free + j)] = 1.0;
        for (i, row) in ties.as_flattened().iter().enumerate() {
            map[(i, n_free + j)] = row[g];
        }
    }
    map
}

#[test]
fn covariances_are_the_blocks_of_the_inverse_weighted_by_the_spline() -> Result<(), SolveError> {
    let (trajectory, spline) = finely_knotted();
    let equations = testing::equations(spline.n_controls());
    let ties = [1.0, 2.0, 3.0].map(response);
    let found = posterior(&equations, &ties, &spline)?.at_samples(&trajectory);
    let map = freedom(spline.n_controls(), &ties);
    let information = map.transpose() * dense(&equations) * &map;
    let inverse = information.cholesky().map(|c| c.inverse());
    let all = inverse
        .map(|inverse| &map * inverse * map.transpose())
        .unwrap();
    assert_eq!(found.len(), trajectory.len());
    for (n, covariance) in found.iter().enumerate() {
        let basis = spline.basis(trajectory.time(n));
        let mut weights = DMatrix::zeros(6, all.nrows());
        for (k, w) in basis.weights.iter().enumerate() {
            for i in 0..6 {
                weights[(i, 6 * (basis.first + k) + i)] = *w;
            }
        }
        let expected = &weights * &all * weights.transpose();
        assert!(
            (covariance - &expected).norm() < 1e-9 * expected.norm(),
            "sample {n}"
        );
    }
    Ok(())
}

#[test]
fn where_the_past_stays_the_correction_is_certain() -> Result<(), SolveError> {
    let (trajectory, spline) = finely_knotted();
    let equations = testing::equations(spline.n_controls());
    let found = posterior(&equations, &[UNMOVED; N_CLAMPED], &spline)?.at_samples(&trajectory);
    assert_eq!(found[0], Matrix6::zeros());
    assert!(found[30..].iter().all(|c| c.cholesky().is_some()));
    Ok(())
}

/// Rows of a chain with residuals of standard deviation one over the root of their weight.
fn with_residuals(n: usize, mut residual: impl FnMut() -> f64) -> NormalEquations {
    let mut equations = NormalEquations::new(n);
    let mut phase = 0.0;
    for k in 0..n - 1 {
        let mut group = RowGroup::new([k, k + 1]);
        for _ in 0..30 {
            phase += 0.7;
            let mut entry = |(i, v): (usize, &mut f64)| *v = (phase * (1.0 + i as f64)).sin();
            group
                .knots_mut()
                .iter_mut()
                .enumerate()
                .for_each(&mut entry);
            group
                .globals_mut()
                .iter_mut()
                .enumerate()
                .for_each(&mut entry);
            let weight = 2.0 + phase.cos();
            group.add(residual() / weight.sqrt(), weight);
        }
        group.flush(&mut equations);
    }
    equations
}

fn normal(random: &mut impl FnMut() -> f64) -> f64 {
    (0..12).map(|_| random()).sum::<f64>() - 6.0
}

/// Solutions for many draws of the residuals scatter as the covariance says.
#[test]
fn corrections_scatter_as_their_covariances_say() -> Result<(), SolveError> {
    const DRAWS: usize = 1500;
    let trajectory = Scene::still_for(0.3);
    let spline = CorrectionSpline::covering(trajectory.start(), trajectory.end(), 0.2);
    let ties = [1.0, 2.0, 3.0].map(response);
    let equations = with_residuals(spline.n_controls(), || 0.0);
    let expected = posterior(&equations, &ties, &spline)?.at_samples(&trajectory);
    let samples = [2, 50, 97];
    let mut scatter = [Matrix6::<f64>::zeros(); 3];
    let mut seed = 7_u64;
    let mut random = || {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    for _ in 0..DRAWS {
        let drawn = with_residuals(spline.n_controls(), || normal(&mut random));
        let mut step: Solution = posterior(&drawn, &ties, &spline)?.factorized.solve();
        step.complete(&ties);
        for (sum, n) in scatter.iter_mut().zip(samples) {
            let d = Vector6::from(spline.evaluate(&step.knots, trajectory.time(n)));
            *sum += d * d.transpose() / DRAWS as f64;
        }
    }
    for (found, n) in scatter.iter().zip(samples) {
        let root = expected[n].cholesky().unwrap().inverse();
        let whitened = (root * found).trace() / 6.0;
        // The mean of 6 · DRAWS squares of unit variance is known to √(2 / (6 · DRAWS)) = 1.5 %.
        assert!(
            (whitened - 1.0).abs() < 5.0 * (2.0 / (6.0 * DRAWS as f64)).sqrt(),
            "{whitened}"
        );
        for i in 0..6 {
            let ratio = found[(i, i)] / expected[n][(i, i)];
            assert!(
                (ratio - 1.0).abs() < 5.0 * (2.0 / DRAWS as f64).sqrt(),
                "{i}: {ratio}"
            );
        }
    }
    Ok(())
}
