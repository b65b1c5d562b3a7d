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

/// Rounds at most; each opens links that the one before has made credible.
const MAX_ROUNDS: usize = 4;

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
    for round in 1.. {
        search.anneal(&open)?;
        let credible = search.credible(&open)?;
        if round == MAX_ROUNDS || credible.iter().all(|&index| open[index]) {
            search.readmit(&open, &credible)?;
            break;
        }
        for index in credible {
            open[index] = true;
        }
    }
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

    /// Finds the minimum for the weights; gives the links without a weight that do not contradict
    /// it, where they contradict it by no more than they and it are uncertain.
    fn credible(&mut self, open: &[bool]) -> Result<Vec<usize>, GraphError> {
        let graph = self.graph;
        let structure = structure(graph, self.numbers, &self.weights);
        let mut minimizer = Minimizer::new(graph, self.numbers, &structure)?;
        let poses = self.best.poses.clone();
        let found = minimizer.minimize(poses, &self.weights, self.stop)?;
        self.moved_to(found);
        let poses = &self.best.poses;
        let limit = Residuals::at(graph, open, poses).limit(self.robust);
        let weights = self.weights.iter().enumerate();
        let waiting: Vec<usize> = weights.filter(|(_, w)| **w == 0.0).map(|(i, _)| i).collect();
        let uncertainties = minimizer.uncertainties(poses, &self.weights, &waiting)?;
        let agrees = |&(&index, uncertainty): &(&usize, Matrix6<f64>)| {
            let link = &graph.links[index];
            let covariance = Motion::of(link).covariance + uncertainty;
            squared(LinkAt::new(link, poses).residual(), covariance) <= limit
        };
        let agreeing = waiting.iter().zip(uncertainties).filter(agrees);
        Ok(agreeing.map(|(&index, _)| index).collect())
    }

    /// Believes links that have been rejected after all, but for those that the others then pull away
    /// from.
    fn readmit(&mut self, open: &[bool], credible: &[usize]) -> Result<(), GraphError> {
        let mut pulled = credible.to_vec();
        for weight in [1.0, 0.0] {
            if pulled.is_empty() {
                break;
            }
            for &index in &pulled {
                self.weights[index] = weight;
            }
            let structure = structure(self.graph, self.numbers, &self.weights);
            let mut minimizer = Minimizer::new(self.graph, self.numbers, &structure)?;
            let poses = self.best.poses.clone();
            self.moved_to(minimizer.minimize(poses, &self.weights, self.stop)?);
            let residuals = Residuals::at(self.graph, open, &self.best.poses);
            let limit = residuals.limit(self.robust);
            pulled.retain(|&index| residuals.chi2[index] > limit);
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
