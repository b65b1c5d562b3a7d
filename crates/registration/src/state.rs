// SPDX-License-Identifier: MIT OR Apache-2.0
//! A trajectory while it is being corrected, and the rows that concern it alone.

use std::ops::Range;
use std::sync::Arc;

use bentwing_surfels::SurfelSet;
use bentwing_trajectory::{CorrectionSpline, Imu, Trajectory};
use nalgebra::Vector3;

use crate::constraints::shown_noise::ShownNoise;
use crate::constraints::{imu, initial, motion, prior, rest, velocity};
use crate::placed::Placed;
use crate::{
    GlobalPrior, GlobalVector, Globals, N_GLOBALS, NormalEquations, Settings, Solution, SolveError,
};

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

    fn of([a, b, c, x, y, z]: [f64; 6]) -> Self {
        Self {
            turn: Vector3::new(a, b, c).norm(),
            shift: Vector3::new(x, y, z).norm(),
        }
    }

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

/// What changes from iteration to iteration, and what it is held by.
#[derive(Clone)]
pub(crate) struct State<'a> {
    pub prior: &'a GlobalPrior,
    /// Global states that are not estimated, of all and not only of those that never are.
    pub frozen: [bool; N_GLOBALS],
    pub imu: Option<&'a Imu>,
    /// Samples that rest.
    rests: Vec<Range<usize>>,
    pub trajectory: Trajectory,
    pub globals: Globals,
    pub spline: CorrectionSpline,
    /// How far the global states have come from the prior's mean.
    pub moved: GlobalVector,
    pub n_blind: usize,
}

impl<'a> State<'a> {
    pub fn new(
        trajectory: &Trajectory,
        globals: &Globals,
        prior: &'a GlobalPrior,
        imu: Option<&'a Imu>,
        settings: &Settings,
    ) -> Self {
        let (start, end) = (trajectory.start(), trajectory.end());
        Self {
            prior,
            frozen: prior.frozen,
            imu,
            rests: Vec::new(),
            trajectory: trajectory.clone(),
            globals: globals.clone(),
            spline: CorrectionSpline::covering(start, end, settings.knot_interval),
            moved: prior.offset,
            n_blind: 0,
        }
    }

    /// The same state with knots at another interval, s.
    pub fn with_knots(&self, interval: f64) -> Self {
        let (start, end) = (self.trajectory.start(), self.trajectory.end());
        Self {
            rests: self.rests.clone(),
            trajectory: self.trajectory.clone(),
            globals: self.globals.clone(),
            spline: CorrectionSpline::covering(start, end, interval),
            ..*self
        }
    }

    /// The same; where the trajectory rests it goes on resting.
    pub fn resting(self) -> Self {
        Self {
            rests: rest::stretches(&self.trajectory),
            ..self
        }
    }

    /// Places the surfels of `sets`, which have the same levels.
    pub fn place(&self, sets: &[Arc<SurfelSet>]) -> Placed {
        Placed::new(sets, &self.trajectory, &self.globals, &self.spline)
    }

    /// All rows but those of matches; the first pose is held by `first`, if it is an unknown.
    pub fn fixed_rows(
        &mut self,
        first: Option<&initial::Sigmas>,
        settings: &Settings,
    ) -> NormalEquations {
        self.noisy_rows(first, settings, &ShownNoise::default())
    }

    /// The same, those of the IMU with the variance that their residuals show; their weights stay.
    pub fn noisy_rows(
        &mut self,
        first: Option<&initial::Sigmas>,
        settings: &Settings,
        shown: &ShownNoise,
    ) -> NormalEquations {
        let mut equations = NormalEquations::new(self.spline.n_controls());
        let (trajectory, spline) = (&self.trajectory, &self.spline);
        velocity::add(&mut equations, spline, settings);
        prior::add(&mut equations, &self.prior.information, &self.moved);
        if let Some(sigmas) = first {
            initial::add(&mut equations, spline, trajectory.start(), sigmas);
        }
        rest::add(&mut equations, trajectory, spline, &self.rests);
        match self.imu {
            Some(samples) => {
                let (g, noise) = (&self.globals, &settings.imu_noise);
                self.n_blind =
                    imu::add(&mut equations, trajectory, samples, g, spline, noise, shown);
            }
            None => motion::add(&mut equations, trajectory, spline, settings),
        }
        equations
    }

    /// Composes a step into trajectory and calibration (Kaul 2015, eq. 3); returns how large it was.
    ///
    /// # Errors
    /// When the step is not finite.
    pub fn apply(&mut self, step: &Solution) -> Result<StepSize, SolveError> {
        let finite = |v: &[f64]| v.iter().all(|x| x.is_finite());
        if !finite(&step.globals) || !step.knots.iter().all(|k| finite(k)) {
            return Err(SolveError::NotFinite);
        }
        let times = (0..self.trajectory.len()).map(|n| self.trajectory.time(n));
        let corrections: Vec<_> = times
            .map(|t| self.spline.evaluate(&step.knots, t))
            .collect();
        self.trajectory.correct(&corrections);
        self.globals.correct(&step.globals);
        for (m, d) in self.moved.iter_mut().zip(step.globals) {
            *m += d;
        }
        let sizes = corrections.into_iter().map(StepSize::of);
        Ok(sizes.fold(StepSize::NONE, StepSize::max))
    }
}
