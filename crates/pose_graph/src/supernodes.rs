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

#[cfg(test)]
mod tests {
    use crate::GraphError;
    use crate::blocks::{BlockMatrix, Structure};
    use crate::cholesky::{Cholesky, Inverse};
    use faer::Mat;
    use nalgebra::SMatrix;

    /// A band so wide that supernodes pay, against whole solutions.
    #[test]
    fn products_with_the_inverse_are_those_of_whole_solutions() -> Result<(), GraphError> {
        let n = 90;
        let pairs: Vec<_> = (0..n)
            .flat_map(|a| (a + 1..n.min(a + 17)).map(move |b| (a, b)))
            .collect();
        let structure = Structure::new(n, pairs.iter().copied());
        let mut matrix = BlockMatrix::<6>::new(&structure);
        let entry = |r: usize, c: usize, k: usize| ((7 * r + 3 * c + k) as f64).sin();
        for k in 0..n {
            matrix.add(k, k, &(SMatrix::identity() * 300.0));
        }
        for (k, &(a, b)) in pairs.iter().enumerate() {
            matrix.add(a, b, &SMatrix::from_fn(|r, c| entry(r, c, k)));
        }
        let mut cholesky = Cholesky::<6>::new(&structure)?;
        cholesky.factorize(&matrix)?;
        assert!(cholesky.is_supernodal());
        let X = SMatrix::<f64, 6, 6>::from_fn(|r, c| entry(r, c, 1));
        let Y = SMatrix::<f64, 6, 6>::from_fn(|r, c| entry(c, r, 5));
        for (a, b) in [(0, 89), (5, 77), (77, 5), (89, 88)] {
            let found = Inverse::new(&mut cholesky).quadratic(&[(a, X), (b, Y)]);
            let mut columns = Mat::zeros(6 * n, 6);
            for (r, c) in (0..6).flat_map(|r| (0..6).map(move |c| (r, c))) {
                columns[(6 * a + r, c)] = X[(r, c)];
                columns[(6 * b + r, c)] = Y[(r, c)];
            }
            cholesky.solve(columns.as_mut());
            let block = |k: usize| SMatrix::<f64, 6, 6>::from_fn(|r, c| columns[(6 * k + r, c)]);
            let expected = X.tr_mul(&block(a)) + Y.tr_mul(&block(b));
            assert!((found - expected).amax() < 1e-13);
        }
        Ok(())
    }
}
