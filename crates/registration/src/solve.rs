// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cholesky solution of the normal equations: dense for a window, sparse beyond.

use std::collections::BTreeMap;

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::LltError as SparseError;
use faer::sparse::linalg::solvers::{Llt as SparseLlt, SymbolicLlt};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side};
use thiserror::Error;

use crate::{GlobalMatrix, GlobalVector, N_GLOBALS, NormalEquations, index};

/// Above this number of unknowns the sparse factorization is faster (measured in
/// `benches/registration.rs`).
const DENSE_LIMIT: usize = 700;

/// Why the normal equations have no solution.
#[derive(Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SolveError {
    /// An unknown that nothing constrains.
    #[error("the normal equations are singular at {unknown}")]
    Singular {
        /// Name of the first unknown without information.
        unknown: String,
    },
    /// The equations hold NaN or infinity.
    #[error("the normal equations hold a value that is not finite")]
    NotFinite,
    /// The factorization gave up for a reason of its own (memory, index range).
    #[error("the sparse factorization failed: {0}")]
    Factorization(String),
}

/// Solution of the normal equations.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Corrections `[δr, δt]` of the control points.
    pub knots: Vec<[f64; 6]>,
    /// Corrections of the global states.
    pub globals: GlobalVector,
}

/// Numbers the unknowns that are estimated: free control points first, then active globals.
#[derive(Clone, Debug, PartialEq)]
struct Layout {
    n_clamped: usize,
    n_controls: usize,
    active: Vec<usize>,
}

impl Layout {
    fn n_knot_unknowns(&self) -> usize {
        6 * (self.n_controls - self.n_clamped)
    }

    fn len(&self) -> usize {
        self.n_knot_unknowns() + self.active.len()
    }

    fn knot(&self, control: usize) -> Option<usize> {
        control.checked_sub(self.n_clamped).map(|k| 6 * k)
    }

    fn name(&self, unknown: usize) -> String {
        let Some(global) = unknown.checked_sub(self.n_knot_unknowns()) else {
            let (k, part) = (unknown / 6 + self.n_clamped, unknown % 6);
            let kind = if part < 3 { "rotation" } else { "translation" };
            return format!("the {kind} of control point {k}");
        };
        let name = match self.active[global] {
            index::LATENCY => "latency",
            i if index::EXTRINSIC_ROTATION.contains(&i) => "extrinsic rotation",
            i if index::EXTRINSIC_TRANSLATION.contains(&i) => "extrinsic translation",
            i if index::GYRO_BIAS.contains(&i) => "gyro bias",
            i if index::ACCEL_BIAS.contains(&i) => "accelerometer bias",
            i if index::GRAVITY.contains(&i) => "gravity direction",
            index::ENCODER_ZERO => "encoder zero",
            i if index::MOTOR_TILT.contains(&i) => "motor tilt",
            _ => "motor offset",
        };
        format!("the {name}")
    }
}

enum Factor {
    Dense(faer::linalg::solvers::Llt<f64>),
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

/// Which blocks of the normal equations there are.
type Structure = Vec<(usize, usize)>;

/// Solves normal equations; keeps the symbolic factorization while their structure is the same.
#[derive(Default)]
pub struct Solver {
    symbolic: Option<(Structure, Layout, SymbolicLlt<usize>)>,
    /// Used instead of the measured limit by tests and benches.
    pub dense_limit: Option<usize>,
}

/// A factorized system.
pub struct Factorized {
    factor: Factor,
    layout: Layout,
    gradient: Mat<f64>,
}

impl Solver {
    /// Factorizes `equations` without the first `n_clamped` control points, which stay zero, and
    /// without the frozen global states.
    ///
    /// # Errors
    /// When the equations are singular (with the name of the unknown) or not finite.
    pub fn factorize(
        &mut self,
        equations: &NormalEquations,
        n_clamped: usize,
        frozen: &[bool; N_GLOBALS],
    ) -> Result<Factorized, SolveError> {
        let active = (0..N_GLOBALS).filter(|&g| !frozen[g]).collect();
        let layout = Layout {
            n_clamped,
            n_controls: equations.n_controls(),
            active,
        };
        let gradient = gradient(equations, &layout);
        if !gradient.col(0).iter().all(|v| v.is_finite()) {
            return Err(SolveError::NotFinite);
        }
        let dense = layout.len() <= self.dense_limit.unwrap_or(DENSE_LIMIT);
        let factor = if dense {
            dense_factor(equations, &layout)?
        } else {
            self.sparse_factor(equations, &layout)?
        };
        Ok(Factorized {
            factor,
            layout,
            gradient,
        })
    }

