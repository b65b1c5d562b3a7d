// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which links are false: graduated non-convexity (Yang, Antonante, Tzoumas and Carlone 2020) with
//! the `Geman`–`McClure` kernel.
//!
//! The kernel's cost has many minima; so it is approached from a convex one, by a width that falls to
//! its last. Information matrices are seldom right to a factor, and residuals of true links grow while
//! false ones pull; so they are measured by their median, not by what they should be. Up to half
//! of the doubtful links may therefore be false.

use nalgebra::Isometry3;

use crate::GraphError;
use crate::dogleg::{Minimizer, Minimum, Stop};
use crate::equations::chi2s;
use crate::graph::{Link, PoseGraph};

/// How false links are told.
#[derive(Clone, Copy, Debug)]
pub struct Robust {
    /// `rᵀΩr` in medians at which the kernel has lost three quarters of its weight.
    pub kernel_width: f64,
    /// `rᵀΩr` in medians above which a link is false in the end.
    pub max_ratio: f64,
    /// Factor by which the kernel narrows from step to step.
    pub growth: f64,
}

/// Steps with the kernel at its final width at most.
const MAX_FINAL_STEPS: usize = 10;

/// `rᵀΩr` of links that agree to a millionth of a standard deviation; less is rounding.
pub const EXACT: f64 = 1e-12;

/// The largest of ten million Gaussian residuals is this many times their 95th percentile; those of
/// real links have longer tails, which [`Robust::max_ratio`] cuts.
const MAX_TAIL_RATIO: f64 = 3.5;

/// Change of the cost, as a share, at which the kernel at its final width has done its work.
const SETTLED: f64 = 1e-2;

/// How well the minimum for each width of the kernel is found; the next one will be another.
const ROUGHLY: Stop = Stop {
    max_iterations: 3,
    min_relative_decrease: 0.03,
};

/// Finds which of the links `open` to belief are true, beginning at `poses`; gives the poses reached
/// and weights of 0 or 1.
///
/// `start` gives poses for weights that may be better than those given to it. False links fold a
/// graph into poses from which no descent leads back, but the relaxation does not know of folds.
///
/// # Errors
/// As the minimization.
pub fn anneal(
    graph: &PoseGraph,
    open: &[bool],
    poses: &[Isometry3<f64>],
    minimizer: &mut Minimizer,
    mut start: impl FnMut(&[Isometry3<f64>], &[f64]) -> Result<Vec<Isometry3<f64>>, GraphError>,
    robust: &Robust,
) -> Result<(Minimum, Vec<f64>), GraphError> {
    let all: Vec<f64> = open.iter().map(|&o| f64::from(u8::from(o))).collect();
    let first = minimizer.minimize(start(poses, &all)?, &all, ROUGHLY)?;
    // Convex from here on (Yang 2020, remark 5).
    let width = 2.0 * Residuals::at(graph, open, &first.poses).worst;
    narrow(graph, open, first, width, minimizer, start, robust)
}

/// The same from poses that are nearly right, with a kernel that is no wider than `width`.
///
/// # Errors
/// As the minimization.
pub fn narrow(
    graph: &PoseGraph,
    open: &[bool],
    mut best: Minimum,
    mut width: f64,
    minimizer: &mut Minimizer,
    mut start: impl FnMut(&[Isometry3<f64>], &[f64]) -> Result<Vec<Isometry3<f64>>, GraphError>,
    robust: &Robust,
) -> Result<(Minimum, Vec<f64>), GraphError> {
    let mut step = |poses: &[Isometry3<f64>], weights: &[f64]| {
        minimizer.minimize(start(poses, weights)?, weights, ROUGHLY)
    };
    let mut residuals = Residuals::at(graph, open, &best.poses);
    let mut n_final_steps = 0;
    while n_final_steps < MAX_FINAL_STEPS {
        let weights = residuals.weights(graph, open, |chi2| (width / (chi2 + width)).powi(2));
        let moved = step(&best.poses, &weights)?;
        let settled = (best.cost - moved.cost).abs() <= SETTLED * best.cost;
        best = Minimum {
            n_iterations: best.n_iterations + moved.n_iterations,
            ..moved
        };
        residuals = Residuals::at(graph, open, &best.poses);
        // The median falls faster than the kernel may narrow, once the fold is undone.
        let narrowest = robust.kernel_width * residuals.median;
        if width <= narrowest {
            n_final_steps += 1;
            if settled {
                break;
            }
        }
        width = (width / robust.growth).max(narrowest);
    }
    let weights = residuals.cut(graph, open, robust);
    Ok((best, weights))
}

/// The middle one of the values.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

/// `rᵀΩr` of all links, and of the doubtful ones that are open to belief the median and the largest.
pub struct Residuals {
    /// Of all links.
    pub chi2: Vec<f64>,
    /// Of those that may be false.
    pub median: f64,
    /// 95 of 100 of those are no larger.
    pub tail: f64,
    worst: f64,
}

impl Residuals {
    /// The residuals at `poses`.
    pub fn at(graph: &PoseGraph, open: &[bool], poses: &[Isometry3<f64>]) -> Self {
        let chi2 = chi2s(graph, poses);
        let links = graph.links.iter().zip(open).zip(&chi2);
        let doubtful = links.filter(|((link, open), _)| !link.trusted && **open);
        let mut sorted: Vec<f64> = doubtful.map(|(_, c)| *c).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        Self {
            chi2,
            median: sorted.get(sorted.len() / 2).map_or(EXACT, |m| m.max(EXACT)),
            tail: sorted
                .get(sorted.len() * 95 / 100)
                .map_or(EXACT, |t| t.max(EXACT)),
            worst: sorted.last().copied().unwrap_or(0.0),
        }
    }

    /// Above it a link is false, where these are residuals of links that are believed.
    pub fn limit(&self, robust: &Robust) -> f64 {
        (robust.max_ratio * self.median).min(MAX_TAIL_RATIO * self.tail)
    }

    /// Weight 1 for links that are open and not false.
    fn cut(&self, graph: &PoseGraph, open: &[bool], robust: &Robust) -> Vec<f64> {
        let limit = robust.max_ratio * self.median;
        self.weights(graph, open, |chi2| f64::from(u8::from(chi2 <= limit)))
    }

    fn weights(&self, graph: &PoseGraph, open: &[bool], kernel: impl Fn(f64) -> f64) -> Vec<f64> {
        let links = graph.links.iter().zip(open).zip(&self.chi2);
        let weight = |((link, open), chi2): ((&Link, &bool), &f64)| match (link.trusted, *open) {
            (true, _) => 1.0,
            (false, true) => kernel(*chi2),
            (false, false) => 0.0,
        };
        links.map(weight).collect()
    }
}
