// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rows that touch the same control points are summed in one small dense block.

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, MatRef, Par};

use crate::normal_equations::Block;
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
        equations.cost += group.column(residual)[residual];
        for (a, &row_control) in group.controls.iter().enumerate() {
            for (b, &column_control) in group.controls[..=a].iter().enumerate() {
                let block: Block = std::array::from_fn(|c| {
                    let column = group.column(6 * b + c);
                    std::array::from_fn(|r| column[6 * a + r])
                });
                equations.add_block(row_control, column_control, a == b, &block);
            }
            for r in 0..6 {
                let column = group.column(6 * a + r);
                equations.knot_gradient_mut(row_control)[r] += column[residual];
                let arrow = equations.arrow_mut(row_control);
                for (g, v) in column[first_global..residual].iter().enumerate() {
                    arrow[g][r] += v;
                }
            }
        }
        for c in 0..N_GLOBALS {
            let column = group.column(first_global + c);
            equations.global_gradient[c] += column[residual];
            for r in c..N_GLOBALS {
                equations.add_corner(r, c, column[first_global + r]);
            }
        }
    }

    /// A column of the sum, of which the entries on and below the diagonal are set.
    fn column(&self, c: usize) -> &[f64] {
        self.sum.col_as_slice(c)
    }
}
