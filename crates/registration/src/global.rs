// SPDX-License-Identifier: MIT OR Apache-2.0
//! The registration of whole trajectories, each with itself and with the others: the paper's global
//! non-rigid registration (Kaul 2015, section 2.2) on one screen.

mod chunk;
mod gather;
mod joint;
mod link;
mod overlap;
mod piece;

use std::sync::Arc;

use bentwing_surfels::SurfelSet;
use bentwing_trajectory::{Imu, Trajectory};

use crate::solve::{SolveError, Solver};
use crate::step::StepSize;
use crate::{GlobalMatrix, GlobalPrior, Globals, Health, N_GLOBALS, NormalEquations, Settings};
use gather::Gatherer;
use joint::Joint;
use piece::PieceState;

/// A trajectory without a break, with what was measured along it.
pub struct Piece<'a> {
    /// Trajectory to start from.
    pub trajectory: Trajectory,
    /// Surfels of consecutive stretches of some seconds, in order of time, with the same levels.
    pub chunks: &'a [Arc<SurfelSet>],
    /// Inertial samples, less the history of their biases, or none for a lidar alone.
    pub imu: Option<&'a Imu>,
    /// Global states to start from.
    pub globals: Globals,
    /// What is known of them.
    pub prior: &'a GlobalPrior,
}

/// Which stretches are matched with which, and how much is held for it.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Earlier and later visits that a stretch is matched with; as many again may choose it.
    pub n_visits: usize,
    /// Least share of the places of a stretch that another must have seen.
    pub min_overlap: f64,
    /// Stretches that are held as placed in the map.
    pub n_held: usize,
}

/// Input of a global registration.
pub struct GlobalProblem<'a> {
    /// The trajectories, roughly aligned with each other.
    pub pieces: Vec<Piece<'a>>,
    /// What is matched.
    pub plan: Plan,
}

/// What one iteration found, before its step, and did.
#[derive(Clone, Debug)]
pub struct Iteration {
    /// Its matches with the trajectory it began with.
    pub health: Health,
    /// Of them those between stretches that do not follow each other.
    pub n_far: usize,
    /// Largest correction.
    pub step: StepSize,
}

/// How much there was to do.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Unknowns of the normal equations.
    pub n_unknowns: usize,
    /// Pairs of stretches that were matched.
    pub n_links: usize,
    /// Of them pairs that do not follow each other.
    pub n_far_links: usize,
    /// Surfels of all stretches.
    pub n_surfels: usize,
}

/// A corrected trajectory.
#[derive(Clone, Debug)]
pub struct PieceResult {
    /// Corrected trajectory.
    pub trajectory: Trajectory,
    /// Corrected global states.
    pub globals: Globals,
    /// Covariance of the global states; zero where frozen.
    pub covariance: GlobalMatrix,
    /// Samples without inertial data.
    pub n_blind: usize,
}

/// Result of a global registration.
#[derive(Clone, Debug)]
pub struct GlobalRegistration {
    /// The trajectories in the order of the problem.
    pub pieces: Vec<PieceResult>,
    /// What was done, iteration by iteration.
    pub iterations: Vec<Iteration>,
    /// Matches of the final trajectories.
    pub health: Health,
    /// How much there was to do.
    pub counts: Counts,
    /// Whether the last step was below the thresholds.
    pub converged: bool,
}

/// Corrects whole trajectories and their calibrations by everything that was seen more than once.
///
/// # Errors
/// When the normal equations are singular or hold values that are not finite.
pub fn register_globally(
    problem: &GlobalProblem<'_>,
    settings: &Settings,
) -> Result<GlobalRegistration, SolveError> {
    let states = problem.pieces.iter().map(|p| PieceState::new(p, settings));
    let mut states: Vec<PieceState<'_>> = states.collect();
    let joint = Joint::new(&states);
    let mut gatherer = Gatherer::new(problem, &states, settings);
    let (mut solver, mut iterations) = (Solver::default(), Vec::new());
    let (mut step_size, mut last) = (StepSize::UNKNOWN, None);
    while iterations.len() < settings.max_outer && !step_size.converged(settings) {
        let mut equations = NormalEquations::new(joint.n_controls());
        for (number, state) in states.iter_mut().enumerate() {
            joint.add_piece(
                &mut equations,
                number,
                &state.fixed_rows(number == 0, settings),
            );
        }
        let scale = if iterations.is_empty() {
            settings.first_cauchy_scale
        } else {
            settings.cauchy_scale
        };
        if step_size.moves_matches() {
            gatherer.match_again();
        }
        let (health, n_far) = gatherer.add(&mut equations, &joint, &states, scale);
        joint.freeze(&mut equations, &states);
        let factorized = solver.factorize(&equations, 0, &[true; N_GLOBALS])?;
        let steps = joint.split(&factorized.solve());
        step_size = StepSize::NONE;
        for (state, step) in states.iter_mut().zip(&steps) {
            step_size = step_size.max(state.apply(step)?);
        }
        iterations.push(Iteration {
            health,
            n_far,
            step: step_size,
        });
        last = Some(factorized);
    }
    let health = gatherer.health(&states, settings.cauchy_scale);
    let counts = Counts {
        n_unknowns: joint.n_unknowns(&states),
        ..gatherer.counts()
    };
    let covariance = |number: usize| match &last {
        Some(f) => joint.covariance(f, number, &states[number]),
        None => GlobalMatrix::zeros(),
    };
    let covariances: Vec<_> = (0..states.len()).map(covariance).collect();
    let pieces = states.into_iter().zip(covariances);
    Ok(GlobalRegistration {
        pieces: pieces.map(|(s, c)| s.finish(&c)).collect(),
        iterations,
        health,
        counts,
        converged: step_size.converged(settings),
    })
}

#[cfg(test)]
mod tests;
