// SPDX-License-Identifier: MIT OR Apache-2.0
//! Symmetric matrices of B×B blocks: which blocks there are, and their entries.

use faer::sparse::SymbolicSparseColMat;
use nalgebra::SMatrix;

/// Which blocks of the lower triangle are there, block column by block column; the diagonal ones
/// always are.
#[derive(Clone, Debug)]
pub struct Structure {
    starts: Vec<usize>,
    rows: Vec<usize>,
}

impl Structure {
    /// `n` block columns with a block for each of `pairs`, in any order and repeated at will.
    pub fn new(n: usize, pairs: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut columns: Vec<Vec<usize>> = (0..n).map(|c| vec![c]).collect();
        for (a, b) in pairs {
            columns[a.min(b)].push(a.max(b));
        }
        let (mut starts, mut rows) = (vec![0], Vec::new());
        for column in &mut columns {
            column.sort_unstable();
            column.dedup();
            rows.extend_from_slice(column);
            starts.push(rows.len());
        }
        Self { starts, rows }
    }

    /// Number of block columns.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// The pattern of blocks as faer takes it.
    pub fn block_pattern(&self) -> SymbolicSparseColMat<usize> {
        let (starts, rows) = (self.starts.clone(), self.rows.clone());
        SymbolicSparseColMat::new_checked(self.len(), self.len(), starts, None, rows)
    }

    /// The pattern of the entries of the lower triangle where a block is B×B.
    pub fn entry_pattern<const B: usize>(&self) -> SymbolicSparseColMat<usize> {
        let n = B * self.len();
        let (mut starts, mut rows) = (vec![0], Vec::new());
        for unknown in 0..n {
            let below = self.column(unknown / B).iter();
            rows.extend(
                below
                    .flat_map(|&b| B * b..B * (b + 1))
                    .filter(|&r| r >= unknown),
            );
            starts.push(rows.len());
        }
        SymbolicSparseColMat::new_checked(n, n, starts, None, rows)
    }

    fn column(&self, column: usize) -> &[usize] {
        &self.rows[self.starts[column]..self.starts[column + 1]]
    }
}

/// The entries of the lower triangle, column by column.
#[derive(Clone, Debug)]
pub struct BlockMatrix<'a, const B: usize> {
    structure: &'a Structure,
    /// Where the entries of each block column begin.
    starts: Vec<usize>,
    values: Vec<f64>,
}

impl<'a, const B: usize> BlockMatrix<'a, B> {
    /// All zero.
    pub fn new(structure: &'a Structure) -> Self {
        let mut starts = vec![0];
        for column in 0..structure.len() {
            // The upper triangle of the diagonal block is left out.
            let n_entries = B * B * structure.column(column).len() - B * (B - 1) / 2;
            starts.push(starts[column] + n_entries);
        }
        let values = vec![0.0; starts[structure.len()]];
        Self {
            structure,
            starts,
            values,
        }
    }

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// The entries.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Adds a block, on either side of the diagonal; only blocks of the structure are there.
    pub fn add(&mut self, row: usize, column: usize, block: &SMatrix<f64, B, B>) {
        if row < column {
            return self.add(column, row, &block.transpose());
        }
        let rows = self.structure.column(column);
        let rank = rows.partition_point(|&r| r < row);
        for c in 0..B {
            // Of the diagonal block only the lower triangle is there.
            let first = if row == column { c } else { 0 };
            let place = self.place(column, c) + B * rank + first - c;
            let entries = &mut self.values[place..][..B - first];
            for (value, added) in entries.iter_mut().zip(&block.as_slice()[B * c + first..]) {
                *value += added;
            }
        }
    }

    /// The diagonal.
    pub fn diagonal(&self) -> Vec<f64> {
        let columns = (0..self.structure.len()).flat_map(|b| (0..B).map(move |c| (b, c)));
        columns
            .map(|(b, c)| self.values[self.place(b, c)])
            .collect()
    }

