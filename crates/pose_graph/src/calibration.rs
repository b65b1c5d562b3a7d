// SPDX-License-Identifier: MIT OR Apache-2.0
//! How far the information of links is right about turns, and how far about shifts.
//!
//! Information matrices are seldom right to a factor, and seldom to the same one for both. Where they
//! trust the turns too much, a residual tells hardly anything of the shift, and false links pass
//! whose shift is off by many of its true standard deviations.

use nalgebra::Isometry3;

use crate::graph::PoseGraph;
use crate::robust::{EXACT, median};
use crate::terms::LinkAt;

/// Links at least that tell it.
const MIN_LINKS: usize = 30;

/// Factor between the variances that changes hardly any verdict.
const MIN_FACTOR: f64 = 4.0;

/// Factor between the variances at most that is made up for: where links are few they are met
/// exactly in what is determined just so.
const MAX_FACTOR: f64 = 1e3;

/// The graph with information about turns and shifts in the proportion that the residuals of the
/// doubtful links among those with `weights` show; none where they are too few.
///
/// The geometric mean of both factors is one, so that gravity and priors keep their part.
pub fn calibrated(
    graph: &PoseGraph,
    poses: &[Isometry3<f64>],
    weights: &[f64],
) -> Option<PoseGraph> {
    let links = graph.links.iter().zip(weights);
    let telling = links.filter(|(l, w)| **w > 0.0 && !l.trusted && l.from.is_some());
    let (turns, shifts): (Vec<f64>, Vec<f64>) = telling
        .map(|(link, _)| LinkAt::new(link, poses).chi2_of_turn_and_shift(link))
        .unzip();
    if turns.len() < MIN_LINKS {
        return None;
    }
    let typical = |values: &[f64]| median(values).map(|m| m.max(EXACT));
    let factor = (typical(&turns)? / typical(&shifts)?).clamp(1.0 / MAX_FACTOR, MAX_FACTOR);
    if (1.0 / MIN_FACTOR..MIN_FACTOR).contains(&factor) {
        return None;
    }
    // Of standard deviations, half of it each.
    let (turn, shift) = (factor.powf(-0.25), factor.powf(0.25));
    let mut graph = graph.clone();
    for link in graph.links.iter_mut().filter(|l| l.from.is_some()) {
        for (part, scale) in [(0, turn), (3, shift)] {
            link.information.fixed_rows_mut::<3>(part).scale_mut(scale);
            link.information
                .fixed_columns_mut::<3>(part)
                .scale_mut(scale);
        }
    }
    Some(graph)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::GraphError;
    use crate::poses::numbered;
    use crate::readmission::believed;
    use crate::testing::{FINELY, ROBUST, helix, noisy_helix, with_false_links};

    /// The graph with variances of turns that are `factor` times too small.
    fn too_sure_of_turns(mut graph: PoseGraph, factor: f64) -> PoseGraph {
        for link in &mut graph.links {
            link.information
                .fixed_rows_mut::<3>(0)
                .scale_mut(factor.sqrt());
            link.information
                .fixed_columns_mut::<3>(0)
                .scale_mut(factor.sqrt());
        }
        graph
    }

    fn proportion(graph: &PoseGraph) -> f64 {
        let information = graph.links[50].information;
        information[(0, 0)] / information[(5, 5)]
    }

    #[test]
    fn what_is_wrong_between_turns_and_shifts_is_made_up_for() -> Result<(), GraphError> {
        let truth = helix(8, 20).poses;
        let right = noisy_helix(8, 20);
        let all = vec![1.0; right.links.len()];
        assert!(calibrated(&right, &truth, &all).is_none());
        let wrong = too_sure_of_turns(right.clone(), 300.0);
        let found = calibrated(&wrong, &truth, &all).ok_or(GraphError::NotFinite)?;
        let factor = proportion(&found) / proportion(&right);
        assert!(factor > 0.5 && factor < 2.0, "{factor}");
        let (before, after) = (wrong.links[50].information, found.links[50].information);
        let product = |m: nalgebra::Matrix6<f64>| m[(0, 0)] * m[(5, 5)];
        assert!((product(after) / product(before) - 1.0).abs() < 1e-9);
        Ok(())
    }

    #[test]
    fn few_links_tell_no_proportion() {
        let wrong = too_sure_of_turns(noisy_helix(2, 20), 300.0);
        let all = vec![1.0; wrong.links.len()];
        assert!(calibrated(&wrong, &helix(2, 20).poses, &all).is_none());
    }

    #[test]
    fn false_links_are_told_where_information_is_too_sure_of_turns() -> Result<(), GraphError> {
        let wrong = too_sure_of_turns(noisy_helix(8, 20), 300.0);
        let n_true = wrong.links.len();
        let graph = with_false_links(wrong, 30);
        let (_, weights) = believed(&graph, &numbered(&graph), FINELY, &ROBUST)?;
        assert!(weights[..n_true].iter().all(|&w| w == 1.0));
        assert!(weights[n_true..].iter().all(|&w| w == 0.0));
        Ok(())
    }
}
