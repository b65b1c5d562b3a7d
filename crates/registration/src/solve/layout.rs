// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which unknown of the normal equations is which.

use crate::{N_GLOBALS, index};

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
            index::ENCODER_ZERO => "encoder zero",
            i if index::MOTOR_TILT.contains(&i) => "motor tilt",
            _ => "motor offset",
        };
        format!("the {name}")
    }
}
