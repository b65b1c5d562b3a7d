// SPDX-License-Identifier: MIT OR Apache-2.0
//! Velocities deviate little from those of the linearization point, and smoothly (Kaul 2015, 2.1).

use bentwing_trajectory::CorrectionSpline;

use crate::{NormalEquations, RowGroup, Settings};

/// Adds the differences of neighbouring control points as rows: `(c_{m+1} − c_m) / h` is the
/// correction of the velocity.
pub fn add(equations: &mut NormalEquations, spline: &CorrectionSpline, settings: &Settings) {
    for m in 0..spline.n_controls() - 1 {
        let mut group = RowGroup::of([m, m + 1], 0..0);
        for part in 0..6 {
            let sigma = if part < 3 {
                settings.rate_sigma
            } else {
                settings.velocity_sigma
            };
            group.clear_row();
            let knots = group.knots_mut();
            knots[part] = -1.0;
            knots[6 + part] = 1.0;
            group.add(0.0, (sigma * spline.h()).powi(-2));
        }
        group.flush(equations);
    }
}
