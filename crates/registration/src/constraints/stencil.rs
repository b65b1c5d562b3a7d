// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rows of neighbouring samples.

use bentwing_trajectory::StencilWeights;
use nalgebra::Matrix3;

use crate::{NormalEquations, RowGroup, index};

/// Rows of neighbouring samples of the trajectory, which mostly share their five control points. Of
/// the global states they concern the inertial ones.
pub(crate) struct StencilRows<'a> {
    equations: &'a mut NormalEquations,
    first: usize,
    group: RowGroup,
}

impl<'a> StencilRows<'a> {
    pub fn new(equations: &'a mut NormalEquations) -> Self {
        Self {
            equations,
            first: usize::MAX,
            group: RowGroup::of([], index::INERTIAL),
        }
    }

    /// The group of the control points `first .. first + 5`.
    pub fn group(&mut self, first: usize) -> &mut RowGroup {
        if self.first != first {
            self.flush();
            self.first = first;
            self.group.reset(first..first + 5, index::INERTIAL);
        }
        &mut self.group
    }

    pub fn flush(&mut self) {
        self.group.flush(self.equations);
        self.first = usize::MAX;
        self.group.reset([], index::INERTIAL);
    }
}

/// Adds `Σ_m w_m J[row, :]` to the entries of the control points, at `offset` 0 for rotations and
/// 3 for translations.
pub(crate) fn add_stencil(
    knots: &mut [f64],
    stencil: &StencilWeights,
    J: &Matrix3<f64>,
    row: usize,
    offset: usize,
) {
    for (entries, w) in knots.chunks_exact_mut(6).zip(stencil.weights) {
        for c in 0..3 {
            entries[offset + c] += w * J[(row, c)];
        }
    }
}
