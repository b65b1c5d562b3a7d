// SPDX-License-Identifier: MIT OR Apache-2.0
//! The registration: the paper on one screen.

use std::sync::Arc;

use bentwing_surfels::SurfelSet;
use bentwing_trajectory::{CorrectionSpline, Imu, Trajectory};
use nalgebra::Matrix6;

use crate::constraints::{imu, initial, motion, prior, velocity};
use crate::matches::{self, MatchRows};
use crate::placed::Placed;
use crate::response::{self, PoseResponse};
use crate::solve::{Factorized, Marginals, Solution, SolveError, Solver};
use crate::step::{self, StepSize};
use crate::{
    FixedView, GlobalMatrix, GlobalPrior, GlobalVector, Globals, Health, NormalEquations,
    Posterior, Settings,
};

/// How the start of the trajectory is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Initial {
    /// The first three control points are no unknowns: the corrected trajectory joins the past with
    /// continuous velocity and acceleration.
    Joined,
    /// Only the first pose stays; there is no past.
    FirstPose,
}

/// Input of a registration.
pub struct Problem<'a> {
    /// Prior trajectory.
    pub trajectory: Trajectory,
    /// How its samples follow the calibration so far; only those at the start matter, where it
    /// joins the past. Without any the past stays.
    pub responses: &'a [PoseResponse],
    /// Surfels of the trajectory.
    pub sets: &'a [Arc<SurfelSet>],
    /// Surfels of final poses.
    pub views: &'a [&'a FixedView],
    /// Inertial samples, or none for a lidar alone.
    pub imu: Option<&'a Imu>,
    /// Global states to start from.
    pub globals: Globals,
    /// What is known of them.
    pub prior: &'a GlobalPrior,
    /// How the start is held.
    pub initial: Initial,
}

/// Result of a registration.
#[derive(Clone, Debug)]
pub struct Registration {
    /// Corrected trajectory.
    pub trajectory: Trajectory,
    /// How its samples follow the global states.
    pub responses: Vec<PoseResponse>,
    /// Corrected global states.
    pub globals: Globals,
    /// Covariance of the global states; zero where frozen.
    pub covariance: GlobalMatrix,
    /// Correction that leads from the prior's mean to `globals`.
    pub offset: GlobalVector,
    /// Matches of the last iteration.
    pub health: Health,
    /// Surfels that took part.
    pub n_surfels: usize,
    /// Outer iterations.
    pub n_outer: usize,
    /// Whether the last step was below the thresholds.
    pub converged: bool,
    /// Samples of the trajectory without inertial data.
    pub n_blind: usize,
    /// The last equations, if there was an iteration.
    pub posterior: Option<Posterior>,
}

impl Registration {
    /// Marginal covariance of the correction `[δr, δt]` of each sample; none without an iteration.
    pub fn sample_covariances(&self) -> Vec<Matrix6<f64>> {
        let posterior = self.posterior.as_ref();
        posterior.map_or_else(Vec::new, |p| p.at_samples(&self.trajectory))
    }
}

/// Corrects a trajectory and its calibration (Kaul 2015, section 2.1).
///
/// # Errors
/// When the normal equations are singular or hold values that are not finite.
pub fn register_window(
    problem: &Problem<'_>,
    settings: &Settings,
) -> Result<Registration, SolveError> {
    let mut state = State::new(problem, settings);
    let ties = state.ties(problem);
    let mut solver = Solver::default();
    let (mut step_size, mut n_outer) = (StepSize::UNKNOWN, 0);
    let (mut matches, mut last) = (Vec::new(), None);
    while n_outer < settings.max_outer && !step_size.converged(settings) {
        let placed = Placed::new(
            problem.sets,
            &state.trajectory,
            &state.globals,
            &state.spline,
        );
        if step_size.moves_matches() {
            matches = matches::find(&placed, problem.views, settings);
        }
        let fixed_rows = state.fixed_rows(problem, settings);
        let rows = MatchRows::new(&placed, problem.views, &state.globals, &mut matches);
        let scale = if n_outer == 0 {
            settings.first_cauchy_scale
        } else {
            settings.cauchy_scale
        };
        let mut step = None;
        for _ in 0..settings.n_inner {
            let mut equations = fixed_rows.clone();
            let health = rows.add(&mut equations, step.as_ref(), scale);
            response::tie(&mut equations, &ties);
            let factorized = solver.factorize(&equations, ties.len(), &problem.prior.frozen)?;
            response::complete(step.insert(factorized.solve()), &ties);
            last = Some((factorized, health, placed.surfels.len()));
        }
        if let Some(step) = step {
            step_size = state.apply(&step)?;
        }
        n_outer += 1;
    }
    Ok(state.finish(last, ties, n_outer, step_size.converged(settings)))
}

