// SPDX-License-Identifier: MIT OR Apache-2.0
//! The registration of whole trajectories, each with itself and with the others: the paper's global
//! non-rigid registration (Kaul 2015, section 2.2) on one screen.

mod bend;
mod chunk;
mod gather;
mod joint;
mod link;
mod overlap;
mod posterior;
mod problem;
mod result;
mod scatter;

use gather::Gatherer;
use joint::Joint;
pub use posterior::GlobalPosterior;
pub use problem::{Counts, GlobalProblem, Iteration, Piece, Plan};
pub use result::{GlobalRegistration, PieceResult};

use crate::state::{State, StepSize};
use crate::{N_GLOBALS, NormalEquations, Settings, SolveError, Solver};

/// Corrects whole trajectories and their calibrations by everything that was seen more than once.
///
/// # Errors
/// When the normal equations are singular or hold values that are not finite.
pub fn register_globally(
    problem: &GlobalProblem<'_>,
    settings: &Settings,
) -> Result<GlobalRegistration, SolveError> {
    for piece in &problem.pieces {
        settings.require_dense(&piece.trajectory)?;
    }
    let states = problem.pieces.iter().map(|p| p.state(settings));
    let mut states: Vec<State<'_>> = states.collect();
    let joint = Joint::new(&states);
    let mut gatherer = Gatherer::new(problem, &states, settings);
    let (mut solver, mut iterations) = (Solver::default(), Vec::new());
    let mut step_size = StepSize::UNKNOWN;
    let factorized = loop {
        let mut equations = NormalEquations::new(joint.n_controls());
        for (number, (state, piece)) in states.iter_mut().zip(&problem.pieces).enumerate() {
            let rows = state.fixed_rows(Some(piece.first_pose(number == 0)), settings);
            joint.add_piece(&mut equations, number, &rows);
        }
        if step_size.moves_matches() {
            gatherer.match_again();
        }
        let scale = settings.cauchy_scale_at(iterations.len());
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
        if step_size.converged(settings) || iterations.len() >= settings.max_outer {
            break factorized;
        }
    };
    let (posterior, health, dispersion) =
        GlobalPosterior::new(problem, &states, &mut gatherer, settings)?;
    let counts = Counts {
        n_unknowns: joint.n_unknowns(&states),
        ..gatherer.counts()
    };
    let finish = |(number, state): (usize, State<'_>)| PieceResult {
        covariance: joint.covariance(&factorized, number, &state),
        trajectory: state.trajectory,
        globals: state.globals,
        n_blind: state.n_blind,
    };
    let pieces = states.into_iter().enumerate().map(finish).collect();
    Ok(GlobalRegistration {
        pieces,
        iterations,
        health,
        dispersion,
        counts,
        converged: step_size.converged(settings),
        posterior,
    })
}

#[cfg(test)]
mod tests;
