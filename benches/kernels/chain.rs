// SPDX-License-Identifier: MIT OR Apache-2.0
//! Normal equations of a long trajectory, from rows of pseudo-random numbers.

use bentwing_registration::{NormalEquations, RowGroup};

use crate::Random;

/// Each control point meets the next three, as in the spline; one in `1 / loops` also meets
/// another one anywhere.
pub fn chain(n_controls: usize, loops: f64) -> NormalEquations {
    let mut random = Random(2);
    let mut equations = NormalEquations::new(n_controls);
    for first in 0..n_controls - 3 {
        add_rows(&mut equations, first..first + 4, &mut random);
        if random.uniform() < loops {
            let other = (random.uniform() * (n_controls - 4) as f64) as usize;
            add_rows(&mut equations, [first, other], &mut random);
        }
    }
    equations
}

fn add_rows(
    equations: &mut NormalEquations,
    controls: impl IntoIterator<Item = usize>,
    random: &mut Random,
) {
    let mut group = RowGroup::new(controls);
    for _ in 0..30 {
        group.knots_mut().fill_with(|| random.uniform() - 0.5);
        group.globals_mut().fill_with(|| random.uniform() - 0.5);
        group.add(random.uniform() - 0.5, 1.0);
    }
    group.flush(equations);
}
