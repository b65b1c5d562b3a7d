// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cholesky solution of the normal equations: dense for a window, sparse beyond.

use std::ops::Range;

use faer::Mat;
use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::Llt as SparseLlt;
use nalgebra::DMatrix;

use super::dense::DenseLlt;
use super::error::SolveError;
use super::layout::Layout;
use super::normal_equations::NormalEquations;
use super::quadratic::quadratic;
use super::response::{PoseResponse, UNMOVED, followed};
use super::sparse::Pattern;
use crate::globals::{GlobalMatrix, GlobalVector, N_GLOBALS};

/// Up to this number of unknowns the dense factorization of a window is at least about as fast, for
/// nearly all of its blocks are there (measured with `python -m benches kernels solve/window`).
const DENSE_LIMIT: usize = 1250;

/// Solution of the normal equations.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Corrections `[δr, δt]` of the control points.
    pub knots: Vec<[f64; 6]>,
    /// Corrections of the global states.
    pub globals: GlobalVector,
}

impl Solution {
    /// Sets the control points that follow the global states.
    pub fn complete(&mut self, ties: &[PoseResponse]) {
        for (knot, tie) in self.knots.iter_mut().zip(ties) {
            *knot = followed(tie, &self.globals);
        }
    }
}

/// What a system says of the global states when everything else is at its best.
#[derive(Clone, Debug)]
pub struct Marginals {
    /// Covariance of the global states; zero where frozen.
    pub covariance: GlobalMatrix,
    /// How the control points follow them.
    pub responses: Vec<PoseResponse>,
}

#[derive(Clone, Debug)]
enum Factor {
    Dense(DenseLlt),
    Sparse(SparseLlt<usize, f64>),
}

impl Factor {
    fn solve(&self, rhs: &Mat<f64>) -> Mat<f64> {
        match self {
            Self::Dense(llt) => llt.solve(rhs),
            Self::Sparse(llt) => llt.solve(rhs),
        }
    }
}

/// Solves normal equations; keeps the symbolic factorization while their structure is the same.
#[derive(Default)]
pub struct Solver {
    pattern: Option<Pattern>,
    /// Used instead of the measured limit by tests and benches.
    pub dense_limit: Option<usize>,
}

/// A factorized system.
#[derive(Clone, Debug)]
pub struct Factorized {
    factor: Factor,
    layout: Layout,
    gradient: Mat<f64>,
}

impl Solver {
    /// Factorizes `equations` without the first `n_clamped` control points, which are no
    /// unknowns, and without the frozen global states.
    ///
    /// # Errors
    /// When the equations are singular (with the name of the unknown) or not finite.
    pub fn factorize(
        &mut self,
        equations: &NormalEquations,
        n_clamped: usize,
        frozen: &[bool; N_GLOBALS],
    ) -> Result<Factorized, SolveError> {
        let layout = Layout::new(equations.n_controls(), n_clamped, frozen);
        let gradient = layout.gradient(equations);
        if !gradient.col(0).iter().all(|v| v.is_finite()) {
            return Err(SolveError::NotFinite);
        }
        let dense = layout.len() <= self.dense_limit.unwrap_or(DENSE_LIMIT);
        let factor = if dense {
            Factor::Dense(DenseLlt::new(equations, &layout)?)
        } else {
            Factor::Sparse(self.pattern(equations, &layout)?.factorize(equations)?)
        };
        Ok(Factorized {
            factor,
            layout,
            gradient,
        })
    }

    /// The pattern of `equations`, made anew if it is not that of the last ones.
    fn pattern(
        &mut self,
        equations: &NormalEquations,
        layout: &Layout,
    ) -> Result<&Pattern, SolveError> {
        let kept = self.pattern.take().filter(|p| p.fits(equations, layout));
        let pattern = kept.map_or_else(|| Pattern::new(equations, layout), Ok)?;
        Ok(self.pattern.insert(pattern))
    }
}

impl Factorized {
    /// The step `δ` that minimizes the linearized cost.
    pub fn solve(&self) -> Solution {
        let x = self.factor.solve(&self.gradient);
        let mut knots = vec![[0.0; 6]; self.layout.n_controls];
        for (k, knot) in knots.iter_mut().enumerate() {
            if let Some(first) = self.layout.knot(k) {
                for (i, v) in knot.iter_mut().enumerate() {
                    *v = -x[(first + i, 0)];
                }
            }
        }
        let mut globals = [0.0; N_GLOBALS];
        for (i, &g) in self.layout.active.iter().enumerate() {
            globals[g] = -x[(self.layout.n_knot_unknowns() + i, 0)];
        }
        Solution { knots, globals }
    }

