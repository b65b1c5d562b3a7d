// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rows that touch the same control points are summed in one small dense block.

use crate::{GlobalVector, N_GLOBALS, NormalEquations};

/// Rows are padded to a multiple of this.
const LANES: usize = 4;

/// `Σ w Jᵀ J` and `Σ w Jᵀ r` of rows that share their control points.
#[derive(Clone, Debug)]
pub struct RowGroup {
    controls: Vec<usize>,
    /// Row length: six per control point, the globals, padding.
    width: usize,
    /// Lower triangle, row by row; what stands above the diagonal is not used.
    information: Vec<f64>,
    gradient: Vec<f64>,
    row: Vec<f64>,
    cost: f64,
}

impl RowGroup {
    /// A group for the control points `controls`, which may repeat.
    pub fn new(controls: Vec<usize>) -> Self {
        let width = (6 * controls.len() + N_GLOBALS).next_multiple_of(LANES);
        Self {
            controls,
            width,
            information: vec![0.0; width * width],
            gradient: vec![0.0; width],
            row: vec![0.0; width],
            cost: 0.0,
        }
    }

    /// The row to be filled before [`RowGroup::add`]: six entries per control point.
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
        self.cost += w * r * r;
        let row = &self.row;
        for (a, &value) in row.iter().enumerate() {
            if value == 0.0 {
                continue;
            }
            let scaled = w * value;
            self.gradient[a] += scaled * r;
            let end = (a + 1).next_multiple_of(LANES);
            let start = a * self.width;
            let target = &mut self.information[start..start + end];
            for (t, v) in target
                .chunks_exact_mut(LANES)
                .zip(row[..end].chunks_exact(LANES))
            {
                for lane in 0..LANES {
                    t[lane] += scaled * v[lane];
                }
            }
        }
    }

    /// Adds the sums to the equations of the whole problem.
    pub fn flush(&self, equations: &mut NormalEquations) {
        equations.cost += self.cost;
        let first_global = 6 * self.controls.len();
        for (a, &row_control) in self.controls.iter().enumerate() {
            for (b, &column_control) in self.controls[..=a].iter().enumerate() {
                let block = |r: usize, c: usize| self.at(6 * a + r, 6 * b + c);
                equations.add_block(row_control, column_control, a == b, block);
            }
            let gradient = equations.knot_gradient_mut(row_control);
            for (g, v) in gradient.iter_mut().zip(&self.gradient[6 * a..]) {
                *g += v;
            }
            let arrow = equations.arrow_mut(row_control);
            for (g, column) in arrow.iter_mut().enumerate() {
                for (r, v) in column.iter_mut().enumerate() {
                    *v += self.at(first_global + g, 6 * a + r);
                }
            }
        }
        for r in 0..N_GLOBALS {
            equations.global_gradient[r] += self.gradient[first_global + r];
            for c in 0..=r {
                let v = self.at(first_global + r, first_global + c);
                equations.add_corner(r, c, v);
            }
        }
    }

    /// Entry of the symmetric sum.
    fn at(&self, r: usize, c: usize) -> f64 {
        let (r, c) = if r >= c { (r, c) } else { (c, r) };
        self.information[r * self.width + c]
    }
}
