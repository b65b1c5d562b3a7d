// SPDX-License-Identifier: MIT OR Apache-2.0
//! The whole solution: a start, the minimum, and the links that have no part in it.

use nalgebra::Isometry3;

use crate::GraphError;
use crate::chordal::Relaxation;
use crate::dogleg::{Minimizer, Minimum, Stop};
use crate::equations::{cheaper, chi2s, cost, structure};
use crate::graph::PoseGraph;
use crate::poses::numbered;
use crate::readmission;
use crate::robust::Robust;

/// How a graph is solved.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Iterations of a minimization at most.
    pub max_iterations: usize,
    /// Share of the cost that another step must promise to take away.
    pub min_relative_decrease: f64,
    /// How false links are told; `None` believes all of them.
    pub robust: Option<Robust>,
}

/// The best poses.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Poses `T_map_node`.
    pub poses: Vec<Isometry3<f64>>,
    /// `½ Σ w rᵀΩr` over links and gravity.
    pub cost: f64,
    /// The same at the given poses, with all links.
    pub initial_cost: f64,
    /// Weight of each link: 1 believed, 0 rejected.
    pub weights: Vec<f64>,
    /// `rᵀΩr` of each link, rejected or not.
    pub chi2: Vec<f64>,
    /// Linearizations in all.
    pub n_iterations: usize,
    /// Whether the last step promised too little to go on.
    pub converged: bool,
}

/// Finds the poses that agree best with the links, and the links that do not agree.
///
/// # Errors
/// When an index does not exist, the links (without those that are false) do not determine all
/// poses, or a number is not finite.
pub fn solve(graph: &PoseGraph, settings: &Settings) -> Result<Solution, GraphError> {
    graph.check()?;
    let numbers = numbered(graph);
    let all = vec![1.0; graph.links.len()];
    let initial_cost = cost(graph, &graph.poses, &all)?;
    let (minimum, weights) =
        minimum(graph, &numbers, all, settings).map_err(|e| named(e, &numbers))?;
    Ok(Solution {
        chi2: chi2s(graph, &minimum.poses),
        poses: minimum.poses,
        cost: minimum.cost,
        initial_cost,
        weights,
        n_iterations: minimum.n_iterations,
        converged: minimum.converged,
    })
}

fn minimum(
    graph: &PoseGraph,
    numbers: &[Option<usize>],
    all: Vec<f64>,
    settings: &Settings,
) -> Result<(Minimum, Vec<f64>), GraphError> {
    let stop = Stop {
        max_iterations: settings.max_iterations,
        min_relative_decrease: settings.min_relative_decrease,
    };
    if let Some(robust) = &settings.robust {
        return readmission::believed(graph, numbers, stop, robust);
    }
    let every = structure(graph, numbers, &all);
    let mut minimizer = Minimizer::new(graph, numbers, &every)?;
    let relaxed = Relaxation::new(graph, numbers, &every)?.poses(&all)?;
    let start = cheaper(graph, &graph.poses, relaxed, &all)?;
    Ok((minimizer.minimize(start, &all, stop)?, all))
}

