// SPDX-License-Identifier: MIT OR Apache-2.0
//! What goes into a global registration, and what is counted on the way.

use std::sync::Arc;

use bentwing_surfels::SurfelSet;
use bentwing_trajectory::{Imu, Trajectory};

use crate::constraints::initial;
use crate::constraints::shown_noise::ShownNoise;
use crate::state::State;
use crate::{GlobalPrior, Globals, Health, N_GLOBALS, Settings, StepSize};

/// A trajectory without a break, with what was measured along it.
pub struct Piece<'a> {
    /// Trajectory to start from.
    pub trajectory: Trajectory,
    /// Surfels of consecutive stretches of some seconds, in order of time, with the same levels.
    pub chunks: &'a [Arc<SurfelSet>],
    /// Inertial samples, less the history of their biases, or none for a lidar alone.
    pub imu: Option<&'a Imu>,
    /// How large their noise shows itself: so uncertain the poses are, while the weights stay as stated.
    pub shown_noise: ShownNoise,
    /// Global states to start from.
    pub globals: Globals,
    /// What is known of them.
    pub prior: &'a GlobalPrior,
    /// Those that stay as they are unless the recording shows that they are others.
    pub optional: [bool; N_GLOBALS],
    /// Those that stay as they are but are not known exactly: the others are the less certain for it.
    pub doubted: [bool; N_GLOBALS],
}

impl Piece<'_> {
    /// The piece before the first iteration.
    pub(super) fn state(&self, settings: &Settings) -> State<'_> {
        let mut state = State::new(
            &self.trajectory,
            &self.globals,
            self.prior,
            self.imu,
            settings,
        )
        .resting();
        for (frozen, optional) in state.frozen.iter_mut().zip(self.optional) {
            *frozen |= optional;
        }
        state
    }

    /// How its first pose is held; the map is where the piece that `defines_map` has it.
    pub(super) fn first_pose(&self, defines_map: bool) -> &'static initial::Sigmas {
        match (defines_map, self.imu) {
            (false, _) => &initial::LOOSE,
            (true, Some(_)) => &initial::HELD_BUT_FOR_TILT,
            (true, None) => &initial::HELD,
        }
    }
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
    /// Interval of the knots by which covariances are computed, s.
    pub posterior_interval: f64,
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
