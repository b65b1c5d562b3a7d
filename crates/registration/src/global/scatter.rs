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
