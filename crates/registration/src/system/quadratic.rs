// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the rows of some of the normal equations make of steps of the unknowns.

use faer::Mat;
use nalgebra::DMatrix;

use super::layout::Layout;
use super::normal_equations::{Block, NormalEquations};

/// `Uᵀ A U` of the equations' matrix A and columns U over the unknowns of `layout`.
pub(super) fn quadratic(
    equations: &NormalEquations,
    layout: &Layout,
    u: &Mat<f64>,
) -> DMatrix<f64> {
    let n = u.ncols();
    let mut product = DMatrix::zeros(n, n);
    let product_of = |i: usize| times(equations, layout, u.col_as_slice(i));
    for i in 0..n {
        let v = product_of(i);
        for j in 0..=i {
            let sum: f64 = v.iter().zip(u.col_as_slice(j)).map(|(a, b)| a * b).sum();
            product[(i, j)] = sum;
            product[(j, i)] = sum;
        }
    }
    product
}

/// `A u`.
fn times(equations: &NormalEquations, layout: &Layout, u: &[f64]) -> Vec<f64> {
    let mut v = vec![0.0; layout.len()];
    for ((row, column), block) in equations.blocks() {
        let (Some(r), Some(c)) = (layout.knot(row), layout.knot(column)) else {
            continue;
        };
        add_block(&mut v, u, (r, c), block);
    }
    let globals = layout.n_knot_unknowns();
    for control in layout.n_clamped..layout.n_controls {
        let first = 6 * (control - layout.n_clamped);
        let arrow = equations.arrow(control);
        for (i, &g) in layout.active.iter().enumerate() {
            for (k, entry) in arrow[g].iter().enumerate() {
                v[first + k] += entry * u[globals + i];
                v[globals + i] += entry * u[first + k];
            }
        }
    }
    for (i, &a) in layout.active.iter().enumerate() {
        for (j, &b) in layout.active.iter().enumerate() {
            v[globals + i] += equations.corner()[(a, b)] * u[globals + j];
        }
    }
    v
}

/// Adds what a block of the lower triangle, and its transpose, make of `u`.
fn add_block(v: &mut [f64], u: &[f64], (r, c): (usize, usize), block: &Block) {
    for (j, column) in block.iter().enumerate() {
        for (i, &entry) in column.iter().enumerate() {
            if r != c {
                v[r + i] += entry * u[c + j];
                v[c + j] += entry * u[r + i];
            } else if i >= j {
                // Of blocks on the diagonal the lower triangle counts.
                v[r + i] += entry * u[c + j];
                if i > j {
                    v[r + j] += entry * u[c + i];
                }
            }
        }
    }
}
