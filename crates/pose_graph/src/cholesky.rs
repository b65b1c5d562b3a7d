// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sparse Cholesky factorization of block matrices; all but the numbers is kept.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::perm::PermRef;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, Mat, MatMut, Par, Side};
use nalgebra::SMatrix;

use crate::GraphError;
use crate::blocks::{BlockMatrix, Structure};
use crate::supernodes::Reach;

/// A factorization of matrices of one structure.
pub struct Cholesky<const B: usize> {
    /// Block that is eliminated first, second, …
    order: Vec<usize>,
    pattern: SymbolicSparseColMat<usize>,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    scratch: MemBuffer,
}

impl<const B: usize> Cholesky<B> {
    /// Analyses a structure.
    ///
    /// The order of elimination is found for the blocks, of which there are B² times fewer than
    /// entries, and holds for their columns.
    ///
    /// # Errors
    /// When memory or the range of the indices is exceeded.
    pub fn new(structure: &Structure) -> Result<Self, GraphError> {
        let order = minimum_degree(structure)?;
        let expanded: Vec<usize> = order.iter().flat_map(|&b| B * b..B * (b + 1)).collect();
        let mut inverse = vec![0; expanded.len()];
        for (place, &unknown) in expanded.iter().enumerate() {
            inverse[unknown] = place;
        }
        let pattern = structure.entry_pattern::<B>();
        let permutation = PermRef::new_checked(&expanded, &inverse, expanded.len());
        let symbolic = factorize_symbolic_cholesky(
            pattern.as_ref(),
            Side::Lower,
            SymmetricOrdering::Custom(permutation),
            CholeskySymbolicParams::default(),
        )
        .map_err(|e| GraphError::Factorization(format!("{e:?}")))?;
        let scratch = StackReq::any_of(&[
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, faer::Spec::default()),
            symbolic.solve_in_place_scratch::<f64>(B, Par::Seq),
        ]);
        Ok(Self {
            order,
            factor: vec![0.0; symbolic.len_val()],
            scratch: allocated(scratch)?,
            pattern,
            symbolic,
        })
    }

    /// Factorizes a matrix of the structure.
    ///
    /// # Errors
    /// [`GraphError::Singular`] with the number of the block at which the matrix turns out not to be
    /// positive definite.
    pub fn factorize(&mut self, matrix: &BlockMatrix<B>) -> Result<(), GraphError> {
        let entries = SparseColMatRef::new(self.pattern.as_ref(), matrix.values());
        let result = self.symbolic.factorize_numeric_llt(
            &mut self.factor,
            entries,
            Side::Lower,
            faer::linalg::cholesky::llt::factor::LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut self.scratch),
            faer::Spec::default(),
        );
        match result {
            Ok(_) => Ok(()),
            Err(LltError::NonPositivePivot { index }) => {
                let node = self.order[index / B];
                Err(GraphError::Singular { node })
            }
        }
    }

    #[cfg(test)]
    pub fn is_supernodal(&self) -> bool {
        matches!(self.symbolic.raw(), SymbolicCholeskyRaw::Supernodal(_))
    }

    /// Solves for up to B right sides in place, with the last factorization.
    pub fn solve(&mut self, right: MatMut<f64>) {
        let scratch = MemStack::new(&mut self.scratch);
        let llt = LltRef::new(&self.symbolic, &self.factor);
        llt.solve_in_place_with_conj(Conj::No, right, Par::Seq, scratch);
    }
}

/// `Xᵀ A⁻¹ X` for ever other X that are zero but for few blocks, with one factorization of A.
pub struct Inverse<'a, const B: usize> {
    cholesky: &'a mut Cholesky<B>,
    /// Where the unknowns are among the eliminated.
    places: Vec<usize>,
    reach: Option<Reach<B>>,
}

impl<'a, const B: usize> Inverse<'a, B> {
    /// Of the matrix that was factorized last.
    pub fn new(cholesky: &'a mut Cholesky<B>) -> Self {
        let mut places = vec![0; cholesky.order.len()];
        for (place, &block) in cholesky.order.iter().enumerate() {
            places[block] = place;
        }
        let reach = match cholesky.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(symbolic) => Some(Reach::new(symbolic)),
            SymbolicCholeskyRaw::Simplicial(_) => None,
        };
        Self {
            cholesky,
            places,
            reach,
        }
    }

    /// The product; X has these blocks of rows.
    pub fn quadratic(&mut self, blocks: &[(usize, SMatrix<f64, B, B>)]) -> SMatrix<f64, B, B> {
        let (raw, factor) = (self.cholesky.symbolic.raw(), &self.cholesky.factor);
        if let (SymbolicCholeskyRaw::Supernodal(symbolic), Some(reach)) = (raw, &mut self.reach) {
            for (block, X) in blocks {
                reach.add(B * self.places[*block], X);
            }
            return reach.squared(symbolic, factor);
        }
        let mut columns = Mat::zeros(B * self.places.len(), B);
        for (block, X) in blocks {
            for (r, c) in entries::<B>() {
                columns[(B * block + r, c)] += X[(r, c)];
            }
        }
        self.cholesky.solve(columns.as_mut());
        let solved = |block: usize| SMatrix::from_fn(|r, c| columns[(B * block + r, c)]);
        blocks
            .iter()
            .map(|(block, X)| X.tr_mul(&solved(*block)))
            .sum()
    }
}

fn entries<const B: usize>() -> impl Iterator<Item = (usize, usize)> {
    (0..B).flat_map(|r| (0..B).map(move |c| (r, c)))
}

/// An order of elimination with little fill (Amestoy, Davis and Duff 1996).
fn minimum_degree(structure: &Structure) -> Result<Vec<usize>, GraphError> {
    let pattern = structure.block_pattern();
    let n = structure.len();
    let (mut order, mut inverse) = (vec![0; n], vec![0; n]);
    let request = amd::order_maybe_unsorted_scratch::<usize>(n, pattern.compute_nnz());
    let mut scratch = allocated(request)?;
    amd::order_maybe_unsorted(
        &mut order,
        &mut inverse,
        pattern.as_ref(),
        amd::Control::default(),
        MemStack::new(&mut scratch),
    )
    .map_err(|e| GraphError::Factorization(format!("{e:?}")))?;
    Ok(order)
}

fn allocated(request: StackReq) -> Result<MemBuffer, GraphError> {
    MemBuffer::try_new(request).map_err(|e| GraphError::Factorization(format!("{e:?}")))
}