    /// `xᵀ A x`.
    pub fn quadratic(&self, x: &[f64]) -> f64 {
        let mut sum = 0.0;
        for column in 0..self.structure.len() {
            let rows = self.structure.column(column);
            for c in 0..B {
                let values = &self.values[self.place(column, c)..];
                let below = rows.iter().flat_map(|&b| &x[B * b..B * (b + 1)]).skip(c);
                let product: f64 = below.zip(values).map(|(x, v)| x * v).sum();
                let own = x[B * column + c];
                sum += own * (2.0 * product - values[0] * own);
            }
        }
        sum
    }

    /// Where the entries of a column of a block column begin, the one on the diagonal first.
    fn place(&self, column: usize, c: usize) -> usize {
        let height = B * self.structure.column(column).len();
        self.starts[column] + c * height - (c * c - c) / 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cholesky::{Cholesky, Inverse};
    use faer::Mat;
    use proptest::prelude::*;
    use proptest::test_runner::TestCaseError;

    proptest! {
        /// Random blocks on a random pattern, against the same matrix held dense.
        #[test]
        fn products_and_solutions_are_those_of_the_dense_matrix(
            pairs in prop::collection::vec((0..7_usize, 0..7_usize), 0..12),
            entries in prop::collection::vec(-1.0..1.0_f64, 21),
        ) {
            let structure = Structure::new(7, pairs.iter().copied());
            let mut matrix = BlockMatrix::<3>::new(&structure);
            let mut dense = nalgebra::DMatrix::<f64>::identity(21, 21) * 40.0;
            for block in 0..7 {
                matrix.add(block, block, &(SMatrix::identity() * 40.0));
            }
            for (k, &(a, b)) in pairs.iter().enumerate().filter(|(_, (a, b))| a != b) {
                let block = SMatrix::<f64, 3, 3>::from_fn(|r, c| entries[(r + 3 * c + k) % 21]);
                matrix.add(a, b, &block);
                for (r, c) in (0..3).flat_map(|r| (0..3).map(move |c| (r, c))) {
                    dense[(3 * a + r, 3 * b + c)] += block[(r, c)];
                    dense[(3 * b + c, 3 * a + r)] += block[(r, c)];
                }
            }
            let x = nalgebra::DVector::from_fn(21, |i, _| entries[i]);
            prop_assert!((matrix.quadratic(&entries) - x.dot(&(&dense * &x))).abs() < 1e-9);
            let diagonal = dense.diagonal();
            prop_assert_eq!(matrix.diagonal(), diagonal.as_slice());
            let mut cholesky = Cholesky::<3>::new(&structure)?;
            cholesky.factorize(&matrix)?;
            let mut solution = Mat::from_fn(21, 1, |i, _| entries[i]);
            cholesky.solve(solution.as_mut());
            let found = nalgebra::DVector::from_fn(21, |i, _| solution[(i, 0)]);
            prop_assert!((&dense * found - x).amax() < 1e-12);
            let (X, Y) = (SMatrix::from_fn(|r, c| entries[4 * r + c]), SMatrix::from_fn(|r, c| entries[r + 5 * c]));
            let mut columns = nalgebra::DMatrix::zeros(21, 3);
            columns.view_mut((6, 0), (3, 3)).copy_from(&X);
            columns.view_mut((15, 0), (3, 3)).copy_from(&Y);
            let Some(inverse) = dense.try_inverse() else {
                return Err(TestCaseError::fail("singular"));
            };
            let expected = columns.tr_mul(&(inverse * &columns));
            let mut found = Inverse::new(&mut cholesky);
            // A second time, because a first one must leave nothing behind.
            for _ in 0..2 {
                let product = found.quadratic(&[(2, X), (5, Y)]);
                let difference = SMatrix::<f64, 3, 3>::from_fn(|r, c| product[(r, c)] - expected[(r, c)]);
                prop_assert!(difference.amax() < 1e-12);
            }
        }
    }
}
