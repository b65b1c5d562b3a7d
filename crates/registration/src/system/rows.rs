// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rows that touch the same control points are summed in one small dense block.

#![allow(
    clippy::inline_always,
    reason = "only what is inlined into a dispatched function uses the machine's instructions"
)]

use std::ops::Range;

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, MatRef, Par};

use super::normal_equations::{Block, NormalEquations};
use crate::globals::{GlobalVector, N_GLOBALS};

/// Rows that are gathered before they are multiplied; with their block they fit a core's cache.
const GATHERED: usize = 96;

/// `Σ w Jᵀ J` and `Σ w Jᵀ r` of rows that share their control points.
///
/// A row is six entries per control point, the global states it concerns, and the residual.
#[derive(Clone, Debug)]
pub struct RowGroup {
    controls: Vec<usize>,
    globals: Range<usize>,
    width: usize,
    /// Rows times the roots of their weights, one after the other, and the row being filled.
    gathered: Vec<f64>,
    /// Where the row being filled begins.
    current: usize,
    /// Lower triangle of `Σ w [J r]ᵀ [J r]`, if anything was multiplied.
    sum: Mat<f64>,
    is_empty: bool,
}

impl RowGroup {
    /// A group for the control points `controls`, which may repeat, and all global states.
    pub fn new(controls: impl IntoIterator<Item = usize>) -> Self {
        Self::of(controls, 0..N_GLOBALS)
    }

    /// A group for the control points `controls`, which may repeat, and some of the global states.
    pub fn of(controls: impl IntoIterator<Item = usize>, globals: Range<usize>) -> Self {
        let mut group = Self {
            controls: Vec::new(),
            globals: 0..0,
            width: 0,
            gathered: Vec::new(),
            current: 0,
            sum: Mat::new(),
            is_empty: true,
        };
        group.reset(controls, globals);
        group
    }

    /// Forgets all rows, and takes other control points and global states; keeps its memory.
    pub fn reset(&mut self, controls: impl IntoIterator<Item = usize>, globals: Range<usize>) {
        self.controls.clear();
        self.controls.extend(controls);
        self.width = 6 * self.controls.len() + globals.len() + 1;
        self.globals = globals;
        self.gathered.resize(self.width, 0.0);
        self.current = 0;
        if self.sum.nrows() != self.width {
            self.sum = Mat::zeros(self.width, self.width);
        }
        self.is_empty = true;
    }

    /// Sets the row to zero; after [`Self::reset`] and [`Self::add`] it holds anything.
    pub fn clear_row(&mut self) {
        self.row_mut().fill(0.0);
    }

    /// Six entries of the row per control point.
    pub fn knots_mut(&mut self) -> &mut [f64] {
        let n = 6 * self.controls.len();
        &mut self.row_mut()[..n]
    }

    /// The first of its global states.
    pub fn first_global(&self) -> usize {
        self.globals.start
    }

    /// The entries of its global states in the row.
    pub fn globals_mut(&mut self) -> &mut [f64] {
        let (first, last) = (6 * self.controls.len(), self.width - 1);
        &mut self.row_mut()[first..last]
    }

    fn row_mut(&mut self) -> &mut [f64] {
        &mut self.gathered[self.current..self.current + self.width]
    }

    /// `J δ` of the current row.
    pub fn predict(&self, knots: &[[f64; 6]], globals: &GlobalVector) -> f64 {
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let row = &self.gathered[self.current..];
        let (row_knots, row_globals) = row.split_at(6 * self.controls.len());
        let entries = row_knots.chunks_exact(6).zip(&self.controls);
        let sum: f64 = entries.map(|(e, &k)| product(e, &knots[k])).sum();
        sum + product(row_globals, &globals[self.globals.clone()])
    }

    /// Adds the current row with residual `r` and weight `w`.
    #[inline(always)]
    pub fn add(&mut self, r: f64, w: f64) {
        let (root, residual) = (w.sqrt(), self.width - 1);
        let row = self.row_mut();
        row[residual] = r;
        for v in row {
            *v *= root;
        }
        self.current += self.width;
        if self.current == GATHERED * self.width {
            self.multiply();
        } else if self.current + self.width > self.gathered.len() {
            self.gathered.resize(self.current + self.width, 0.0);
        }
    }

    #[inline(never)]
    fn multiply(&mut self) {
        let gathered = &self.gathered[..self.current];
        let n = self.current / self.width;
        let columns = MatRef::from_column_major_slice(gathered, self.width, n);
        let accumulate = if self.is_empty {
            Accum::Replace
        } else {
            Accum::Add
        };
        matmul(
            self.sum.as_mut(),
            BlockStructure::TriangularLower,
            accumulate,
            columns,
            BlockStructure::Rectangular,
            columns.transpose(),
            BlockStructure::Rectangular,
            1.0,
            Par::Seq,
        );
        self.current = 0;
        self.is_empty = false;
    }

    /// Adds the sums to the equations of the whole problem.
    pub fn flush(&mut self, equations: &mut NormalEquations) {
        if self.current > 0 {
            self.multiply();
        }
        if self.is_empty {
            return;
        }
        let (first_global, residual) = (6 * self.controls.len(), self.width - 1);
        equations.cost += self.column(residual)[residual];
        for (a, &row_control) in self.controls.iter().enumerate() {
            for (b, &column_control) in self.controls[..=a].iter().enumerate() {
                let block: Block = std::array::from_fn(|c| {
                    let column = self.column(6 * b + c);
                    std::array::from_fn(|r| column[6 * a + r])
                });
                equations.add_block(row_control, column_control, a == b, &block);
            }
            for r in 0..6 {
                let column = self.column(6 * a + r);
                equations.knot_gradient_mut(row_control)[r] += column[residual];
                let arrow = equations.arrow_mut(row_control);
                let arrow = arrow[self.globals.clone()].iter_mut();
                for (to, v) in arrow.zip(&column[first_global..residual]) {
                    to[r] += v;
                }
            }
        }
        let first = self.globals.start;
        for c in 0..self.globals.len() {
            let column = self.column(first_global + c);
            equations.global_gradient[first + c] += column[residual];
            for r in c..self.globals.len() {
                equations.add_corner(first + r, first + c, column[first_global + r]);
            }
        }
    }

    /// A column of the sum, of which the entries on and below the diagonal are set.
    fn column(&self, c: usize) -> &[f64] {
        self.sum.col_as_slice(c)
    }
}