/// The error with the node of the unknown that the factorization named.
fn named(error: GraphError, numbers: &[Option<usize>]) -> GraphError {
    let GraphError::Singular { node: unknown } = error else {
        return error;
    };
    let node = numbers.iter().position(|&n| n == Some(unknown));
    GraphError::Singular {
        node: node.unwrap_or(unknown),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::{GravityTerm, Link};
    use crate::testing::{ROBUST, drifted, farthest, helix, noisy_helix, with_false_links};
    use bentwing_trajectory::so3;
    use nalgebra::{Matrix6, Vector3, Vector6};

    fn settings(robust: Option<Robust>) -> Settings {
        Settings {
            max_iterations: 50,
            min_relative_decrease: 1e-9,
            robust,
        }
    }

    /// The true graph, and the same with noisy measurements and poses that have drifted.
    fn noisy() -> (PoseGraph, PoseGraph) {
        let truth = helix(8, 20);
        let mut graph = noisy_helix(8, 20);
        graph.poses = drifted(&graph, &Vector3::new(0.002, 0.001, 0.02));
        (truth, graph)
    }

    #[test]
    fn drift_is_undone_to_what_the_noise_of_the_links_allows() -> Result<(), GraphError> {
        let (truth, graph) = noisy();
        assert!(farthest(&graph.poses, &truth.poses) > 1.0);
        let solution = solve(&graph, &settings(None))?;
        assert!(solution.converged && solution.cost < 1e-3 * solution.initial_cost);
        assert!(farthest(&solution.poses, &truth.poses) < 0.1);
        Ok(())
    }

    #[test]
    fn at_the_minimum_no_pose_can_be_moved_to_lower_the_cost() -> Result<(), GraphError> {
        let (_, graph) = noisy();
        let solution = solve(&graph, &settings(None))?;
        let weights = vec![1.0; graph.links.len()];
        for unknown in 0..6 {
            for size in [-1e-4, 1e-4] {
                let mut delta = Vector6::zeros();
                delta[unknown] = size;
                let mut poses = solution.poses.clone();
                poses[70] = crate::testing::corrected(&poses[70], &delta);
                assert!(cost(&graph, &poses, &weights)? > solution.cost);
            }
        }
        Ok(())
    }

    #[test]
    fn every_false_link_is_rejected_and_no_true_one() -> Result<(), GraphError> {
        let (_, graph) = noisy();
        let clean = solve(&graph, &settings(Some(ROBUST)))?;
        let n_true = graph.links.len();
        assert!(clean.weights.iter().all(|&w| w == 1.0));
        let solution = solve(&with_false_links(graph, 30), &settings(Some(ROBUST)))?;
        assert!(solution.weights[..n_true].iter().all(|&w| w == 1.0));
        assert!(solution.weights[n_true..].iter().all(|&w| w == 0.0));
        assert!(farthest(&solution.poses, &clean.poses) < 1e-4);
        Ok(())
    }

    #[test]
    fn gravity_levels_a_graph_that_a_soft_prior_holds_askew() -> Result<(), GraphError> {
        let truth = helix(2, 10);
        let mut graph = truth.clone();
        let tilt = Isometry3::from_parts(
            Vector3::zeros().into(),
            so3::exp(&Vector3::new(0.2, 0.0, 0.0)),
        );
        graph.fixed.fill(false);
        for pose in &mut graph.poses {
            *pose = tilt * *pose;
        }
        graph.links.push(Link {
            from: None,
            to: 0,
            T_from_to: graph.poses[0],
            information: Matrix6::identity(),
            trusted: true,
        });
        let term = |node: usize| GravityTerm {
            node,
            up: truth.poses[node].rotation.inverse() * Vector3::z(),
            weight: 1e6,
        };
        graph.gravity = (0..20).map(term).collect();
        let solution = solve(&graph, &settings(None))?;
        for (pose, term) in solution.poses.iter().zip(&graph.gravity) {
            assert!((pose.rotation * term.up - Vector3::z()).norm() < 1e-5);
        }
        Ok(())
    }

    #[test]
    fn exact_links_end_at_zero_and_not_in_rounding() -> Result<(), GraphError> {
        let truth = helix(3, 12);
        let mut graph = truth.clone();
        graph.poses = drifted(&graph, &Vector3::new(0.0, 0.0, 0.01));
        let solution = solve(&graph, &settings(Some(ROBUST)))?;
        assert!(solution.converged && solution.cost < 1e-12);
        assert!(farthest(&solution.poses, &truth.poses) < 1e-7);
        Ok(())
    }

    #[test]
    fn what_nothing_holds_is_named() {
        let mut graph = helix(2, 6);
        graph.fixed[0] = false;
        let error = solve(&graph, &settings(None));
        assert_eq!(error.err(), Some(GraphError::Loose { node: 0 }));
        let mut graph = helix(2, 6);
        graph.links.retain(|link| link.to != 11);
        let error = solve(&graph, &settings(None));
        assert_eq!(error.err(), Some(GraphError::Loose { node: 11 }));
        let mut graph = helix(2, 6);
        graph.links[3].information.fill(0.0);
        graph.links.truncate(11);
        let error = solve(&graph, &settings(None));
        assert!(matches!(error, Err(GraphError::Singular { node: 4.. })));
    }

    #[test]
    fn indices_that_do_not_exist_are_refused() {
        let mut graph = helix(1, 5);
        graph.links[2].to = 5;
        let expected = GraphError::LinkWithoutNode {
            index: 2,
            node: 5,
            n_nodes: 5,
        };
        assert_eq!(solve(&graph, &settings(None)).err(), Some(expected));
    }
}
