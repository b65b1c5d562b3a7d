// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much more matches pull together than they would if each had an error of its own.
//!
//! The matches between two stretches share surfaces, and with them noise, curvature and whatever is wrong
//! with the model. With independent errors of unit size, the sum of their gradients `g` has the
//! variance of their information `H`. Its excess is the overdispersion of cluster-robust standard
//! errors (Liang and Zeger 1986), here one number for all unknowns.

use crate::NormalEquations;

/// Sums over the links of what each control point is pulled by.
pub struct Scatter {
    /// `Σ g²`.
    squares: Vec<[f64; 6]>,
    /// `Σ H`, diagonal.
    information: Vec<[f64; 6]>,
}

impl Scatter {
    pub fn new(n_controls: usize) -> Self {
        Self {
            squares: vec![[0.0; 6]; n_controls],
            information: vec![[0.0; 6]; n_controls],
        }
    }

    /// Adds the equations of a link between two stretches, whose control point `k` is `controls[k]`.
    pub fn add(&mut self, equations: &NormalEquations, controls: &[usize]) {
        for (k, &control) in controls.iter().enumerate() {
            let (gradient, diagonal) = (equations.knot_gradient(k), equations.diagonal(k));
            for i in 0..6 {
                self.squares[control][i] += gradient[i] * gradient[i];
                self.information[control][i] += diagonal[i];
            }
        }
    }

    /// Mean of `g² / H` over all unknowns that matches pull; one if there are none.
    pub fn dispersion(&self) -> f64 {
        let squares = self.squares.as_flattened().iter();
        let pairs = squares.zip(self.information.as_flattened());
        let ratios: Vec<f64> = pairs
            .filter(|(_, h)| **h > 0.0)
            .map(|(s, h)| s / h)
            .collect();
        if ratios.is_empty() {
            return 1.0;
        }
        ratios.iter().sum::<f64>() / ratios.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RowGroup;

    /// A link with `n` rows along x at one control point, whose residuals are `residual(k)`.
    fn link(n: usize, residual: impl Fn(usize) -> f64) -> NormalEquations {
        let mut equations = NormalEquations::new(1);
        let mut group = RowGroup::new([0]);
        for k in 0..n {
            group.clear_row();
            group.knots_mut()[3] = 1.0;
            group.add(residual(k), 1.0);
        }
        group.flush(&mut equations);
        equations
    }

    fn dispersion(residual: impl Fn(usize) -> f64) -> f64 {
        let mut scatter = Scatter::new(3);
        scatter.add(&link(100, residual), &[2]);
        scatter.dispersion()
    }

    #[test]
    fn residuals_that_cancel_do_not_scatter_and_common_ones_scatter_as_one() {
        assert!(dispersion(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).abs() < 1e-12);
        assert!((dispersion(|_| 1.0) - 100.0).abs() < 1e-9);
    }

    #[test]
    fn larger_residuals_scatter_by_their_square() {
        let ratio = dispersion(|k| (k as f64).sin() * 3.0) / dispersion(|k| (k as f64).sin());
        assert!((ratio - 9.0).abs() < 1e-9);
    }

    #[test]
    fn without_matches_rows_count_as_independent() {
        assert_eq!(Scatter::new(4).dispersion(), 1.0);
    }
}
