// SPDX-License-Identifier: MIT OR Apache-2.0
//! A trajectory while it is being corrected, and the rows that concern it alone.

use std::ops::Range;

use bentwing_trajectory::{CorrectionSpline, Trajectory};

use super::{Piece, PieceResult};
use crate::constraints::{imu, initial, motion, prior, rest, velocity};
use crate::solve::{Solution, SolveError};
use crate::step::{self, StepSize};
use crate::{GlobalMatrix, GlobalVector, Globals, N_GLOBALS, NormalEquations, Settings};

/// What changes of a piece from iteration to iteration.
pub struct PieceState<'a> {
    piece: &'a Piece<'a>,
    pub trajectory: Trajectory,
    pub globals: Globals,
    pub spline: CorrectionSpline,
    /// How far the global states have come from the prior's mean.
    moved: GlobalVector,
    /// Samples that rest.
    rests: Vec<Range<usize>>,
    n_blind: usize,
}

impl<'a> PieceState<'a> {
    pub fn new(piece: &'a Piece<'a>, settings: &Settings) -> Self {
        let trajectory = piece.trajectory.clone();
        let (start, end) = (trajectory.start(), trajectory.end());
        Self {
            spline: CorrectionSpline::covering(start, end, settings.knot_interval),
            rests: rest::stretches(&trajectory),
            trajectory,
            globals: piece.globals.clone(),
            moved: piece.prior.offset,
            n_blind: 0,
            piece,
        }
    }

    pub fn frozen(&self) -> &[bool; N_GLOBALS] {
        &self.piece.prior.frozen
    }

    /// All rows but those of matches; the map is where the piece that `defines_map` has it.
    pub fn fixed_rows(&mut self, defines_map: bool, settings: &Settings) -> NormalEquations {
        let mut equations = NormalEquations::new(self.spline.n_controls());
        let (trajectory, spline) = (&self.trajectory, &self.spline);
        velocity::add(&mut equations, spline, settings);
        prior::add(&mut equations, &self.piece.prior.information, &self.moved);
        let sigmas = match (defines_map, self.piece.imu) {
            (false, _) => &initial::LOOSE,
            (true, Some(_)) => &initial::HELD_BUT_FOR_TILT,
            (true, None) => &initial::HELD,
        };
        initial::add(&mut equations, spline, trajectory.start(), sigmas);
        rest::add(&mut equations, trajectory, spline, &self.rests);
        match self.piece.imu {
            Some(samples) => {
                let (g, noise) = (&self.globals, &settings.imu_noise);
                self.n_blind = imu::add(&mut equations, trajectory, samples, g, spline, noise);
            }
            None => motion::add(&mut equations, trajectory, spline, settings),
        }
        equations
    }

    /// Composes a step into the state; returns how large it was.
    pub fn apply(&mut self, step: &Solution) -> Result<StepSize, SolveError> {
        let (trajectory, globals) = (&mut self.trajectory, &mut self.globals);
        let size = step::compose(step, trajectory, globals, &self.spline)?;
        for (m, d) in self.moved.iter_mut().zip(step.globals) {
            *m += d;
        }
        Ok(size)
    }

    pub fn finish(self, covariance: &GlobalMatrix) -> PieceResult {
        PieceResult {
            trajectory: self.trajectory,
            globals: self.globals,
            covariance: *covariance,
            n_blind: self.n_blind,
        }
    }
}
