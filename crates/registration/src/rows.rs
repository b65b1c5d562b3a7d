// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rows that touch the same control points are summed in one small dense block.

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, MatRef, Par};

use crate::{GlobalVector, N_GLOBALS, NormalEquations};

/// Rows that are gathered before they are multiplied; with their block they fit a core's cache.
const GATHERED: usize = 96;

/// `Σ w Jᵀ J` and `Σ w Jᵀ r` of rows that share their control points.
///
/// A row is six entries per control point, the global states, and the residual.
#[derive(Clone, Debug)]
pub struct RowGroup {
    controls: Vec<usize>,
    width: usize,
    /// The row being filled.
    row: Vec<f64>,
    /// Rows times the roots of their weights, one after the other.
    gathered: Vec<f64>,
    /// Lower triangle of `Σ w [J r]ᵀ [J r]`.
    sum: Mat<f64>,
}

impl RowGroup {
    /// A group for the control points `controls`, which may repeat.
    pub fn new(controls: Vec<usize>) -> Self {
        let width = 6 * controls.len() + N_GLOBALS + 1;
        Self {
            controls,
            width,
            row: vec![0.0; width],
            gathered: Vec::new(),
            sum: Mat::zeros(width, width),
        }
    }

    /// Sets the row to zero.
    pub fn clear_row(&mut self) {
        self.row.fill(0.0);
    }

    /// Six entries of the row per control point.
    pub fn knots_mut(&mut self) -> &mut [f64] {
        &mut self.row[..6 * self.controls.len()]
    }

    /// The entries of the global states in the row.
    pub fn globals_mut(&mut self) -> &mut [f64] {
        let first = 6 * self.controls.len();
        &mut self.row[first..first + N_GLOBALS]
    }

    /// `J δ` of the current row.
    pub fn predict(&self, knots: &[[f64; 6]], globals: &GlobalVector) -> f64 {
        let mut sum = 0.0;
        for (entries, &k) in self.row.chunks_exact(6).zip(&self.controls) {
            sum += entries
                .iter()
                .zip(&knots[k])
                .map(|(a, b)| a * b)
                .sum::<f64>();
        }
        let first = 6 * self.controls.len();
        sum + self.row[first..]
            .iter()
            .zip(globals)
            .map(|(a, b)| a * b)
            .sum::<f64>()
    }

    /// Adds the current row with residual `r` and weight `w`.
    pub fn add(&mut self, r: f64, w: f64) {
        let root = w.sqrt();
        self.row[self.width - 1] = r;
        self.gathered.extend(self.row.iter().map(|v| v * root));
        if self.gathered.len() >= GATHERED * self.width {
            self.multiply();
        }
    }

    fn multiply(&mut self) {
        let n = self.gathered.len() / self.width;
        let columns = MatRef::from_column_major_slice(&self.gathered, self.width, n);
        matmul(
            self.sum.as_mut(),
            BlockStructure::TriangularLower,
            Accum::Add,
            columns,
            BlockStructure::Rectangular,
            columns.transpose(),
            BlockStructure::Rectangular,
            1.0,
            Par::Seq,
        );
        self.gathered.clear();
    }

    /// Sums what was added.
    pub fn summed(mut self) -> Self {
        self.multiply();
        self
    }

    /// Adds the sums to the equations of the whole problem.
    pub fn flush(self, equations: &mut NormalEquations) {
        let group = self.summed();
        let (first_global, residual) = (6 * group.controls.len(), group.width - 1);
        equations.cost += group.at(residual, residual);
        for (a, &row_control) in group.controls.iter().enumerate() {
            for (b, &column_control) in group.controls[..=a].iter().enumerate() {
                let block = |r: usize, c: usize| group.at(6 * a + r, 6 * b + c);
                equations.add_block(row_control, column_control, a == b, block);
            }
            let gradient = equations.knot_gradient_mut(row_control);
            for (r, g) in gradient.iter_mut().enumerate() {
                *g += group.at(residual, 6 * a + r);
            }
            let arrow = equations.arrow_mut(row_control);
            for (g, column) in arrow.iter_mut().enumerate() {
                for (r, v) in column.iter_mut().enumerate() {
                    *v += group.at(first_global + g, 6 * a + r);
                }
            }
        }
        for r in 0..N_GLOBALS {
            equations.global_gradient[r] += group.at(residual, first_global + r);
            for c in 0..=r {
                equations.add_corner(r, c, group.at(first_global + r, first_global + c));
            }
        }
    }

    /// Entry of the symmetric sum.
    fn at(&self, r: usize, c: usize) -> f64 {
        if r >= c {
            self.sum[(r, c)]
        } else {
            self.sum[(c, r)]
        }
    }
}
