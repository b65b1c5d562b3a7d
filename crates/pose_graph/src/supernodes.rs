// SPDX-License-Identifier: MIT OR Apache-2.0
//! Forward substitution for right sides that are zero but for few rows: it touches only the columns on
//! the ways from these rows to the root of the elimination tree (Gilbert and Peierls 1988).

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use nalgebra::{SMatrix, SVector};

/// B right sides, in the order of elimination.
pub struct Reach<const B: usize> {
    /// Row by row; all zero between two calls.
    rows: Vec<SVector<f64, B>>,
    supernode_of: Vec<usize>,
    reached: Vec<bool>,
}

impl<const B: usize> Reach<B> {
    /// All zero.
    pub fn new(symbolic: &SymbolicSupernodalCholesky<usize>) -> Self {
        let (begins, ends) = (symbolic.supernode_begin(), symbolic.supernode_end());
        let mut supernode_of = vec![0; symbolic.nrows()];
        for (supernode, (&begin, &end)) in begins.iter().zip(ends).enumerate() {
            supernode_of[begin..end].fill(supernode);
        }
        Self {
            rows: vec![SVector::zeros(); symbolic.nrows()],
            supernode_of,
            reached: vec![false; symbolic.n_supernodes()],
        }
    }

    /// Adds a block of rows.
    pub fn add(&mut self, first: usize, block: &SMatrix<f64, B, B>) {
        for r in 0..B {
            self.rows[first + r] += block.row(r).transpose();
            self.reached[self.supernode_of[first + r]] = true;
        }
    }

    /// `YᵀY` for `L Y = X`, X being what was added; leaves zeros.
    pub fn squared(
        &mut self,
        symbolic: &SymbolicSupernodalCholesky<usize>,
        factor: &[f64],
    ) -> SMatrix<f64, B, B> {
        let mut squared = SMatrix::zeros();
        for index in 0..self.reached.len() {
            if std::mem::take(&mut self.reached[index]) {
                let below = symbolic.supernode(index).pattern();
                let begin = symbolic.supernode_begin()[index];
                let values = &factor[symbolic.col_ptr_for_val()[index]..];
                let height = symbolic.supernode_end()[index] - begin + below.len();
                squared += self.eliminate(begin, below, values, height);
            }
        }
        squared
    }

    /// Eliminates the rows of one supernode, whose columns of `values` have this height.
    fn eliminate(
        &mut self,
        begin: usize,
        below: &[usize],
        values: &[f64],
        height: usize,
    ) -> SMatrix<f64, B, B> {
        if let Some(&next) = below.first() {
            self.reached[self.supernode_of[next]] = true;
        }
        let n = height - below.len();
        let mut squared = SMatrix::zeros();
        let mut sums = vec![SVector::<f64, B>::zeros(); below.len()];
        for (c, column) in values.chunks_exact(height).take(n).enumerate() {
            let y = std::mem::replace(&mut self.rows[begin + c], SVector::zeros()) / column[c];
            let rest = self.rows[begin + c + 1..begin + n]
                .iter_mut()
                .chain(&mut sums);
            for (row, value) in rest.zip(&column[c + 1..]) {
                *row -= y * *value;
            }
            squared += y * y.transpose();
        }
        for (sum, &row) in sums.iter().zip(below) {
            self.rows[row] += sum;
        }
        squared
    }
}