    fn sparse_factor(
        &mut self,
        equations: &NormalEquations,
        layout: &Layout,
    ) -> Result<Factor, SolveError> {
        let failed = |e: &dyn std::fmt::Display| SolveError::Factorization(e.to_string());
        let n = layout.len();
        let mut triplets = Vec::new();
        for_each_entry(equations, layout, |row, col, val| {
            triplets.push(Triplet { row, col, val });
        });
        let matrix = SparseColMat::try_new_from_triplets(n, n, &triplets)
            .map_err(|e| failed(&format!("{e:?}")))?;
        let mut keys: Structure = equations.blocks().map(|(key, _)| key).collect();
        keys.sort_unstable();
        let reusable = self
            .symbolic
            .take()
            .filter(|(k, l, _)| *k == keys && l == layout);
        let symbolic = match reusable {
            Some((_, _, symbolic)) => symbolic,
            None => SymbolicLlt::try_new(matrix.symbolic(), Side::Lower)
                .map_err(|e| failed(&format!("{e:?}")))?,
        };
        self.symbolic = Some((keys, layout.clone(), symbolic.clone()));
        match SparseLlt::try_new_with_symbolic(symbolic, matrix.as_ref(), Side::Lower) {
            Ok(llt) => Ok(Factor::Sparse(llt)),
            Err(SparseError::Numeric(_)) => Err(singular(equations, layout)),
            Err(e) => Err(failed(&e)),
        }
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

    /// Covariance of the global states; zero where frozen.
    pub fn global_covariance(&self) -> GlobalMatrix {
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
        covariance
    }
}

fn gradient(equations: &NormalEquations, layout: &Layout) -> Mat<f64> {
    let mut gradient = Mat::zeros(layout.len(), 1);
    for control in layout.n_clamped..layout.n_controls {
        let first = 6 * (control - layout.n_clamped);
        for (i, v) in equations.knot_gradient(control).iter().enumerate() {
            gradient[(first + i, 0)] = *v;
        }
    }
    for (i, &g) in layout.active.iter().enumerate() {
        gradient[(layout.n_knot_unknowns() + i, 0)] = equations.global_gradient[g];
    }
    gradient
}

/// Calls `visit(row, column, value)` for the lower triangle of the matrix.
fn for_each_entry(
    equations: &NormalEquations,
    layout: &Layout,
    mut visit: impl FnMut(usize, usize, f64),
) {
    for ((row, column), block) in equations.blocks() {
        let (Some(r0), Some(c0)) = (layout.knot(row), layout.knot(column)) else {
            continue;
        };
        for (i, &v) in block.as_flattened().iter().enumerate() {
            let (r, c) = (r0 + i % 6, c0 + i / 6);
            if r >= c {
                visit(r, c, v);
            }
        }
    }
    let first = layout.n_knot_unknowns();
    for control in layout.n_clamped..layout.n_controls {
        let c0 = 6 * (control - layout.n_clamped);
        for (i, &g) in layout.active.iter().enumerate() {
            for (c, &v) in equations.arrow(control)[g].iter().enumerate() {
                visit(first + i, c0 + c, v);
            }
        }
    }
    for (i, &a) in layout.active.iter().enumerate() {
        for (j, &b) in layout.active[..=i].iter().enumerate() {
            visit(first + i, first + j, equations.corner()[(a, b)]);
        }
    }
}

fn dense_factor(equations: &NormalEquations, layout: &Layout) -> Result<Factor, SolveError> {
    let mut matrix = Mat::<f64>::zeros(layout.len(), layout.len());
    for_each_entry(equations, layout, |r, c, v| matrix[(r, c)] = v);
    match matrix.llt(Side::Lower) {
        Ok(llt) => Ok(Factor::Dense(llt)),
        Err(_) => Err(singular(equations, layout)),
    }
}

/// Names the unknown at which a plain factorization meets a pivot that is not positive.
fn singular(equations: &NormalEquations, layout: &Layout) -> SolveError {
    let mut diagonal = BTreeMap::new();
    for_each_entry(equations, layout, |r, c, v| {
        if r == c {
            diagonal.insert(r, v);
        }
    });
    if diagonal.values().any(|v| !v.is_finite()) {
        return SolveError::NotFinite;
    }
    let weakest = diagonal
        .iter()
        .min_by(|a, b| a.1.total_cmp(b.1))
        .map_or(0, |(&i, _)| i);
    SolveError::Singular {
        unknown: layout.name(weakest),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::RowGroup;

    /// Equations of a chain of control points with loops, from pseudo-random rows.
    fn equations(n: usize) -> NormalEquations {
        let mut equations = NormalEquations::new(n);
        let mut x = 0.3_f64;
        let mut next = || {
            x = (x * 3.9).mul_add(1.0 - x, 0.0);
            x - 0.5
        };
        for k in 0..n - 1 {
            let mut group = RowGroup::new([k, k + 1, (7 * k) % n]);
            for _ in 0..40 {
                group.knots_mut().iter_mut().for_each(|v| *v = next());
                group.globals_mut().iter_mut().for_each(|v| *v = next());
                group.add(next(), 1.0);
            }
            group.flush(&mut equations);
        }
        equations
    }

    #[test]
    fn dense_and_sparse_solutions_agree() {
        let equations = equations(40);
        let mut frozen = [false; N_GLOBALS];
        frozen[5] = true;
        let mut sparse = Solver {
            dense_limit: Some(0),
            ..Solver::default()
        };
        let mut dense = Solver {
            dense_limit: Some(usize::MAX),
            ..Solver::default()
        };
        for _ in 0..2 {
            let a = sparse.factorize(&equations, 3, &frozen).unwrap();
            let b = dense.factorize(&equations, 3, &frozen).unwrap();
            let difference = a.global_covariance() - b.global_covariance();
            assert!(difference.norm() < 1e-9 * b.global_covariance().norm());
            for (p, q) in a.solve().knots.iter().zip(&b.solve().knots) {
                assert!(p.iter().zip(q).all(|(p, q)| (p - q).abs() < 1e-9));
            }
            assert_eq!(a.solve().globals[5], 0.0);
            assert_eq!(b.solve().knots[2], [0.0; 6]);
        }
    }

    #[test]
    fn an_unknown_without_information_is_named() {
        let mut equations = NormalEquations::new(1);
        let mut group = RowGroup::new([0]);
        for i in 0..6 {
            group.knots_mut().fill(0.0);
            group.knots_mut()[i] = 1.0;
            group.add(0.0, 1.0);
        }
        group.flush(&mut equations);
        let error = Solver::default().factorize(&equations, 0, &[false; N_GLOBALS]);
        let Err(SolveError::Singular { unknown }) = error else {
            panic!("expected an error")
        };
        assert_eq!(unknown, "the latency");
    }
}