    /// Joint covariance of the control points `controls`; `ties` are the responses of clamped ones.
    pub fn covariance(&self, controls: Range<usize>, ties: &[PoseResponse]) -> DMatrix<f64> {
        let (first, n) = (6 * controls.start, 6 * controls.len());
        let mut units = Mat::<f64>::zeros(6 * self.layout.n_controls + N_GLOBALS, n);
        for i in 0..n {
            units[(first + i, i)] = 1.0;
        }
        self.covariance_of(&units, ties)
    }

    /// Joint covariance of linear functions of the unknowns: each column of `rows` has six entries
    /// per control point, then those of the global states.
    pub fn covariance_of(&self, rows: &Mat<f64>, ties: &[PoseResponse]) -> DMatrix<f64> {
        let free = self.free(rows, ties);
        symmetric(&(free.transpose() * self.factor.solve(&free)))
    }

    /// The same where the errors of the rows do not have the variance that their weights state, but
    /// `factor` times that, and beyond it what `excess` has (Huber 1967: `H⁻¹ M H⁻¹` with the variance
    /// `M` of the gradient).
    pub fn sandwich_of(
        &self,
        rows: &Mat<f64>,
        factor: f64,
        excess: &NormalEquations,
    ) -> DMatrix<f64> {
        let free = self.free(rows, &[]);
        let u = self.factor.solve(&free);
        let stated = symmetric(&(free.transpose() * &u));
        stated * factor + quadratic(excess, &self.layout, &u)
    }

    /// Linear functions of the unknowns that are estimated.
    fn free(&self, rows: &Mat<f64>, ties: &[PoseResponse]) -> Mat<f64> {
        let n_knots = 6 * self.layout.n_controls;
        let mut free = Mat::<f64>::zeros(self.layout.len(), rows.ncols());
        for j in 0..rows.ncols() {
            let (knots, globals) = rows.col_as_slice(j).split_at(n_knots);
            let (of_knots, of_globals) = free
                .col_as_slice_mut(j)
                .split_at_mut(self.layout.n_knot_unknowns());
            of_knots.copy_from_slice(&knots[6 * self.layout.n_clamped..]);
            for (entry, &g) in of_globals.iter_mut().zip(&self.layout.active) {
                let tied = ties.as_flattened().iter().zip(knots);
                *entry = globals[g] + tied.map(|(tie, knot)| tie[g] * knot).sum::<f64>();
            }
        }
        free
    }

    /// What the system says of the global states, and how the control points go with them.
    ///
    /// `ties` are the responses of the clamped control points.
    pub fn marginals(&self, ties: &[PoseResponse]) -> Marginals {
        let (n, first) = (self.layout.len(), self.layout.n_knot_unknowns());
        let active = &self.layout.active;
        let mut units = Mat::<f64>::zeros(n, active.len());
        for i in 0..active.len() {
            units[(first + i, i)] = 1.0;
        }
        let inverse = self.factor.solve(&units);
        let mut covariance = GlobalMatrix::zeros();
        for (i, &a) in active.iter().enumerate() {
            for (j, &b) in active.iter().enumerate() {
                covariance[(a, b)] = 0.5 * (inverse[(first + i, j)] + inverse[(first + j, i)]);
            }
        }
        Marginals {
            responses: self.responses(&inverse, &covariance, ties),
            covariance,
        }
    }

    /// `Σ_cg Σ_gg⁻¹` of control points c and global states g.
    fn responses(
        &self,
        inverse: &Mat<f64>,
        covariance: &GlobalMatrix,
        ties: &[PoseResponse],
    ) -> Vec<PoseResponse> {
        let active = &self.layout.active;
        let mut responses = vec![UNMOVED; self.layout.n_controls];
        for (response, tie) in responses.iter_mut().zip(ties) {
            *response = *tie;
        }
        let n = active.len();
        let among = DMatrix::from_fn(n, n, |i, j| covariance[(active[i], active[j])]);
        // Positive definite as the system is; were it not, poses that stay are the safe answer.
        let Some(information) = among.cholesky().map(|c| c.inverse()) else {
            return responses;
        };
        for (k, response) in responses.iter_mut().enumerate() {
            let Some(first) = self.layout.knot(k) else {
                continue;
            };
            for (i, row) in response.iter_mut().enumerate() {
                for (j, &g) in active.iter().enumerate() {
                    row[g] = (0..n)
                        .map(|h| inverse[(first + i, h)] * information[(h, j)])
                        .sum();
                }
            }
        }
        responses
    }
}

fn symmetric(matrix: &Mat<f64>) -> DMatrix<f64> {
    let n = matrix.nrows();
    DMatrix::from_fn(n, n, |i, j| 0.5 * (matrix[(i, j)] + matrix[(j, i)]))
}

#[cfg(test)]
pub mod testing;
#[cfg(test)]
mod tests;