/// The normal equations of the first iteration, for those who study how to solve them.
pub fn first_equations(problem: &Problem<'_>, settings: &Settings) -> NormalEquations {
    let mut state = State::new(problem, settings);
    let (trajectory, globals) = (&state.trajectory, &state.globals);
    let placed = Placed::new(problem.sets, trajectory, globals, &state.spline);
    let mut matches = matches::find(&placed, problem.views, settings);
    let mut equations = state.fixed_rows(problem, settings);
    let rows = MatchRows::new(&placed, problem.views, &state.globals, &mut matches);
    rows.add(&mut equations, None, settings.first_cauchy_scale);
    equations
}

/// What changes from iteration to iteration.
struct State {
    trajectory: Trajectory,
    globals: Globals,
    spline: CorrectionSpline,
    /// How far the global states have come from the prior's mean.
    moved: GlobalVector,
    n_blind: usize,
}

impl State {
    fn new(problem: &Problem<'_>, settings: &Settings) -> Self {
        let trajectory = problem.trajectory.clone();
        let (start, end) = (trajectory.start(), trajectory.end());
        Self {
            spline: CorrectionSpline::covering(start, end, settings.knot_interval),
            trajectory,
            globals: problem.globals.clone(),
            moved: problem.prior.offset,
            n_blind: 0,
        }
    }

    /// How the control points that join the past follow the calibration.
    fn ties(&self, problem: &Problem<'_>) -> Vec<PoseResponse> {
        match problem.initial {
            Initial::FirstPose => Vec::new(),
            Initial::Joined => {
                response::joined(problem.responses, &self.trajectory, &self.spline).to_vec()
            }
        }
    }

    /// The rows whose weights do not change in the inner iterations.
    fn fixed_rows(&mut self, problem: &Problem<'_>, settings: &Settings) -> NormalEquations {
        let mut equations = NormalEquations::new(self.spline.n_controls());
        velocity::add(&mut equations, &self.spline, settings);
        prior::add(&mut equations, &problem.prior.information, &self.moved);
        if problem.initial == Initial::FirstPose {
            let start = self.trajectory.start();
            initial::add(&mut equations, &self.spline, start, &initial::HELD);
        }
        match problem.imu {
            Some(samples) => {
                let noise = &settings.imu_noise;
                let (t, g, s) = (&self.trajectory, &self.globals, &self.spline);
                self.n_blind = imu::add(&mut equations, t, samples, g, s, noise);
            }
            None => motion::add(&mut equations, &self.trajectory, &self.spline, settings),
        }
        equations
    }

    /// Composes a step into the state; returns how large it was.
    fn apply(&mut self, step: &Solution) -> Result<StepSize, SolveError> {
        let (trajectory, globals) = (&mut self.trajectory, &mut self.globals);
        let size = step::compose(step, trajectory, globals, &self.spline)?;
        for (m, d) in self.moved.iter_mut().zip(step.globals) {
            *m += d;
        }
        Ok(size)
    }

    fn finish(
        self,
        last: Option<(Factorized, Health, usize)>,
        ties: Vec<PoseResponse>,
        n_outer: usize,
        converged: bool,
    ) -> Registration {
        let (marginals, health, n_surfels, factorized) = match last {
            Some((f, health, n)) => (f.marginals(&ties), health, n, Some(f)),
            None => (
                Marginals::unknown(self.spline.n_controls()),
                Health::default(),
                0,
                None,
            ),
        };
        let posterior = factorized.map(|factorized| Posterior {
            factorized,
            ties,
            spline: self.spline,
        });
        Registration {
            responses: response::at_samples(&marginals.responses, &self.trajectory, &self.spline),
            trajectory: self.trajectory,
            globals: self.globals,
            covariance: marginals.covariance,
            offset: self.moved,
            health,
            n_surfels,
            n_outer,
            converged,
            n_blind: self.n_blind,
            posterior,
        }
    }
}
