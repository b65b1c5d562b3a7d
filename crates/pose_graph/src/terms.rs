// SPDX-License-Identifier: MIT OR Apache-2.0
//! Residuals of links and gravity, and what they add to the normal equations.

use bentwing_trajectory::{se3, so3};
use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3, Vector6};

use crate::graph::{GravityTerm, Link};

/// A link at the current poses: `½ rᵀΩr` with `r = Log(T̂_from_to⁻¹ · T_map_from⁻¹ · T_map_to)`,
/// rotation first; GTSAM's `BetweenFactor` has the same.
pub struct LinkAt {
    error: Isometry3<f64>,
    residual: Vector6<f64>,
}

/// A link's part of the normal equations, `JᵀΩJ` and `JᵀΩr`.
///
/// With `d = p_to − p_from` and `C = [I, 0; −d×, I]` the derivative by `from` is minus the one by
/// `to` times C: turning `from` moves `to` in the opposite sense about it. So one matrix and one
/// vector, those of `to`, tell everything.
pub struct LinkEquations {
    /// `J_toᵀ Ω J_to`.
    pub information: Matrix6<f64>,
    /// `J_toᵀ Ω r`.
    pub gradient: Vector6<f64>,
    lever: Matrix6<f64>,
}

impl LinkAt {
    /// The residual of `link` at `poses`.
    pub fn new(link: &Link, poses: &[Isometry3<f64>]) -> Self {
        let expected = match link.from {
            Some(from) => poses[from] * link.T_from_to,
            None => link.T_from_to,
        };
        let error = expected.inv_mul(&poses[link.to]);
        let residual = se3::log(&error);
        Self { error, residual }
    }

    /// `rᵀΩr`.
    pub fn chi2(&self, link: &Link) -> f64 {
        self.residual.dot(&(link.information * self.residual))
    }

    /// `rᵀΩr` of the turn alone, and of the shift.
    pub fn chi2_of_turn_and_shift(&self, link: &Link) -> (f64, f64) {
        let part = |first: usize| {
            let r = self.residual.fixed_rows::<3>(first);
            let information = link.information.fixed_view::<3, 3>(first, first);
            r.dot(&(information * r))
        };
        (part(0), part(3))
    }

    /// The residual.
    pub fn residual(&self) -> &Vector6<f64> {
        &self.residual
    }

    /// Derivatives of the residual by the poses of `from` and `to`, for `R ← Exp(δr) R`,
    /// `p ← p + δt`.
    pub fn jacobians(&self, link: &Link, poses: &[Isometry3<f64>]) -> [Matrix6<f64>; 2] {
        let J = self.jacobian_of_to(link, poses);
        [-J * lever(link, poses), J]
    }

    /// Linearization for the same.
    pub fn linearize(&self, link: &Link, poses: &[Isometry3<f64>]) -> LinkEquations {
        let J = self.jacobian_of_to(link, poses);
        let weighted = link.information * J;
        LinkEquations {
            information: J.tr_mul(&weighted),
            gradient: weighted.tr_mul(&self.residual),
            lever: lever(link, poses),
        }
    }

    fn jacobian_of_to(&self, link: &Link, poses: &[Isometry3<f64>]) -> Matrix6<f64> {
        // Both perturbations of `to` act in its own frame after the turn by R_toᵀ.
        let R = so3::matrix(&poses[link.to].rotation);
        let mut turn = Matrix6::zeros();
        turn.fixed_view_mut::<3, 3>(0, 0).copy_from(&R.transpose());
        turn.fixed_view_mut::<3, 3>(3, 3).copy_from(&R.transpose());
        se3::right_jacobian_inverse(&self.error) * turn
    }
}

impl LinkEquations {
    /// `J_fromᵀ Ω J_from`.
    pub fn information_of_from(&self) -> Matrix6<f64> {
        self.lever.tr_mul(&self.information) * self.lever
    }

    /// `J_fromᵀ Ω J_to`.
    pub fn cross_information(&self) -> Matrix6<f64> {
        -self.lever.tr_mul(&self.information)
    }

