// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which links are believed, found in rounds: first among those that others vouch for, then with those
//! that do not contradict what the first have told.
//!
//! A link that waits costs nothing. One that joins what is far apart fills the sparse factor; many of
//! them make it tens of times slower, and most of them are false.

use nalgebra::{Isometry3, Matrix6};

use crate::GraphError;
use crate::calibration::calibrated;
use crate::chordal::Relaxation;
use crate::dogleg::{Minimizer, Minimum, Stop};
use crate::equations::{cheaper, structure};
use crate::graph::{PoseGraph, held};
use crate::motion::{Motion, squared};
use crate::robust::{Residuals, Robust, anneal, narrow};
use crate::terms::LinkAt;
use crate::voting::supported;

/// 95th percentiles of `rᵀΩr` by which a link that nobody vouches for may be off. Most such links are
/// false; of true ones with Gaussian errors one in a hundred is off by more.
const LONELY_RATIO: f64 = 1.3;

/// Credible links at least that show how they are spread.
const MIN_CROWD: usize = 8;

/// Nodes for which waiting links are opened one node after the other; beyond, all are.
const MAX_OPENED_NODES: usize = 100;

/// Times that links are rejected after the kernel's work at most.
const MAX_TRIMS: usize = 4;

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
    let given = Minimum {
        poses: graph.poses.clone(),
        cost: f64::INFINITY,
        n_iterations: 0,
        converged: false,
    };
    let mut search = Search {
        graph,
        numbers,
        stop,
        robust,
        weights: Vec::new(),
        best: given.clone(),
    };
    let result = match search.in_rounds() {
        Err(GraphError::Singular { .. }) => {
            // Links that wait may be what holds a node after others are rejected.
            search.best = given;
            search.among(&vec![true; graph.links.len()])
        }
        done => done,
    };
    result.map(|()| (search.best, search.weights))
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
    /// Finds the true links among those that others vouch for, and with these the others.
    fn in_rounds(&mut self) -> Result<(), GraphError> {
        let mut open = first_opened(self.graph, self.robust);
        self.anneal_opening(&mut open)?;
        self.calibrated(&mut open, |search, open| {
            let lonely: Vec<usize> = (0..open.len()).filter(|&index| !open[index]).collect();
            let credible = search.lonely_credible(&lonely)?;
            if !credible.is_empty() {
                for index in credible {
                    open[index] = true;
                }
                search.anneal(open)?;
                search.minimize()?;
            }
            search.revise(open)
        })
    }

    /// Does `work` with turns and shifts weighed as their residuals tell, then finds the minimum for
    /// the information as it was given.
    fn calibrated(
        &mut self,
        open: &mut [bool],
        work: impl FnOnce(&mut Search, &mut [bool]) -> Result<(), GraphError>,
    ) -> Result<(), GraphError> {
        let Some(graph) = calibrated(self.graph, &self.best.poses, &self.weights) else {
            self.minimize()?;
            return work(self, open);
        };
        let mut search = Search {
            graph: &graph,
            weights: self.weights.clone(),
            best: self.best.clone(),
            ..*self
        };
        search.settle(open)?;
        work(&mut search, open)?;
        (self.weights, self.best) = (search.weights, search.best);
        self.descend(self.best.poses.clone())
    }

    /// Finds the true links among those that are `open`.
    fn among(&mut self, open: &[bool]) -> Result<(), GraphError> {
        self.anneal(open)?;
        self.calibrated(&mut open.to_vec(), |search, open| search.revise(open))
    }

    /// Does what the kernel leaves to do.
    fn revise(&mut self, open: &[bool]) -> Result<(), GraphError> {
        self.readmit(open)?;
        self.trim()
    }

    /// Tells which of the `open` links are true, roughly.
    fn anneal(&mut self, open: &[bool]) -> Result<(), GraphError> {
        let (graph, numbers) = (self.graph, self.numbers);
        let structure = structure(graph, numbers, &as_weights(open));
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

    /// The same; where the open links do not determine a node, those at the node are opened as well.
    fn anneal_opening(&mut self, open: &mut [bool]) -> Result<(), GraphError> {
        for _ in 0..MAX_OPENED_NODES {
            let unknown = match self.anneal(open) {
                Err(GraphError::Singular { node }) => node,
                done => return done,
            };
            let node = self.numbers.iter().position(|&n| n == Some(unknown));
            for (link, open) in self.graph.links.iter().zip(open.iter_mut()) {
                *open |= Some(link.to) == node || link.from == node;
            }
        }
        open.fill(true);
        self.anneal(open)
    }

    /// Tells again which of the open links are true, from the poses found on, and finds the minimum.
    fn settle(&mut self, open: &[bool]) -> Result<(), GraphError> {
        let (graph, numbers) = (self.graph, self.numbers);
        let structure = structure(graph, numbers, &as_weights(open));
        let mut minimizer = Minimizer::new(graph, numbers, &structure)?;
        let start = |given: &[Isometry3<f64>], _: &[f64]| Ok(given.to_vec());
        // The kernel leaves folds from which no descent leads back.
        let relaxed = Relaxation::new(graph, numbers, &structure)?.poses(&self.weights)?;
        self.best.poses = cheaper(graph, &self.best.poses, relaxed, &self.weights)?;
        let width = self.residuals().limit(self.robust);
        let (found, weights) = narrow(
            graph,
            open,
            self.best.clone(),
            width,
            &mut minimizer,
            start,
            self.robust,
        )?;
        self.best = found;
        let minimum = minimizer.minimize(self.best.poses.clone(), &weights, self.stop)?;
        self.weights = weights;
        self.moved_to(minimum);
        Ok(())
    }

    /// Finds the minimum for the weights.
    fn minimize(&mut self) -> Result<(), GraphError> {
        let structure = structure(self.graph, self.numbers, &self.weights);
        let mut relaxation = Relaxation::new(self.graph, self.numbers, &structure)?;
        // The kernel leaves poses that are bent towards links that have no weight any more.
        let relaxed = relaxation.poses(&self.weights)?;
        self.descend(cheaper(
            self.graph,
            &self.best.poses,
            relaxed,
            &self.weights,
        )?)
    }

    /// Finds the minimum that is nearest to `start`.
    fn descend(&mut self, start: Vec<Isometry3<f64>>) -> Result<(), GraphError> {
        let structure = structure(self.graph, self.numbers, &self.weights);
        let mut minimizer = Minimizer::new(self.graph, self.numbers, &structure)?;
        self.moved_to(minimizer.minimize(start, &self.weights, self.stop)?);
        Ok(())
    }

    /// Those of the links that nobody vouches for that do not contradict the poses.
    fn lonely_credible(&self, lonely: &[usize]) -> Result<Vec<usize>, GraphError> {
        let contradictions = self.contradictions(lonely)?;
        let limit = without_crowd(&contradictions, LONELY_RATIO * self.residuals().tail);
        Ok(those_within(limit, lonely, &contradictions))
    }

    /// By how much links that have no weight contradict the poses, `rᵀΣ⁻¹r` with the uncertainty of
    /// both, to be compared with residuals of links that have made the poses. These are smaller by the
    /// share of links beyond those that it takes to determine the poses.
    fn contradictions(&self, asked: &[usize]) -> Result<Vec<f64>, GraphError> {
        if asked.is_empty() {
            return Ok(Vec::new());
        }
        let (graph, poses) = (self.graph, &self.best.poses);
        let structure = structure(graph, self.numbers, &self.weights);
        let mut minimizer = Minimizer::new(graph, self.numbers, &structure)?;
        let uncertainties = minimizer.uncertainties(poses, &self.weights, asked)?;
        let n_believed = self.weights.iter().filter(|w| **w > 0.0).count();
        let n_free = self.numbers.iter().flatten().count();
        let redundancy = 1.0 - (n_free as f64 / n_believed.max(1) as f64).min(1.0);
        let contradiction = |(&index, uncertainty): (&usize, &Matrix6<f64>)| {
            let link = &graph.links[index];
            let covariance = Motion::of(link).covariance + uncertainty;
            redundancy * squared(LinkAt::new(link, poses).residual(), &covariance)
        };
        Ok(asked
            .iter()
            .zip(&uncertainties)
            .map(contradiction)
            .collect())
    }

    /// Believes links after all that the kernel has pushed away.
    fn readmit(&mut self, open: &[bool]) -> Result<(), GraphError> {
        let rejected = |index: &usize| open[*index] && self.weights[*index] == 0.0;
        let rejected: Vec<usize> = (0..open.len()).filter(rejected).collect();
        let limit = self.residuals().limit(self.robust);
        let credible = those_within(limit, &rejected, &self.contradictions(&rejected)?);
        if credible.is_empty() {
            return Ok(());
        }
        for index in credible {
            self.weights[index] = 1.0;
        }
        self.minimize()
    }

    /// Rejects links that even the poses that they have pulled contradict.
    fn trim(&mut self) -> Result<(), GraphError> {
        for _ in 0..MAX_TRIMS {
            let residuals = self.residuals();
            let limit = residuals.limit(self.robust);
            let mut n_cut = 0;
            let links = self.graph.links.iter().zip(&residuals.chi2);
            for (weight, (link, chi2)) in self.weights.iter_mut().zip(links) {
                if *weight > 0.0 && !link.trusted && *chi2 > limit {
                    *weight = 0.0;
                    n_cut += 1;
                }
            }
            if n_cut == 0 {
                break;
            }
            self.minimize()?;
        }
        Ok(())
    }

    /// Of the links that are believed.
    fn residuals(&self) -> Residuals {
        let believed: Vec<bool> = self.weights.iter().map(|w| *w > 0.0).collect();
        Residuals::at(self.graph, &believed, &self.best.poses)
    }

    fn moved_to(&mut self, found: Minimum) {
        self.best = Minimum {
            n_iterations: self.best.n_iterations + found.n_iterations,
            ..found
        };
    }
}

