// SPDX-License-Identifier: MIT OR Apache-2.0
//! The dense matrix of the normal equations, factorized where it stands.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::cholesky::llt::solve::solve_in_place;
use faer::{Mat, Par, Spec};

use super::error::SolveError;
use super::layout::Layout;
use super::normal_equations::NormalEquations;

/// The factor in the lower triangle; what is above the diagonal means nothing.
#[derive(Clone, Debug)]
pub(super) struct DenseLlt(Mat<f64>);

impl DenseLlt {
    pub(super) fn new(equations: &NormalEquations, layout: &Layout) -> Result<Self, SolveError> {
        let mut matrix = assemble(equations, layout);
        let scratch = cholesky_in_place_scratch::<f64>(layout.len(), Par::Seq, Spec::default());
        let factorized = cholesky_in_place(
            matrix.as_mut(),
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Spec::default(),
        );
        match factorized {
            Ok(_) => Ok(Self(matrix)),
            Err(_) => Err(layout.singular(equations)),
        }
    }

    pub(super) fn solve(&self, rhs: &Mat<f64>) -> Mat<f64> {
        let mut x = rhs.clone();
        // The solution needs no scratch.
        let stack = MemStack::new(&mut []);
        solve_in_place(self.0.as_ref(), x.as_mut(), Par::Seq, stack);
        x
    }
}

fn assemble(equations: &NormalEquations, layout: &Layout) -> Mat<f64> {
    let mut matrix = Mat::<f64>::zeros(layout.len(), layout.len());
    for ((row, column), block) in equations.blocks() {
        if let (Some(r), Some(c)) = (layout.knot(row), layout.knot(column)) {
            for (j, entries) in block.iter().enumerate() {
                matrix.col_as_slice_mut(c + j)[r..r + 6].copy_from_slice(entries);
            }
        }
    }
    let first = layout.n_knot_unknowns();
    for control in layout.n_clamped..layout.n_controls {
        let arrow = equations.arrow(control);
        let c = 6 * (control - layout.n_clamped);
        for (i, &g) in layout.active.iter().enumerate() {
            for (j, &entry) in arrow[g].iter().enumerate() {
                matrix[(first + i, c + j)] = entry;
            }
        }
    }
    for (j, &b) in layout.active.iter().enumerate() {
        let entries = &mut matrix.col_as_slice_mut(first + j)[first..];
        for (entry, &a) in entries.iter_mut().zip(&layout.active) {
            *entry = equations.corner()[(a, b)];
        }
    }
    matrix
}
