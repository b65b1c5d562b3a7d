// SPDX-License-Identifier: MIT OR Apache-2.0
//! Initial condition of a recording that has no past: its first pose defines the map.

use bentwing_trajectory::CorrectionSpline;

use crate::NormalEquations;
use crate::rows::RowGroup;

/// Standard deviations of the first pose, rad and m: tight enough to fix the gauge, loose enough
/// to keep the equations well conditioned.
const SIGMA: [f64; 2] = [1e-5, 1e-4];

/// Adds `δ(t) = 0` at the start `t` of the trajectory; its velocity stays free.
pub fn add(equations: &mut NormalEquations, spline: &CorrectionSpline, t: f64) {
    let basis = spline.basis(t);
    let mut group = RowGroup::new(basis.first..basis.first + 4);
    for part in 0..6 {
        group.clear_row();
        let knots = group.knots_mut();
        for (m, w) in basis.weights.iter().enumerate() {
            knots[6 * m + part] = *w;
        }
        group.add(0.0, SIGMA[part / 3].powi(-2));
    }
    group.flush(equations);
}