fn as_weights(open: &[bool]) -> Vec<f64> {
    open.iter().map(|&o| f64::from(u8::from(o))).collect()
}

/// The limit, halved until not most of those within it are far out.
///
/// False links are near the poses by chance, as many as the share of the six-dimensional space says:
/// eight times fewer are within half a limit of squares. Of true ones most are.
fn without_crowd(contradictions: &[f64], mut limit: f64) -> f64 {
    let within = |limit: f64| contradictions.iter().filter(|c| **c <= limit).count();
    while within(limit) >= MIN_CROWD && 2 * within(0.5 * limit) < within(limit) {
        limit *= 0.5;
    }
    limit
}

fn those_within(limit: f64, links: &[usize], contradictions: &[f64]) -> Vec<usize> {
    let links = links.iter().zip(contradictions);
    links
        .filter(|(_, c)| **c <= limit)
        .map(|(&index, _)| index)
        .collect()
}

/// The links that others vouch for, and those without which nodes would not be held. All, where less
/// than half have anybody who does: what so few tell is no measure for the others.
fn first_opened(graph: &PoseGraph, robust: &Robust) -> Vec<bool> {
    let mut open = supported(graph, robust.max_ratio);
    let links = graph.links.iter().zip(&open);
    let doubtful = links
        .filter(|(l, _)| !l.trusted)
        .map(|(_, o)| usize::from(*o));
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
            *open |= from != held[link.to];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::poses::numbered;
    use crate::testing::{
        FINELY, ROBUST, drifted, farthest, helix, noisy_helix, true_link, with_false_links,
    };
    use nalgebra::Vector3;

    fn found(graph: &PoseGraph) -> Result<(Minimum, Vec<f64>), GraphError> {
        believed(graph, &numbered(graph), FINELY, &ROBUST)
    }

    /// The last turn has only its way in time and, among many false links, one true one that nobody
    /// vouches for; the way in time has drifted by metres where it ends.
    #[test]
    fn a_lonely_true_link_among_false_ones_is_found() -> Result<(), GraphError> {
        let truth = helix(8, 20);
        let mut graph = noisy_helix(8, 20);
        graph.links.retain(|l| l.trusted || l.to < 140);
        graph.poses = drifted(&graph, &Vector3::new(0.002, 0.001, 0.02));
        let mut graph = with_false_links(graph, 24);
        graph.links.push(true_link(&truth, 98, 158));
        let lonely = graph.links.len() - 1;
        let n_true = lonely - 24;
        let (minimum, weights) = found(&graph)?;
        assert!(weights[..n_true].iter().all(|&w| w == 1.0));
        assert!(weights[n_true..lonely].iter().all(|&w| w == 0.0));
        assert_eq!(weights[lonely], 1.0);
        assert!(farthest(&minimum.poses, &truth.poses) < 0.2);
        Ok(())
    }

    /// Nobody vouches for the link without which the last turns would not be held.
    #[test]
    fn what_only_a_lonely_link_holds_is_held() -> Result<(), GraphError> {
        let truth = helix(8, 20);
        let mut graph = noisy_helix(8, 20);
        graph
            .links
            .retain(|l| l.from.is_some_and(|from| (from < 100) == (l.to < 100)));
        graph.links.push(true_link(&truth, 80, 120));
        let (minimum, weights) = found(&graph)?;
        assert!(weights.iter().all(|&w| w == 1.0));
        assert!(farthest(&minimum.poses, &truth.poses) < 0.2);
        Ok(())
    }

    /// What the others vouch for leaves a node undetermined about one axis; a lonely link does not.
    #[test]
    fn lonely_links_are_opened_where_others_do_not_determine_a_node() -> Result<(), GraphError> {
        let truth = helix(8, 20);
        let mut graph = noisy_helix(8, 20);
        graph.links.retain(|l| l.trusted || l.to < 140);
        for link in graph.links.iter_mut().filter(|l| l.to == 159) {
            link.information.fill_row(2, 0.0);
            link.information.fill_column(2, 0.0);
        }
        graph.links.push(true_link(&truth, 98, 159));
        let (minimum, weights) = found(&graph)?;
        assert!(weights.iter().all(|&w| w == 1.0));
        assert!(
            minimum.poses[159]
                .rotation
                .angle_to(&truth.poses[159].rotation)
                < 0.02
        );
        Ok(())
    }

    #[test]
    fn a_limit_holds_for_true_links_and_gives_way_to_false_ones() {
        // Squared distances of points spread evenly in a ball of six dimensions.
        let by_chance: Vec<f64> = (1..=200)
            .map(|k| 16.0 * (f64::from(k) / 200.0).cbrt())
            .collect();
        let limit = without_crowd(&by_chance, 16.0);
        assert!(by_chance.iter().filter(|c| **c <= limit).count() < MIN_CROWD);
        // Quantiles of the squared length of a Gaussian vector of six dimensions.
        let of_true = [1.6, 2.2, 3.1, 3.8, 4.6, 5.3, 6.2, 7.2, 8.6, 10.6, 12.6];
        assert_eq!(without_crowd(&of_true, 16.0), 16.0);
        assert_eq!(without_crowd(&by_chance[190..196], 16.0), 16.0);
    }
}
