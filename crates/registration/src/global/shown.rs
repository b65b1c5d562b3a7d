// SPDX-License-Identifier: MIT OR Apache-2.0
//! Global states that are estimated only where the recording shows them.
//!
//! Free everywhere they would take up a little of whatever else is wrong, and a trajectory that was right
//! would become worse by what they err.

use super::joint::Joint;
use crate::state::State;
use crate::{N_GLOBALS, NormalEquations, SolveError, Solver};

/// A state shows that is so many standard deviations away from what it was taken for. Matches of one
/// surface share what is wrong with it: of four, two and a half are left.
const SHOWN: f64 = 4.0;
/// And that the recording knows much better than the prior: no more of the variance is left.
const LEFT: f64 = 0.25;

/// Sets free what shows at a settled state of all pieces; returns whether something does.
///
/// # Parameters
/// * `equations`: all rows at the states
///
/// # Errors
/// When the equations are singular or hold values that are not finite.
pub fn release(
    mut equations: NormalEquations,
    joint: &Joint,
    states: &mut [State<'_>],
) -> Result<bool, SolveError> {
    let mut free = states.to_vec();
    for state in &mut free {
        state.frozen = state.prior.frozen;
    }
    joint.freeze(&mut equations, &free);
    let factorized = Solver::default().factorize(&equations, 0, &[true; N_GLOBALS])?;
    let steps = joint.split(&factorized.solve());
    let mut any = false;
    for (number, (state, step)) in states.iter_mut().zip(&steps).enumerate() {
        let covariance = joint.covariance(&factorized, number, &free[number]);
        for (g, frozen) in state.frozen.iter_mut().enumerate() {
            let expected = 1.0 / state.prior.information[(g, g)];
            if *frozen && shows(step.globals[g], covariance[(g, g)], expected) {
                (*frozen, any) = (false, true);
            }
        }
    }
    Ok(any)
}

/// Whether a state that is off by so much is shown to be, with variances after and before. Of one that
/// is frozen for good the variance is zero.
fn shows(off: f64, variance: f64, expected: f64) -> bool {
    let known = 0.0 < variance && variance < LEFT * expected;
    known && off * off > SHOWN * SHOWN * variance
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_far_from_its_value_and_well_known_shows() {
        let expected = 0.02_f64.powi(2);
        assert!(shows(0.01, 0.002_f64.powi(2), expected));
        assert!(!shows(0.007, 0.002_f64.powi(2), expected));
        // Far, but no better known than before.
        assert!(!shows(0.06, 0.011_f64.powi(2), expected));
        assert!(!shows(0.01, 0.0, expected));
    }
}
