// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which links are believed, found in rounds: first among those that others vouch for, then with those
//! that do not contradict what the first have told.
//!
//! A link that waits costs nothing. One that joins what is far apart fills the sparse factor; many of
//! them make it tens of times slower, and most of them are false.

use nalgebra::{Isometry3, Matrix6};

use crate::GraphError;
use crate::chordal::Relaxation;
use crate::dogleg::{Minimizer, Minimum, Stop};
use crate::equations::structure;
use crate::graph::{PoseGraph, held};
use crate::motion::{Motion, squared};
use crate::robust::{Residuals, Robust, anneal};
use crate::solve::cheaper;
use crate::terms::LinkAt;
use crate::voting::supported;

/// Medians of `rᵀΩr` by which a link that nobody vouches for may be off. Most such links are false;
/// of true ones with Gaussian errors two in ten thousand are off by more.
const LONELY_RATIO: f64 = 5.0;

/// Finds the poses that agree best with the true links; gives them and weights of 0 or 1.
///
/// # Errors
/// When the links that are believed do not determine all poses, or the cost is not finite.
pub fn believed(
    graph: &PoseGraph,
    numbers: &[Option<usize>],
    stop: Stop,
    robust: &Robust,
) -> Result<(Minimum, Vec<f64>), GraphError> {
    let mut open = first_opened(graph, robust);
    let mut search = Search {
        graph,
        numbers,
        stop,
        robust,
        weights: Vec::new(),
        best: Minimum {
            poses: graph.poses.clone(),
            cost: f64::INFINITY,
            n_iterations: 0,
            converged: false,
        },
    };
    search.anneal(&open)?;
    let lonely: Vec<usize> = (0..open.len()).filter(|&index| !open[index]).collect();
    let credible = search.minimize(&open, &lonely, LONELY_RATIO)?;
    if !credible.is_empty() {
        for index in credible {
            open[index] = true;
        }
        search.anneal(&open)?;
    }
    search.readmit(&open)?;
    Ok((search.best, search.weights))
}

/// The best poses so far, and weights of the links that made them.
struct Search<'a> {
    graph: &'a PoseGraph,
    numbers: &'a [Option<usize>],
    stop: Stop,
    robust: &'a Robust,
    weights: Vec<f64>,
    best: Minimum,
}

impl Search<'_> {
    /// Tells which of the `open` links are true, roughly.
    fn anneal(&mut self, open: &[bool]) -> Result<(), GraphError> {
        let (graph, numbers) = (self.graph, self.numbers);
        let weights: Vec<f64> = open.iter().map(|&o| f64::from(u8::from(o))).collect();
        let structure = structure(graph, numbers, &weights);
        let mut relaxation = Relaxation::new(graph, numbers, &structure)?;
        let start = |given: &[Isometry3<f64>], weights: &[f64]| {
            cheaper(graph, given, relaxation.poses(weights)?, weights)
        };
        let mut minimizer = Minimizer::new(graph, numbers, &structure)?;
        let poses = &self.best.poses;
        let (found, weights) = anneal(graph, open, poses, &mut minimizer, start, self.robust)?;
        self.weights = weights;
        self.moved_to(found);
        Ok(())
    }

    /// Finds the minimum for the weights. Gives those of the links `asked`, which have no weight, that
    /// do not contradict it: as seen from the minimum, with its and their own uncertainty, they are
    /// off by no more than `max_ratio` medians.
    fn minimize(
        &mut self,
        open: &[bool],
        asked: &[usize],
        max_ratio: f64,
    ) -> Result<Vec<usize>, GraphError> {
        let graph = self.graph;
        let structure = structure(graph, self.numbers, &self.weights);
        let mut minimizer = Minimizer::new(graph, self.numbers, &structure)?;
        let poses = self.best.poses.clone();
        let found = minimizer.minimize(poses, &self.weights, self.stop)?;
        self.moved_to(found);
        if asked.is_empty() {
            return Ok(Vec::new());
        }
        let poses = &self.best.poses;
        let limit = max_ratio * Residuals::at(graph, open, poses).median;
        let uncertainties = minimizer.uncertainties(poses, &self.weights, asked)?;
        let agrees = |(index, uncertainty): &(&usize, Matrix6<f64>)| {
            let link = &graph.links[**index];
            let covariance = Motion::of(link).covariance + uncertainty;
            squared(LinkAt::new(link, poses).residual(), covariance) <= limit
        };
        let agreeing = asked.iter().zip(uncertainties).filter(agrees);
        Ok(agreeing.map(|(&index, _)| index).collect())
    }

    /// Believes links after all that the kernel has pushed away, but for those that then are not where
    /// they should be.
    fn readmit(&mut self, open: &[bool]) -> Result<(), GraphError> {
        let rejected = |index: &usize| open[*index] && self.weights[*index] == 0.0;
        let rejected: Vec<usize> = (0..open.len()).filter(rejected).collect();
        let mut changed = self.minimize(open, &rejected, self.robust.max_ratio)?;
        for weight in [1.0, 0.0] {
            if changed.is_empty() {
                break;
            }
            for &index in &changed {
                self.weights[index] = weight;
            }
            self.minimize(open, &[], 0.0)?;
            let residuals = Residuals::at(self.graph, open, &self.best.poses);
            let limit = self.robust.max_ratio * residuals.median;
            changed.retain(|&index| residuals.chi2[index] > limit);
        }
        Ok(())
    }

    fn moved_to(&mut self, found: Minimum) {
        self.best = Minimum {
            n_iterations: self.best.n_iterations + found.n_iterations,
            ..found
        };
    }
}

/// The links that others vouch for, and those without which nodes would not be held. All, where less
/// than half have anybody who does: what so few tell is no measure for the others.
fn first_opened(graph: &PoseGraph, robust: &Robust) -> Vec<bool> {
    let mut open = supported(graph, robust.max_ratio);
    let links = graph.links.iter().zip(&open);
    let doubtful = links.filter(|(l, _)| !l.trusted).map(|(_, o)| usize::from(*o));
    let (n_doubtful, n_open) = doubtful.fold((0, 0), |(n, m), o| (n + 1, m + o));
    if 2 * n_open < n_doubtful {
        open.fill(true);
    }
    open_bridges(graph, &mut open);
    open
}

/// Opens the links without which nodes would not be held.
fn open_bridges(graph: &PoseGraph, open: &mut [bool]) {
    loop {
        let held = held(graph, |index| open[index]);
        if held.iter().all(|h| *h) {
            return;
        }
        for (link, open) in graph.links.iter().zip(open.iter_mut()) {
            let from = link.from.is_none_or(|from| held[from]);
            *open |= from != held[link.to] || link.from.is_none();
        }
    }
}
