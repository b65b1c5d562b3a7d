// SPDX-License-Identifier: MIT OR Apache-2.0
//! What comes out of a global registration.

use bentwing_trajectory::Trajectory;

use super::posterior::GlobalPosterior;
use super::problem::{Counts, Iteration};
use crate::{GlobalMatrix, Globals, Health};

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
    /// How much matches scatter beside what their weights say: their variance over the stated one.
    pub dispersion: f64,
    /// How much there was to do.
    pub counts: Counts,
    /// Whether the last step was below the thresholds.
    pub converged: bool,
    /// The last equations.
    pub posterior: GlobalPosterior,
}
