// SPDX-License-Identifier: MIT OR Apache-2.0
//! Equations to solve in tests.

use crate::{NormalEquations, RowGroup};

/// Equations of a chain of control points with loops, from pseudo-random rows.
pub fn equations(n: usize) -> NormalEquations {
    let mut equations = NormalEquations::new(n);
    let mut x = 0.3_f64;
    let mut next = || {
        x = (x * 3.9).mul_add(1.0 - x, 0.0);
        x - 0.5
    };
    for k in 0..n - 1 {
        let mut group = RowGroup::new([k, k + 1, (7 * k) % n]);
        for _ in 0..40 {
            group.knots_mut().iter_mut().for_each(|v| *v = next());
            group.globals_mut().iter_mut().for_each(|v| *v = next());
            group.add(next(), 1.0);
        }
        group.flush(&mut equations);
    }
    equations
}
