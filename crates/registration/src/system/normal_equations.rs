// SPDX-License-Identifier: MIT OR Apache-2.0
//! The normal equations in blocks: 6×6 between control points, an arrow for the global states.

use rustc_hash::FxHashMap;

use crate::globals::{GlobalMatrix, GlobalVector, N_GLOBALS};

/// A 6×6 block, column by column.
pub type Block = [[f64; 6]; 6];

const EMPTY: Block = [[0.0; 6]; 6];

/// `AᵀWA` and `AᵀW r` (Kaul 2015, eq. 4). Blocks far off the diagonal appear wherever surfels of
/// different times match.
#[derive(Clone, Debug)]
pub struct NormalEquations {
    /// Blocks of the lower triangle, in the order in which they were first touched.
    blocks: Vec<Block>,
    /// Rows and columns of the blocks.
    keys: Vec<(usize, usize)>,
    /// Where the block of a row and column is.
    places: FxHashMap<(usize, usize), usize>,
    /// For each control point and global state the column of six.
    arrow: Vec<[[f64; 6]; N_GLOBALS]>,
    corner: GlobalMatrix,
    knot_gradient: Vec<[f64; 6]>,
    /// `AᵀW r` of the global states.
    pub(crate) global_gradient: GlobalVector,
    /// `Σ w r²`.
    pub(crate) cost: f64,
}

impl NormalEquations {
    /// Empty equations for `n_controls` control points; every diagonal block exists.
    pub fn new(n_controls: usize) -> Self {
        Self {
            blocks: vec![EMPTY; n_controls],
            keys: (0..n_controls).map(|k| (k, k)).collect(),
            places: (0..n_controls).map(|k| ((k, k), k)).collect(),
            arrow: vec![[[0.0; 6]; N_GLOBALS]; n_controls],
            corner: GlobalMatrix::zeros(),
            knot_gradient: vec![[0.0; 6]; n_controls],
            global_gradient: [0.0; N_GLOBALS],
            cost: 0.0,
        }
    }

    /// Number of control points.
    pub fn n_controls(&self) -> usize {
        self.knot_gradient.len()
    }

    /// Adds a 6×6 block between two control points. A block that is off the diagonal of its group
    /// (`!on_diagonal`) but joins a control point with itself stands for its transpose as well.
    /// Of blocks on the diagonal only the lower triangle counts.
    pub(crate) fn add_block(
        &mut self,
        row: usize,
        column: usize,
        on_diagonal: bool,
        block: &Block,
    ) {
        let target = self.block_mut(row.max(column), row.min(column));
        if row >= column {
            add_all(target, block);
        }
        if row < column || (row == column && !on_diagonal) {
            for c in 0..6 {
                for r in 0..6 {
                    target[c][r] += block[r][c];
                }
            }
        }
    }

    fn block_mut(&mut self, row: usize, column: usize) -> &mut Block {
        let place = *self.places.entry((row, column)).or_insert_with(|| {
            self.blocks.push(EMPTY);
            self.keys.push((row, column));
            self.keys.len() - 1
        });
        &mut self.blocks[place]
    }

    /// Rows and columns of the blocks of the lower triangle, with the blocks.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = ((usize, usize), &Block)> {
        self.keys.iter().copied().zip(&self.blocks)
    }

    /// As [`Self::blocks`], to change them.
    pub(crate) fn blocks_mut(&mut self) -> impl Iterator<Item = ((usize, usize), &mut Block)> {
        self.keys.iter().copied().zip(&mut self.blocks)
    }

    /// Diagonal of the block between a control point and itself, of which every one exists.
    pub(crate) fn diagonal(&self, control: usize) -> [f64; 6] {
        std::array::from_fn(|i| self.blocks[control][i][i])
    }

    /// Adds equations of the same unknowns.
    pub(crate) fn merge(&mut self, other: &Self) {
        for ((row, column), block) in other.blocks() {
            add_all(self.block_mut(row, column), block);
        }
        add_all(self.arrow.as_flattened_mut(), other.arrow.as_flattened());
        self.corner += other.corner;
        add_all(&mut self.knot_gradient, &other.knot_gradient);
        for (to, from) in self.global_gradient.iter_mut().zip(other.global_gradient) {
            *to += from;
        }
        self.cost += other.cost;
    }

    /// Takes a multiple of other equations of the same unknowns away; what is left has a matrix only.
    pub(crate) fn take_away(&mut self, factor: f64, other: &Self) {
        for ((row, column), block) in other.blocks() {
            let target = self.block_mut(row, column).as_flattened_mut();
            for (to, from) in target.iter_mut().zip(block.as_flattened()) {
                *to -= factor * from;
            }
        }
        let arrows = other.arrow.as_flattened().as_flattened();
        let targets = self.arrow.as_flattened_mut().as_flattened_mut();
        for (to, from) in targets.iter_mut().zip(arrows) {
            *to -= factor * from;
        }
        self.corner -= factor * other.corner;
    }

    pub(crate) fn arrow_mut(&mut self, control: usize) -> &mut [[f64; 6]; N_GLOBALS] {
        &mut self.arrow[control]
    }

    pub(crate) fn knot_gradient_mut(&mut self, control: usize) -> &mut [f64; 6] {
        &mut self.knot_gradient[control]
    }

    /// Adds `v` to the entries `(r, c)` and `(c, r)` of the global states.
    pub(crate) fn add_corner(&mut self, r: usize, c: usize, v: f64) {
        self.corner[(r, c)] += v;
        if r != c {
            self.corner[(c, r)] += v;
        }
    }

    /// Columns of six between the control point and each global state.
    pub(crate) fn arrow(&self, control: usize) -> &[[f64; 6]; N_GLOBALS] {
        &self.arrow[control]
    }

    /// The part of the global states.
    pub(crate) fn corner(&self) -> &GlobalMatrix {
        &self.corner
    }

    pub(crate) fn knot_gradient(&self, control: usize) -> &[f64; 6] {
        &self.knot_gradient[control]
    }
}

fn add_all(targets: &mut [[f64; 6]], terms: &[[f64; 6]]) {
    let targets = targets.as_flattened_mut().iter_mut();
    for (to, from) in targets.zip(terms.as_flattened()) {
        *to += from;
    }
}
