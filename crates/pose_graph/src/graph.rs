// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a pose graph consists of.

use nalgebra::{Isometry3, Matrix6, Vector3};

use crate::GraphError;

/// A measured pose of one node as seen from another.
#[derive(Clone, Debug)]
pub struct Link {
    /// Node from which `to` was seen; `None` is the map itself, which makes the link a prior.
    pub from: Option<usize>,
    /// Node that was seen.
    pub to: usize,
    /// Measured `T_from_to`.
    pub T_from_to: Isometry3<f64>,
    /// Inverse covariance of the residual, rotation first, frame of `to`.
    pub information: Matrix6<f64>,
    /// Whether the link is beyond doubt, as neighbours in time are; others may turn out to be false.
    pub trusted: bool,
}

/// The direction of gravity as a node sees it: `‖R_map_node · up − z‖²`, weighted.
#[derive(Clone, Debug)]
pub struct GravityTerm {
    /// Node that saw it.
    pub node: usize,
    /// Unit vector that points up, node frame.
    pub up: Vector3<f64>,
    /// Inverse variance of its direction, rad⁻².
    pub weight: f64,
}

/// Nodes with links between them, and what holds them in the map.
#[derive(Clone, Debug)]
pub struct PoseGraph {
    /// Poses `T_map_node`.
    pub poses: Vec<Isometry3<f64>>,
    /// Whether each pose is final.
    pub fixed: Vec<bool>,
    /// Links between nodes, and priors.
    pub links: Vec<Link>,
    /// What the nodes know of gravity.
    pub gravity: Vec<GravityTerm>,
}

impl PoseGraph {
    /// Checks that every index exists and that every node is held in the map.
    ///
    /// # Errors
    /// When a link or a term names a node that is not there, a link leads from a node to itself, or
    /// a node has no way over links to a fixed one or a prior.
    pub fn check(&self) -> Result<(), GraphError> {
        let n_nodes = self.poses.len();
        if self.fixed.len() != n_nodes {
            let n_fixed = self.fixed.len();
            return Err(GraphError::LengthMismatch { n_nodes, n_fixed });
        }
        for (index, link) in self.links.iter().enumerate() {
            for node in link.from.into_iter().chain([link.to]) {
                if node >= n_nodes {
                    return Err(GraphError::LinkWithoutNode {
                        index,
                        node,
                        n_nodes,
                    });
                }
            }
            if link.from == Some(link.to) {
                let node = link.to;
                return Err(GraphError::SelfLink { index, node });
            }
        }
        for (index, term) in self.gravity.iter().enumerate() {
            if term.node >= n_nodes {
                let node = term.node;
                return Err(GraphError::GravityWithoutNode {
                    index,
                    node,
                    n_nodes,
                });
            }
        }
        let loose = held(self, |_| true).iter().position(|held| !held);
        loose.map_or(Ok(()), |node| Err(GraphError::Loose { node }))
    }
}

/// Whether each node has a way over links, of those with the numbers that `counts`, to a fixed one or
/// a prior.
pub fn held(graph: &PoseGraph, counts: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut held = graph.fixed.clone();
    let mut neighbors = vec![Vec::new(); graph.poses.len()];
    let links = graph.links.iter().enumerate();
    for (_, link) in links.filter(|(index, _)| counts(*index)) {
        match link.from {
            None => held[link.to] = true,
            Some(from) => {
                neighbors[from].push(link.to);
                neighbors[link.to].push(from);
            }
        }
    }
    let mut open: Vec<usize> = (0..held.len()).filter(|&n| held[n]).collect();
    while let Some(node) = open.pop() {
        for &next in &neighbors[node] {
            if !held[next] {
                held[next] = true;
                open.push(next);
            }
        }
    }
    held
}
