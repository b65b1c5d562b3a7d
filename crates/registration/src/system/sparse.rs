// SPDX-License-Identifier: MIT OR Apache-2.0
//! The sparse matrix of the normal equations, of which all but the values is kept.

use std::ops::Range;

use faer::Side;
use faer::sparse::linalg::LltError;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};

use super::error::SolveError;
use super::layout::Layout;
use super::normal_equations::NormalEquations;

/// Where the entries of the lower triangle are, column by column, and how it is factorized.
pub(super) struct Pattern {
    /// Rows and columns of the blocks, in the order of the equations.
    keys: Vec<(usize, usize)>,
    layout: Layout,
    /// For each block how many of its column's blocks are above it; the diagonal one is the first.
    ranks: Vec<usize>,
    matrix: SymbolicSparseColMat<usize>,
    symbolic: SymbolicLlt<usize>,
}

impl Pattern {
    pub(super) fn new(equations: &NormalEquations, layout: &Layout) -> Result<Self, SolveError> {
        let keys: Vec<_> = equations.blocks().map(|(key, _)| key).collect();
        let (ranks, matrix) = structure(&keys, layout);
        let symbolic = SymbolicLlt::try_new(matrix.as_ref(), Side::Lower)
            .map_err(|e| SolveError::Factorization(format!("{e:?}")))?;
        Ok(Self {
            keys,
            layout: layout.clone(),
            ranks,
            matrix,
            symbolic,
        })
    }

    /// Whether it is that of `equations`.
    pub(super) fn fits(&self, equations: &NormalEquations, layout: &Layout) -> bool {
        let keys = equations.blocks().map(|(key, _)| key);
        self.layout == *layout && self.keys.iter().copied().eq(keys)
    }

    pub(super) fn factorize(
        &self,
        equations: &NormalEquations,
    ) -> Result<Llt<usize, f64>, SolveError> {
        let values = self.values(equations);
        let matrix = SparseColMatRef::new(self.matrix.as_ref(), &values);
        match Llt::try_new_with_symbolic(self.symbolic.clone(), matrix, Side::Lower) {
            Ok(llt) => Ok(llt),
            Err(LltError::Numeric(_)) => Err(self.layout.singular(equations)),
            Err(e) => Err(SolveError::Factorization(e.to_string())),
        }
    }

    /// Where the columns of the lower triangle begin, and the rows of its entries.
    pub(super) fn structure(&self) -> (&[usize], &[usize]) {
        (self.matrix.col_ptr(), self.matrix.row_idx())
    }

    /// The entries of the lower triangle, column by column.
    pub(super) fn values(&self, equations: &NormalEquations) -> Vec<f64> {
        let (layout, starts) = (&self.layout, self.matrix.col_ptr());
        let mut values = vec![0.0; self.matrix.row_idx().len()];
        for (((row, column), block), &rank) in equations.blocks().zip(&self.ranks) {
            let (Some(_), Some(first)) = (layout.knot(row), layout.knot(column)) else {
                continue;
            };
            for (c, entries) in block.iter().enumerate() {
                // Of the diagonal block only the lower triangle is there.
                let from = if row == column { c } else { 0 };
                let place = starts[first + c] + 6 * rank + from - c;
                values[place..][..6 - from].copy_from_slice(&entries[from..]);
            }
        }
        for control in layout.n_clamped..layout.n_controls {
            for (c, arrow) in self.arrow_places(control).into_iter().enumerate() {
                for (place, &g) in arrow.zip(&layout.active) {
                    values[place] = equations.arrow(control)[g][c];
                }
            }
        }
        for (j, &b) in layout.active.iter().enumerate() {
            let place = starts[layout.n_knot_unknowns() + j];
            for (value, &a) in values[place..].iter_mut().zip(&layout.active[j..]) {
                *value = equations.corner()[(a, b)];
            }
        }
        values
    }

    /// The global states are the last rows of the six columns of a control point.
    fn arrow_places(&self, control: usize) -> [Range<usize>; 6] {
        let (starts, n) = (self.matrix.col_ptr(), self.layout.active.len());
        let first = 6 * (control - self.layout.n_clamped);
        std::array::from_fn(|c| {
            let end = starts[first + c + 1];
            end - n..end
        })
    }
}

/// Ranks of the blocks in their columns, and the columns' rows.
fn structure(
    keys: &[(usize, usize)],
    layout: &Layout,
) -> (Vec<usize>, SymbolicSparseColMat<usize>) {
    let mut rows_of = vec![Vec::new(); layout.n_controls];
    for &(row, column) in keys {
        rows_of[column].push(row);
    }
    for rows in &mut rows_of {
        rows.sort_unstable();
    }
    let rank = |&(row, column): &(usize, usize)| rows_of[column].partition_point(|&r| r < row);
    let ranks = keys.iter().map(rank).collect();
    let (n, first_global) = (layout.len(), layout.n_knot_unknowns());
    let (mut starts, mut rows) = (vec![0], Vec::new());
    for unknown in 0..n {
        if unknown < first_global {
            let blocks = &rows_of[unknown / 6 + layout.n_clamped];
            let below = blocks.iter().filter_map(|&row| layout.knot(row));
            rows.extend(below.flat_map(|r| r..r + 6).filter(|&r| r >= unknown));
        }
        rows.extend(first_global.max(unknown)..n);
        starts.push(rows.len());
    }
    let matrix = SymbolicSparseColMat::new_checked(n, n, starts, None, rows);
    (ranks, matrix)
}