    /// `J_fromᵀ Ω r`.
    pub fn gradient_of_from(&self) -> Vector6<f64> {
        -self.lever.tr_mul(&self.gradient)
    }
}

/// The matrix C of [`LinkEquations`].
fn lever(link: &Link, poses: &[Isometry3<f64>]) -> Matrix6<f64> {
    let mut C = Matrix6::identity();
    if let Some(from) = link.from {
        let d = poses[link.to].translation.vector - poses[from].translation.vector;
        C.fixed_view_mut::<3, 3>(3, 0).copy_from(&-so3::hat(&d));
    }
    C
}

/// A gravity term at the current pose: `½ w ‖r‖²` with `r = R û − z`.
pub struct GravityAt {
    up_map: Vector3<f64>,
    weight: f64,
}

impl GravityAt {
    /// The residual of `term` at `poses`.
    pub fn new(term: &GravityTerm, poses: &[Isometry3<f64>]) -> Self {
        Self {
            up_map: poses[term.node].rotation * term.up,
            weight: term.weight,
        }
    }

    /// `w ‖r‖²`.
    pub fn chi2(&self) -> f64 {
        self.weight * (self.up_map - Vector3::z()).norm_squared()
    }

    /// `JᵀwJ` and `Jᵀwr` of the node's rotation; `J = −(Rû)×`, so that `Jᵀr = −(Rû)×z`.
    pub fn equations(&self) -> (Matrix3<f64>, Vector3<f64>) {
        let J = -so3::hat(&self.up_map);
        let r = self.up_map - Vector3::z();
        (J.tr_mul(&J) * self.weight, J.tr_mul(&r) * self.weight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{assert_jacobian, corrected, isometries, vector};
    use proptest::prelude::*;

    proptest! {
        /// The blocks are `JᵀΩJ` of central differences, whatever the angles.
        #[test]
        fn a_link_is_linearized_as_central_differences_say(
            poses in isometries(2), T_from_to in isometries(1), spread in vector(3.0),
        ) {
            let factor = Matrix6::from_fn(|r, c| {
                if r == c { 2.0 + spread[r % 3].abs() } else { 0.2 * spread[(r + c) % 3] }
            });
            let link = Link {
                from: Some(0), to: 1, T_from_to: T_from_to[0],
                information: factor.tr_mul(&factor), trusted: true,
            };
            let at = LinkAt::new(&link, &poses);
            // Where the error is half a turn the logarithm jumps.
            prop_assume!(at.residual.fixed_rows::<3>(0).norm() < 3.0);
            let equations = at.linearize(&link, &poses);
            let residual = |node: usize, delta: &Vector6<f64>| {
                let mut moved = poses.clone();
                moved[node] = corrected(&moved[node], delta);
                factor * LinkAt::new(&link, &moved).residual
            };
            let J_from = assert_jacobian(
                |d| residual(0, d), &equations.information_of_from(), &equations.gradient_of_from(),
            )?;
            let J_to = assert_jacobian(
                |d| residual(1, d), &equations.information, &equations.gradient,
            )?;
            let cross = J_from.tr_mul(&J_to);
            let scale = cross.amax().max(1.0);
            prop_assert!((cross - equations.cross_information()).amax() < 1e-6 * scale);
        }

        #[test]
        fn gravity_is_linearized_as_central_differences_say(
            poses in isometries(1), up in vector(1.0), weight in 0.1..100.0_f64,
        ) {
            prop_assume!(up.norm() > 0.1);
            let term = GravityTerm { node: 0, up: up.normalize(), weight };
            let at = GravityAt::new(&term, &poses);
            let (rotation, pull) = at.equations();
            let (mut information, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
            information.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
            gradient.fixed_rows_mut::<3>(0).copy_from(&pull);
            let residual = |delta: &Vector6<f64>| {
                let moved = [corrected(&poses[0], delta)];
                let r = GravityAt::new(&term, &moved).up_map - Vector3::z();
                r * weight.sqrt()
            };
            assert_jacobian(residual, &information, &gradient)?;
            prop_assert!((at.chi2() - residual(&Vector6::zeros()).norm_squared()).abs() < 1e-9);
        }
    }
}
