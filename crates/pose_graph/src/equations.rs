// SPDX-License-Identifier: MIT OR Apache-2.0
//! The normal equations of a pose graph, linearized at its current poses.

use nalgebra::{Isometry3, Matrix6, Vector6};

use crate::GraphError;
use crate::blocks::{BlockMatrix, Structure};
use crate::graph::{Link, PoseGraph};
use crate::terms::{GravityAt, LinkAt, LinkEquations};

/// Pairs of unknowns that links with a weight join.
pub fn structure(graph: &PoseGraph, numbers: &[Option<usize>], weights: &[f64]) -> Structure {
    let pair = |link: &Link| Some((numbers[link.from?]?, numbers[link.to]?));
    let links = graph.links.iter().zip(weights).filter(|(_, w)| **w > 0.0);
    let n_free = numbers.iter().flatten().count();
    Structure::new(n_free, links.filter_map(|(link, _)| pair(link)))
}

/// `rᵀΩr` of each link.
pub fn chi2s(graph: &PoseGraph, poses: &[Isometry3<f64>]) -> Vec<f64> {
    let chi2 = |link| LinkAt::new(link, poses).chi2(link);
    graph.links.iter().map(chi2).collect()
}

/// `½ Σ w rᵀΩr` over links, with `weights` w, and gravity.
///
/// # Errors
/// When it is not finite.
pub fn cost(
    graph: &PoseGraph,
    poses: &[Isometry3<f64>],
    weights: &[f64],
) -> Result<f64, GraphError> {
    let links = graph.links.iter().zip(weights).filter(|(_, w)| **w > 0.0);
    let links: f64 = links.map(|(l, w)| w * LinkAt::new(l, poses).chi2(l)).sum();
    let gravity = graph
        .gravity
        .iter()
        .map(|t| GravityAt::new(t, poses).chi2());
    let cost = 0.5 * (links + gravity.sum::<f64>());
    if cost.is_finite() {
        Ok(cost)
    } else {
        Err(GraphError::NotFinite)
    }
}

/// Of two sets of poses the one that costs less.
///
/// # Errors
/// When a cost is not finite.
pub fn cheaper(
    graph: &PoseGraph,
    given: &[Isometry3<f64>],
    relaxed: Vec<Isometry3<f64>>,
    weights: &[f64],
) -> Result<Vec<Isometry3<f64>>, GraphError> {
    let better = cost(graph, &relaxed, weights)? < cost(graph, given, weights)?;
    Ok(if better { relaxed } else { given.to_vec() })
}

/// `JᵀΩJ` and `JᵀΩr` of all terms.
pub struct Equations<'a> {
    /// The matrix, by unknowns.
    pub matrix: BlockMatrix<'a, 6>,
    /// The gradient, six numbers for each unknown.
    pub gradient: Vec<f64>,
}

impl<'a> Equations<'a> {
    /// All zero.
    pub fn new(structure: &'a Structure) -> Self {
        Self {
            matrix: BlockMatrix::new(structure),
            gradient: vec![0.0; 6 * structure.len()],
        }
    }

    /// Linearizes every term at `poses`.
    pub fn linearize(
        &mut self,
        graph: &PoseGraph,
        numbers: &[Option<usize>],
        poses: &[Isometry3<f64>],
        weights: &[f64],
    ) {
        self.matrix.clear();
        self.gradient.fill(0.0);
        for (link, &weight) in graph.links.iter().zip(weights) {
            if weight > 0.0 {
                let ends = (link.from.and_then(|from| numbers[from]), numbers[link.to]);
                let at = LinkAt::new(link, poses).linearize(link, poses);
                self.add_link(&at, weight, ends);
            }
        }
        for term in &graph.gravity {
            if let Some(number) = numbers[term.node] {
                self.add_gravity(&GravityAt::new(term, poses), number);
            }
        }
    }

    fn add_link(
        &mut self,
        at: &LinkEquations,
        weight: f64,
        (from, to): (Option<usize>, Option<usize>),
    ) {
        if let Some(to) = to {
            self.matrix.add(to, to, &(at.information * weight));
            self.add_gradient(to, &(at.gradient * weight));
        }
        if let Some(from) = from {
            self.matrix
                .add(from, from, &(at.information_of_from() * weight));
            self.add_gradient(from, &(at.gradient_of_from() * weight));
        }
        if let (Some(from), Some(to)) = (from, to) {
            self.matrix
                .add(from, to, &(at.cross_information() * weight));
        }
    }

    fn add_gravity(&mut self, at: &GravityAt, number: usize) {
        let (rotation, pull) = at.equations();
        let (mut information, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
        information
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&rotation);
        gradient.fixed_rows_mut::<3>(0).copy_from(&pull);
        self.matrix.add(number, number, &information);
        self.add_gradient(number, &gradient);
    }

    fn add_gradient(&mut self, number: usize, added: &Vector6<f64>) {
        for (to, from) in self.gradient[6 * number..].iter_mut().zip(added) {
            *to += from;
        }
    }
}
