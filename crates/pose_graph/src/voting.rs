// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which doubtful links others vouch for, before anything is solved.
//!
//! Who comes back to a place comes back to its neighbours as well. So a true link has companions:
//! links from near its one end to near its other end, which by way of the trusted links that join the
//! ends must tell the same motion (the consistency of pairs of Mangelson, Dominic, Eustice and
//! Vasudevan 2018, equation 7, and the clusters of Latif, Cadena and Neira 2013). A false link joins
//! what is far apart; it seldom has companions, and they disagree.
//!
//! Nobody vouching proves nothing: a true link may be alone. Such links wait until the others have
//! told where the nodes are.

use crate::graph::{Link, PoseGraph};
use crate::motion::Motion;
use crate::robust::{EXACT, median};

/// Trusted links between the ends of companions at most, at each end.
const REACH: usize = 2;

/// Nodes that count as near a node at most, the nearest first.
const MAX_NEAR: usize = 64;

/// Companions of a link that are asked at most, the nearest first.
const MAX_COMPANIONS: usize = 24;

/// Whether each link is trusted, or some companion differs from it by no more than `max_ratio` times
/// the median of all such differences.
pub fn supported(graph: &PoseGraph, max_ratio: f64) -> Vec<bool> {
    let neighborhood = Neighborhood::of(graph);
    let differences: Vec<Vec<f64>> = (0..graph.links.len())
        .map(|index| neighborhood.differences(graph, index))
        .collect();
    // Companions by chance are few: of most links the middle one is true.
    let middles: Vec<f64> = differences.iter().filter_map(|all| median(all)).collect();
    let typical = median(&middles).map_or(EXACT, |m| m.max(EXACT));
    let vouched = |all: &Vec<f64>| all.iter().any(|d| *d <= max_ratio * typical);
    let links = graph.links.iter().zip(&differences);
    links.map(|(l, all)| l.trusted || vouched(all)).collect()
}

/// Nodes that few trusted links join, and the doubtful links at each node. The map counts as a node
/// that is near nothing.
struct Neighborhood {
    near: Vec<Vec<(usize, Motion)>>,
    doubtful: Vec<Vec<usize>>,
    measured: Vec<Motion>,
}

impl Neighborhood {
    fn of(graph: &PoseGraph) -> Self {
        let n_nodes = graph.poses.len() + 1;
        let measured: Vec<Motion> = graph.links.iter().map(Motion::of).collect();
        let mut trusted = vec![Vec::new(); n_nodes];
        let mut doubtful = vec![Vec::new(); n_nodes];
        for (index, link) in graph.links.iter().enumerate() {
            let (from, to) = ends(graph, link);
            if !link.trusted {
                doubtful[from].push(index);
                doubtful[to].push(index);
            } else if link.from.is_some() {
                trusted[from].push((to, measured[index]));
                trusted[to].push((from, measured[index].back()));
            }
        }
        let near = (0..n_nodes).map(|node| reached(node, &trusted)).collect();
        Self {
            near,
            doubtful,
            measured,
        }
    }

    /// By how much companions differ from a link, in units of the variance; none for trusted links.
    fn differences(&self, graph: &PoseGraph, index: usize) -> Vec<f64> {
        let link = &graph.links[index];
        if link.trusted {
            return Vec::new();
        }
        let (from, to) = ends(graph, link);
        let own = &self.measured[index];
        let along = self.way(from, to).map(|way| own.chi2(way));
        let others = self.near[from].iter().flat_map(|(start, there)| {
            let crossings = self.doubtful[*start].iter().filter(|&&m| m != index);
            crossings.filter_map(move |&m| {
                let (first, second) = ends(graph, &graph.links[m]);
                let (end, crossing) = if first == *start {
                    (second, self.measured[m])
                } else {
                    (first, self.measured[m].back())
                };
                let home = self.way(end, to)?;
                Some(own.chi2(&there.then(&crossing).then(home)))
            })
        });
        along
            .into_iter()
            .chain(others.take(MAX_COMPANIONS))
            .collect()
    }

    /// The way over trusted links between nodes that are near each other.
    fn way(&self, start: usize, end: usize) -> Option<&Motion> {
        let found = self.near[start].iter().find(|(node, _)| *node == end);
        found.map(|(_, way)| way)
    }
}

fn ends(graph: &PoseGraph, link: &Link) -> (usize, usize) {
    (link.from.unwrap_or(graph.poses.len()), link.to)
}

/// Nodes that at most [`REACH`] trusted links lead to, the nearest first, and the ways there.
fn reached(node: usize, trusted: &[Vec<(usize, Motion)>]) -> Vec<(usize, Motion)> {
    let mut found = vec![(node, Motion::none())];
    let mut ring = 0..1;
    for _ in 0..REACH {
        for place in ring.clone() {
            let (here, way) = found[place];
            for (next, step) in &trusted[here] {
                let full = found.len() >= MAX_NEAR;
                if !full && found.iter().all(|(known, _)| known != next) {
                    found.push((*next, way.then(step)));
                }
            }
        }
        ring = ring.end..found.len();
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{helix, noisy_helix, true_link, with_false_links};

    #[test]
    fn companions_vouch_for_every_true_link_and_for_no_false_one() {
        let graph = noisy_helix(8, 20);
        let n_true = graph.links.len();
        let supported = supported(&with_false_links(graph, 30), 25.0);
        assert!(supported[..n_true].iter().all(|&s| s));
        assert!(supported[n_true..].iter().all(|&s| !s));
    }

    #[test]
    fn links_that_are_seen_from_their_other_end_are_companions_as_well() {
        let mut graph = noisy_helix(8, 20);
        for link in graph.links.iter_mut().filter(|l| !l.trusted).step_by(2) {
            link.from = Some(std::mem::replace(&mut link.to, link.from.unwrap_or(0)));
            link.T_from_to = link.T_from_to.inverse();
        }
        assert!(supported(&graph, 25.0).iter().all(|&s| s));
    }

    #[test]
    fn nobody_vouches_for_a_true_link_that_is_alone() {
        let mut graph = noisy_helix(8, 20);
        graph.links.push(true_link(&helix(8, 20), 3, 150));
        let supported = supported(&graph, 25.0);
        assert_eq!(
            supported.iter().position(|&s| !s),
            Some(graph.links.len() - 1)
        );
    }

    #[test]
    fn the_way_along_trusted_links_speaks_for_a_link_between_near_nodes_and_against_a_false_one() {
        let truth = helix(8, 20);
        let mut graph = noisy_helix(8, 20);
        graph.links.push(true_link(&truth, 3, 5));
        graph.links.push(Link {
            to: 61,
            from: Some(60),
            ..true_link(&truth, 3, 5)
        });
        let n = graph.links.len();
        assert_eq!(supported(&graph, 25.0)[n - 2..], [true, false]);
    }
}
