// SPDX-License-Identifier: MIT OR Apache-2.0
//! The normal equations for other solvers, to compare them.

use super::error::SolveError;
use super::layout::Layout;
use super::normal_equations::NormalEquations;
use super::sparse::Pattern;
use crate::globals::N_GLOBALS;

/// A system `A x = b` as other solvers take it.
#[derive(Clone, Debug)]
pub struct System {
    /// Where the columns of the lower triangle of `A` begin and the last one ends.
    pub column_starts: Vec<usize>,
    /// Rows of its entries, column by column.
    pub rows: Vec<usize>,
    /// Its entries.
    pub values: Vec<f64>,
    /// `b`; the negative gradient.
    pub right: Vec<f64>,
}

impl System {
    /// The system that [`crate::Solver::factorize`] factorizes.
    ///
    /// # Errors
    /// When it has no symbolic factorization.
    pub fn new(
        equations: &NormalEquations,
        n_clamped: usize,
        frozen: &[bool; N_GLOBALS],
    ) -> Result<Self, SolveError> {
        let layout = Layout::new(equations.n_controls(), n_clamped, frozen);
        let pattern = Pattern::new(equations, &layout)?;
        let (starts, rows) = pattern.structure();
        let gradient = layout.gradient(equations);
        Ok(Self {
            column_starts: starts.to_vec(),
            rows: rows.to_vec(),
            values: pattern.values(equations),
            right: gradient.col_as_slice(0).iter().map(|g| -g).collect(),
        })
    }
}
