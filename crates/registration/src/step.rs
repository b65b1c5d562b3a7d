// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a solution changes, and how much.

use bentwing_trajectory::{CorrectionSpline, Trajectory};
use nalgebra::Vector3;

use crate::solve::{Solution, SolveError};
use crate::{Globals, Settings};

/// Largest correction of a sample in one step, rad and m.
#[derive(Clone, Copy, Debug)]
pub struct StepSize {
    /// Rotation, rad.
    pub turn: f64,
    /// Translation, m.
    pub shift: f64,
}

impl StepSize {
    /// Of the step before the first one.
    pub(crate) const UNKNOWN: Self = Self {
        turn: f64::INFINITY,
        shift: f64::INFINITY,
    };

    pub(crate) const NONE: Self = Self {
        turn: 0.0,
        shift: 0.0,
    };

    pub(crate) fn converged(self, settings: &Settings) -> bool {
        self.turn < settings.min_rotation && self.shift < settings.min_translation
    }

    /// Whether nearest neighbours may be others now; a fortieth of the finest voxel changes few.
    pub(crate) fn moves_matches(self) -> bool {
        self.shift > 0.01 || self.turn > 1e-3
    }

    /// The larger of both.
    pub(crate) fn max(self, other: Self) -> Self {
        Self {
            turn: self.turn.max(other.turn),
            shift: self.shift.max(other.shift),
        }
    }
}

/// Composes a step into a trajectory and its calibration (Kaul 2015, eq. 3); returns how large it was.
///
/// # Errors
/// When the step is not finite.
pub(crate) fn compose(
    step: &Solution,
    trajectory: &mut Trajectory,
    globals: &mut Globals,
    spline: &CorrectionSpline,
) -> Result<StepSize, SolveError> {
    let finite = |v: &[f64]| v.iter().all(|x| x.is_finite());
    if !finite(&step.globals) || !step.knots.iter().all(|k| finite(k)) {
        return Err(SolveError::NotFinite);
    }
    let mut size = StepSize::NONE;
    let mut corrections = Vec::with_capacity(trajectory.len());
    for n in 0..trajectory.len() {
        let d = spline.evaluate(&step.knots, trajectory.time(n));
        let correction = [
            Vector3::new(d[0], d[1], d[2]),
            Vector3::new(d[3], d[4], d[5]),
        ];
        size = size.max(StepSize {
            turn: correction[0].norm(),
            shift: correction[1].norm(),
        });
        corrections.push(correction);
    }
    trajectory.correct(&corrections);
    globals.correct(&step.globals);
    Ok(size)
}
