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
mod shown;

use gather::Gatherer;
use joint::Joint;
pub use posterior::GlobalPosterior;
pub use problem::{Counts, GlobalProblem, Iteration, Piece, Plan};
pub use result::{GlobalRegistration, PieceResult};

use crate::state::{State, StepSize};
use crate::{Health, N_GLOBALS, NormalEquations, Settings, SolveError, Solver};

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
    let states: Vec<State<'_>> = states.collect();
    let mut rounds = Rounds {
        problem,
        settings: settings.clone(),
        joint: Joint::new(&states),
        gatherer: Gatherer::new(problem, &states, settings),
        states,
        iterations: Vec::new(),
    };
    let settled = rounds.settle(StepSize::UNKNOWN)?;
    let converged = rounds.with_what_shows(settled)?;
    let Rounds {
        joint,
        mut gatherer,
        states,
        iterations,
        ..
    } = rounds;
    let (posterior, health, dispersion) =
        GlobalPosterior::new(problem, &states, &mut gatherer, settings)?;
    let counts = Counts {
        n_unknowns: joint.n_unknowns(&states),
        ..gatherer.counts()
    };
    let finish = |(number, state): (usize, State<'_>)| PieceResult {
        covariance: posterior.globals(number),
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
        converged,
        posterior,
    })
}

/// What the iterations of a registration work with.
struct Rounds<'a> {
    problem: &'a GlobalProblem<'a>,
    settings: Settings,
    joint: Joint,
    gatherer: Gatherer,
    states: Vec<State<'a>>,
    iterations: Vec<Iteration>,
}

impl Rounds<'_> {
    /// Iterates until nothing moves any more, or as often as it is allowed to; tells which.
    fn settle(&mut self, mut step_size: StepSize) -> Result<bool, SolveError> {
        let mut solver = Solver::default();
        let last = self.iterations.len() + self.settings.max_outer;
        loop {
            if step_size.moves_matches() {
                self.gatherer.match_again();
            }
            let (mut equations, health, n_far) = self.equations();
            self.joint.freeze(&mut equations, &self.states);
            let factorized = solver.factorize(&equations, 0, &[true; N_GLOBALS])?;
            let steps = self.joint.split(&factorized.solve());
            step_size = StepSize::NONE;
            for (state, step) in self.states.iter_mut().zip(&steps) {
                step_size = step_size.max(state.apply(step)?);
            }
            self.iterations.push(Iteration {
                health,
                n_far,
                step: step_size,
            });
            let converged = step_size.converged(&self.settings);
            if converged || self.iterations.len() >= last {
                return Ok(converged);
            }
        }
    }

    /// Goes on with those of the optional states that show, unless it does not settle with them; tells
    /// whether it has settled.
    fn with_what_shows(&mut self, settled: bool) -> Result<bool, SolveError> {
        let mut pieces = self.problem.pieces.iter();
        let is_asked = pieces.any(|p| p.optional.contains(&true));
        if !is_asked || !settled {
            return Ok(settled);
        }
        let (without, n_before) = (self.states.clone(), self.iterations.len());
        let (equations, ..) = self.equations();
        if !shown::release(equations, &self.joint, &mut self.states)? {
            return Ok(settled);
        }
        // What is wrong with them has moved the poses as fast as the windows could follow.
        let interval = self.settings.knot_interval;
        self.use_knots(self.problem.plan.posterior_interval.min(interval));
        if self.settle(StepSize::NONE)? {
            return Ok(true);
        }
        self.states = without;
        self.use_knots(interval);
        self.iterations.truncate(n_before);
        self.gatherer.match_again();
        Ok(settled)
    }

    /// Takes the states as they are with knots at another interval, s.
    fn use_knots(&mut self, interval: f64) {
        self.settings.knot_interval = interval;
        let states = self.states.iter().map(|s| s.with_knots(interval));
        self.states = states.collect();
        self.joint = Joint::new(&self.states);
    }

    /// All rows at the present states, how the matches fit, and how many are far ones.
    fn equations(&mut self) -> (NormalEquations, Health, usize) {
        let mut equations = NormalEquations::new(self.joint.n_controls());
        let pieces = self.states.iter_mut().zip(&self.problem.pieces);
        for (number, (state, piece)) in pieces.enumerate() {
            let rows = state.fixed_rows(Some(piece.first_pose(number == 0)), &self.settings);
            self.joint.add_piece(&mut equations, number, &rows);
        }
        let scale = self.settings.cauchy_scale_at(self.iterations.len());
        let (health, n_far) = self
            .gatherer
            .add(&mut equations, &self.joint, &self.states, scale);
        (equations, health, n_far)
    }
}

#[cfg(test)]
mod tests;
