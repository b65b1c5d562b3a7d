// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is known of the global states from before.

use crate::{GlobalMatrix, GlobalVector, N_GLOBALS, NormalEquations};

/// Adds the prior information; `moved` is how far the states have come from the prior's mean.
pub fn add(equations: &mut NormalEquations, information: &GlobalMatrix, moved: &GlobalVector) {
    for r in 0..N_GLOBALS {
        for c in 0..=r {
            equations.add_corner(r, c, information[(r, c)]);
        }
        let pull: f64 = (0..N_GLOBALS).map(|c| information[(r, c)] * moved[c]).sum();
        equations.global_gradient[r] += pull;
    }
}
