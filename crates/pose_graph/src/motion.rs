// SPDX-License-Identifier: MIT OR Apache-2.0
//! Measured motions with their covariances, and how they add up along a way.

use bentwing_trajectory::{se3, so3};
use nalgebra::{Isometry3, Matrix6, Vector6};

use crate::graph::Link;

/// Share of an information's trace that it has in every direction: what it does not tell has a
/// large variance, but a finite one.
const LEAST_INFORMATION: f64 = 1e-9;

/// Information below which a measurement says nothing, rad⁻² and m⁻².
const NO_INFORMATION: f64 = 1e-12;

/// A measured motion, with the covariance of `Log(measured⁻¹ · actual)`, rotation first.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// `T_start_end`.
    pub T: Isometry3<f64>,
    /// In the frame of the end.
    pub covariance: Matrix6<f64>,
}

impl Motion {
    /// No motion, known exactly.
    pub fn none() -> Self {
        Self {
            T: Isometry3::identity(),
            covariance: Matrix6::zeros(),
        }
    }

    /// What a link has measured.
    pub fn of(link: &Link) -> Self {
        let least = (LEAST_INFORMATION * link.information.trace()).max(NO_INFORMATION);
        let regular = link.information + Matrix6::identity() * least;
        let covariance = regular
            .cholesky()
            .map_or_else(|| Matrix6::identity() / least, |c| c.inverse());
        Self {
            T: link.T_from_to,
            covariance,
        }
    }

    /// This motion, then `next`; their errors are independent.
    pub fn then(&self, next: &Self) -> Self {
        let A = adjoint(&next.T.inverse());
        Self {
            T: self.T * next.T,
            covariance: A * self.covariance * A.transpose() + next.covariance,
        }
    }

    /// The way back.
    pub fn back(&self) -> Self {
        let A = adjoint(&self.T);
        Self {
            T: self.T.inverse(),
            covariance: A * self.covariance * A.transpose(),
        }
    }

    /// Squared distance from another, independent measurement of the same motion, in units of the
    /// variance of the difference.
    pub fn chi2(&self, other: &Self) -> f64 {
        let error = se3::log(&self.T.inv_mul(&other.T));
        squared(&error, &(self.covariance + other.covariance))
    }
}

/// `rᵀΣ⁻¹r`; infinite where Σ is no covariance.
pub fn squared(r: &Vector6<f64>, covariance: &Matrix6<f64>) -> f64 {
    let solved = covariance.cholesky().map(|c| r.dot(&c.solve(r)));
    solved.unwrap_or(f64::INFINITY)
}

/// Of a tangent vector in the frame of the end, that in the frame of the start.
fn adjoint(T: &Isometry3<f64>) -> Matrix6<f64> {
    let R = so3::matrix(&T.rotation);
    let mut adjoint = Matrix6::zeros();
    adjoint.fixed_view_mut::<3, 3>(0, 0).copy_from(&R);
    adjoint.fixed_view_mut::<3, 3>(3, 3).copy_from(&R);
    let lever = so3::hat(&T.translation.vector) * R;
    adjoint.fixed_view_mut::<3, 3>(3, 0).copy_from(&lever);
    adjoint
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{isometries, vector};
    use nalgebra::Vector3;
    use proptest::prelude::*;

    fn exp(xi: &Vector6<f64>) -> Isometry3<f64> {
        // To first order in the shift, which is small here.
        let turn = so3::exp(&xi.fixed_rows::<3>(0).into_owned());
        Isometry3::from_parts(Vector3::from(xi.fixed_rows::<3>(3)).into(), turn)
    }

    proptest! {
        /// A small error of each part, carried through the products, against the covariance of one
        /// that has only this error.
        #[test]
        fn covariances_are_carried_as_errors_are(
            ways in isometries(2), turn in vector(1.0), shift in vector(1.0),
        ) {
            let small = Vector6::from_iterator(turn.iter().chain(&shift).copied()) * 1e-6;
            let first = Motion { T: ways[0], covariance: small * small.transpose() };
            let second = Motion { T: ways[1], covariance: Matrix6::zeros() };
            let carried = se3::log(&(ways[0] * ways[1]).inv_mul(&(ways[0] * exp(&small) * ways[1])));
            let both = first.then(&second).covariance;
            prop_assert!((both - carried * carried.transpose()).amax() < 1e-5 * both.amax());
            let back = first.back();
            let returned = se3::log(&back.T.inv_mul(&(ways[0] * exp(&small)).inverse()));
            let scale = back.covariance.amax();
            prop_assert!((back.covariance - returned * returned.transpose()).amax() < 1e-5 * scale);
        }
    }

    #[test]
    fn a_direction_without_information_tells_no_difference() {
        let mut link = crate::testing::helix(1, 4).links.swap_remove(0);
        link.information[(5, 5)] = 0.0;
        let measured = Motion::of(&link);
        let mut other = measured;
        other.T.translation.vector += measured.T.rotation * Vector3::new(0.0, 0.0, 0.5);
        assert!(measured.chi2(&other) < 1e-3);
        other.T.translation.vector += measured.T.rotation * Vector3::new(0.5, 0.0, 0.0);
        // Twice the variance of 1/400 m².
        assert!((measured.chi2(&other) - 50.0).abs() < 1e-3);
    }
}
