// SPDX-License-Identifier: MIT OR Apache-2.0
//! Initial condition of a recording that has no past: its first pose defines the map.

use bentwing_trajectory::CorrectionSpline;

use crate::{NormalEquations, RowGroup};

/// Standard deviations of the correction `[δr, δt]` of a first pose, rad and m.
pub type Sigmas = [f64; 6];

/// Of a first pose that stays: tight enough to fix the gauge, loose enough to keep the equations well
/// conditioned.
pub const HELD: Sigmas = [1e-5, 1e-5, 1e-5, 1e-4, 1e-4, 1e-4];

/// Of one whose place and heading define the map, while gravity says how it is tilted.
pub const HELD_BUT_FOR_TILT: Sigmas = [0.1, 0.1, 1e-5, 1e-4, 1e-4, 1e-4];

/// Of one that others say all about.
pub const LOOSE: Sigmas = [0.1, 0.1, 0.1, 1.0, 1.0, 1.0];

/// Adds `δ(t) = 0` at the start `t` of the trajectory; its velocity stays free.
pub fn add(equations: &mut NormalEquations, spline: &CorrectionSpline, t: f64, sigmas: &Sigmas) {
    let basis = spline.basis(t);
    let mut group = RowGroup::of(basis.first..basis.first + 4, 0..0);
    for (part, sigma) in sigmas.iter().enumerate() {
        group.clear_row();
        let knots = group.knots_mut();
        for (m, w) in basis.weights.iter().enumerate() {
            knots[6 * m + part] = *w;
        }
        group.add(0.0, sigma.powi(-2));
    }
    group.flush(equations);
}
