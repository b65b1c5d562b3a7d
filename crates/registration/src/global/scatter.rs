// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much matches pull, beside what they would if each had an error of its own of the stated size.
//!
//! A surfel averages many ranges, so that a match errs by less than its weight says. On the other hand
//! the matches of a patch share its points, its curvature, and whatever is wrong with the model there.
//! Both shows in the sums of their gradients `g`, patch by patch: independent errors of the stated size
//! would give them the variance of their information `H`. The ratio is the dispersion of cluster-robust
//! standard errors (Liang and Zeger 1986), here one number for all unknowns.

use std::collections::BTreeMap;

use bentwing_voxels::VoxelKey;

/// What the matches of each patch pull at a control point: `Σ g`.
pub type Pulls = BTreeMap<(VoxelKey, usize), [f64; 6]>;

/// Sums over the links.
pub struct Scatter {
    pulls: Pulls,
    /// `Σ H`, diagonal, of all control points together.
    information: [f64; 6],
}

impl Scatter {
    pub fn new() -> Self {
        Self {
            pulls: Pulls::new(),
            information: [0.0; 6],
        }
    }

    /// Adds what the matches of a link pull, and the diagonals of their information.
    pub fn add(&mut self, pulls: Pulls, diagonals: impl Iterator<Item = [f64; 6]>) {
        for (place, pull) in pulls {
            let sum = self.pulls.entry(place).or_default();
            add_to(sum, &pull);
        }
        for diagonal in diagonals {
            add_to(&mut self.information, &diagonal);
        }
    }

    /// `Σ (Σ g)² / Σ H`, the median of the six axes; one without matches.
    pub fn dispersion(&self) -> f64 {
        let mut squares = [0.0; 6];
        for pull in self.pulls.values() {
            add_to(&mut squares, &pull.map(|g| g * g));
        }
        let pairs = squares.iter().zip(&self.information);
        let seen = pairs.filter(|(_, h)| **h > 0.0);
        let mut ratios: Vec<f64> = seen.map(|(s, h)| s / h).collect();
        ratios.sort_unstable_by(f64::total_cmp);
        let Some(upper) = ratios.get(ratios.len() / 2) else {
            return 1.0;
        };
        0.5 * (upper + ratios[(ratios.len() - 1) / 2])
    }
}

fn add_to(sum: &mut [f64; 6], terms: &[f64; 6]) {
    for (to, from) in sum.iter_mut().zip(terms) {
        *to += from;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A match of unit information in a patch of its own or in that of all, which pulls along x.
    fn scatter(n: i32, patch: impl Fn(i32) -> i32, pull: impl Fn(i32) -> f64) -> f64 {
        let mut scatter = Scatter::new();
        for k in 0..n {
            let place = (VoxelKey::new([patch(k).into(), 0, 0]), 2);
            let pulls = Pulls::from([(place, [0.0, 0.0, 0.0, pull(k), 0.0, 0.0])]);
            scatter.add(pulls, [[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]].into_iter());
        }
        scatter.dispersion()
    }

    fn sign(k: i32) -> f64 {
        if k % 2 == 0 { 1.0 } else { -1.0 }
    }

    #[test]
    fn errors_of_their_own_scatter_as_stated_and_common_ones_as_one() {
        assert!((scatter(100, |k| k, sign) - 1.0).abs() < 1e-12);
        assert!((scatter(100, |_| 0, |_| 1.0) - 100.0).abs() < 1e-9);
    }

    #[test]
    fn larger_residuals_scatter_by_their_square() {
        let ratio = scatter(100, |k| k, |k| 3.0 * sign(k)) / scatter(100, |k| k, sign);
        assert!((ratio - 9.0).abs() < 1e-9);
    }

    #[test]
    fn without_matches_rows_count_as_stated() {
        assert_eq!(Scatter::new().dispersion(), 1.0);
    }
}
