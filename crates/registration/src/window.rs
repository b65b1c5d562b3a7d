// SPDX-License-Identifier: MIT OR Apache-2.0
//! The registration: the paper on one screen.

mod fixed_view;
mod imu_fit;
mod matches;
mod posterior;

use std::sync::Arc;

use bentwing_surfels::SurfelSet;
use bentwing_trajectory::{CorrectionSpline, Imu, Trajectory};
use nalgebra::Matrix6;

pub use fixed_view::FixedView;
pub use imu_fit::{Fit, ImuFit};
use matches::MatchRows;
pub use posterior::Posterior;

use crate::constraints::initial;
use crate::state::{State, StepSize};
use crate::system::response;
use crate::system::solve::Factorized;
use crate::{
    GlobalMatrix, GlobalPrior, GlobalVector, Globals, Health, NormalEquations, PoseResponse,
    Settings, Solution, SolveError, Solver,
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
    /// How well the trajectory agrees with the IMU.
    pub imu_fit: ImuFit,
    /// The last equations.
    pub posterior: Posterior,
}

impl Registration {
    /// Marginal covariance of the correction `[δr, δt]` of each sample.
    pub fn sample_covariances(&self) -> Vec<Matrix6<f64>> {
        self.posterior.at_samples(&self.trajectory)
    }
}

impl Problem<'_> {
    fn state(&self, settings: &Settings) -> State<'_> {
        State::new(
            &self.trajectory,
            &self.globals,
            self.prior,
            self.imu,
            settings,
        )
    }

    /// How the first pose is held, if it is an unknown.
    fn first_pose(&self) -> Option<&'static initial::Sigmas> {
        (self.initial == Initial::FirstPose).then_some(&initial::HELD)
    }

    /// How the control points that join the past follow the calibration.
    fn ties(&self, spline: &CorrectionSpline) -> Vec<PoseResponse> {
        match self.initial {
            Initial::FirstPose => Vec::new(),
            Initial::Joined => response::joined(self.responses, &self.trajectory, spline).to_vec(),
        }
    }
}

/// Corrects a trajectory and its calibration (Kaul 2015, section 2.1).
///
/// # Errors
/// When the samples are too sparse for the knots, or the normal equations are singular or hold values
/// that are not finite.
pub fn register_window(
    problem: &Problem<'_>,
    settings: &Settings,
) -> Result<Registration, SolveError> {
    settings.require_dense(&problem.trajectory)?;
    let mut state = problem.state(settings);
    let ties = problem.ties(&state.spline);
    let (mut solver, mut matches) = (Solver::default(), Vec::new());
    let (mut step_size, mut n_outer) = (StepSize::UNKNOWN, 0);
    loop {
        let placed = state.place(problem.sets);
        if step_size.moves_matches() {
            matches = matches::find(&placed, problem.views, settings);
        }
        let weighing = Weighing {
            fixed_rows: state.fixed_rows(problem.first_pose(), settings),
            matches: MatchRows::new(&placed, problem.views, &state.globals, &mut matches),
            scale: settings.cauchy_scale_at(n_outer),
            n_inner: settings.n_inner,
        };
        let last = weighing.solve(&mut solver, &ties, problem.prior)?;
        step_size = state.apply(&last.step)?;
        n_outer += 1;
        let converged = step_size.converged(settings);
        if converged || n_outer >= settings.max_outer {
            let n_surfels = placed.surfels.len();
            return Ok(last.result(state, settings, ties, n_surfels, n_outer, converged));
        }
    }
}

/// The normal equations of the first iteration, for those who study how to solve them.
pub fn first_equations(problem: &Problem<'_>, settings: &Settings) -> NormalEquations {
    let mut state = problem.state(settings);
    let placed = state.place(problem.sets);
    let mut matches = matches::find(&placed, problem.views, settings);
    let mut equations = state.fixed_rows(problem.first_pose(), settings);
    let rows = MatchRows::new(&placed, problem.views, &state.globals, &mut matches);
    rows.add(&mut equations, None, settings.cauchy_scale_at(0));
    equations
}

/// An outer iteration: rows that stay while the matches are weighed.
struct Weighing<'a> {
    fixed_rows: NormalEquations,
    matches: MatchRows<'a>,
    scale: f64,
    n_inner: usize,
}

impl Weighing<'_> {
    /// Weighs the matches by what the last solution leaves of them, and solves; several times.
    fn solve(
        &self,
        solver: &mut Solver,
        ties: &[PoseResponse],
        prior: &GlobalPrior,
    ) -> Result<Solved, SolveError> {
        let mut solved: Option<Solved> = None;
        for _ in 1..self.n_inner {
            solved = Some(self.solve_once(solved.as_ref(), solver, ties, prior)?);
        }
        self.solve_once(solved.as_ref(), solver, ties, prior)
    }

    fn solve_once(
        &self,
        before: Option<&Solved>,
        solver: &mut Solver,
        ties: &[PoseResponse],
        prior: &GlobalPrior,
    ) -> Result<Solved, SolveError> {
        let mut equations = self.fixed_rows.clone();
        let step = before.map(|s| &s.step);
        let health = self.matches.add(&mut equations, step, self.scale);
        response::tie(&mut equations, ties);
        let factorized = solver.factorize(&equations, ties.len(), &prior.frozen)?;
        let mut step = factorized.solve();
        step.complete(ties);
        Ok(Solved {
            factorized,
            step,
            health,
        })
    }
}

/// What an inner iteration found.
struct Solved {
    factorized: Factorized,
    step: Solution,
    health: Health,
}

impl Solved {
    fn result(
        self,
        state: State<'_>,
        settings: &Settings,
        ties: Vec<PoseResponse>,
        n_surfels: usize,
        n_outer: usize,
        converged: bool,
    ) -> Registration {
        let marginals = self.factorized.marginals(&ties);
        let solved = imu_fit::Solved {
            trajectory: &state.trajectory,
            globals: &state.globals,
            spline: &state.spline,
            factorized: &self.factorized,
            ties: &ties,
        };
        let imu_fit = state
            .imu
            .map(|imu| solved.imu_fit(imu, &settings.imu_noise));
        Registration {
            responses: response::at_samples(&marginals.responses, &state.trajectory, &state.spline),
            trajectory: state.trajectory,
            globals: state.globals,
            covariance: marginals.covariance,
            offset: state.moved,
            health: self.health,
            n_surfels,
            n_outer,
            converged,
            n_blind: state.n_blind,
            imu_fit: imu_fit.unwrap_or_default(),
            posterior: Posterior {
                factorized: self.factorized,
                ties,
                spline: state.spline,
            },
        }
    }
}
