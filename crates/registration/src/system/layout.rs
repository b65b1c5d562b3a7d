// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which unknown of the normal equations is which.

use faer::Mat;

use super::error::SolveError;
use super::normal_equations::NormalEquations;
use crate::globals::{N_GLOBALS, index};

/// Numbers the unknowns that are estimated: free control points first, then active globals.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout {
    pub(super) n_clamped: usize,
    pub(super) n_controls: usize,
    pub(super) active: Vec<usize>,
}

impl Layout {
    pub(super) fn new(n_controls: usize, n_clamped: usize, frozen: &[bool; N_GLOBALS]) -> Self {
        Self {
            n_clamped,
            n_controls,
            active: (0..N_GLOBALS).filter(|&g| !frozen[g]).collect(),
        }
    }

    pub(super) fn n_knot_unknowns(&self) -> usize {
        6 * (self.n_controls - self.n_clamped)
    }

    pub(super) fn len(&self) -> usize {
        self.n_knot_unknowns() + self.active.len()
    }

    pub(super) fn knot(&self, control: usize) -> Option<usize> {
        control.checked_sub(self.n_clamped).map(|k| 6 * k)
    }

    pub(super) fn name(&self, unknown: usize) -> String {
        let Some(global) = unknown.checked_sub(self.n_knot_unknowns()) else {
            let (k, part) = (unknown / 6 + self.n_clamped, unknown % 6);
            let kind = if part < 3 { "rotation" } else { "translation" };
            return format!("the {kind} of control point {k}");
        };
        let name = match self.active[global] {
            index::LATENCY => "latency",
            i if index::EXTRINSIC_ROTATION.contains(&i) => "extrinsic rotation",
            i if index::EXTRINSIC_TRANSLATION.contains(&i) => "extrinsic translation",
            i if index::GYRO_BIAS.contains(&i) => "gyro bias",
            i if index::ACCEL_BIAS.contains(&i) => "accelerometer bias",
            i if index::GRAVITY.contains(&i) => "gravity direction",
            index::LATENCY_RATE => "rate of the lidar's clock",
            index::ENCODER_ZERO => "encoder zero",
            i if index::MOTOR_TILT.contains(&i) => "motor tilt",
            i if index::MOTOR_OFFSET.contains(&i) => "motor offset",
            i if index::ECCENTRICITY.contains(&i) => "eccentricity of the encoder",
            i if index::WOBBLE.contains(&i) => "wobble of the motor's shaft",
            i if index::GYRO_SCALE.contains(&i) => "gyro scale",
            i if index::GYRO_MISALIGNMENT.contains(&i) => "gyro misalignment",
            i if index::G_SENSITIVITY.contains(&i) => "sensitivity of the gyro to forces",
            i if index::ACCEL_SCALE.contains(&i) => "accelerometer scale",
            _ => "accelerometer misalignment",
        };
        format!("the {name}")
    }

    /// `AᵀW r` of the unknowns.
    pub(super) fn gradient(&self, equations: &NormalEquations) -> Mat<f64> {
        let mut gradient = Mat::zeros(self.len(), 1);
        for control in self.n_clamped..self.n_controls {
            let first = 6 * (control - self.n_clamped);
            for (i, v) in equations.knot_gradient(control).iter().enumerate() {
                gradient[(first + i, 0)] = *v;
            }
        }
        for (i, &g) in self.active.iter().enumerate() {
            gradient[(self.n_knot_unknowns() + i, 0)] = equations.global_gradient[g];
        }
        gradient
    }

    /// What is wrong where a factorization fails: the unknown with the least information, if all is
    /// finite.
    pub(super) fn singular(&self, equations: &NormalEquations) -> SolveError {
        let controls = self.n_clamped..self.n_controls;
        let knots = controls.flat_map(|c| equations.diagonal(c));
        let globals = self.active.iter().map(|&g| equations.corner()[(g, g)]);
        let diagonal: Vec<f64> = knots.chain(globals).collect();
        if diagonal.iter().any(|v| !v.is_finite()) {
            return SolveError::NotFinite;
        }
        let weakest = (0..diagonal.len()).min_by(|&a, &b| diagonal[a].total_cmp(&diagonal[b]));
        SolveError::Singular {
            unknown: self.name(weakest.unwrap_or(0)),
        }
    }
}
