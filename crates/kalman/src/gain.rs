// SPDX-License-Identifier: MIT OR Apache-2.0
//! The update in the form whose cost grows with the state, not with the measurements.
//!
//! With `Λ = Hᵀ R⁻¹ H` and `P = L Lᵀ` (Fu 2023's gain by the matrix inversion lemma, as in FAST-LIO;
//! the factor keeps it symmetric, and states that are known exactly may have no covariance):
//! `(P⁻¹ + Λ)⁻¹ = L (I + Lᵀ Λ L)⁻¹ Lᵀ`.

use bentwing_trajectory::so3;
use nalgebra::{Matrix3, Vector3};

use crate::state::{Square, Tangent, at};

/// A variance that fell to this share of itself in the factorization was rounding.
const ROUNDING: f64 = 1e-13;

/// Lower factor of a positive semidefinite matrix; columns of what is known exactly are zero.
fn factor(P: &Square) -> Square {
    let mut L = Square::zeros();
    for j in 0..P.ncols() {
        let pivot = P[(j, j)] - L.row(j).columns(0, j).norm_squared();
        if pivot <= ROUNDING * P[(j, j)] {
            continue;
        }
        let root = pivot.sqrt();
        L[(j, j)] = root;
        for i in j + 1..P.nrows() {
            let inner = L.row(i).columns(0, j).dot(&L.row(j).columns(0, j));
            L[(i, j)] = (P[(i, j)] - inner) / root;
        }
    }
    L
}

/// `(P⁻¹ + Λ)⁻¹`; None where it is not finite.
pub(crate) fn posterior(P: &Square, information: &Square) -> Option<Square> {
    let L = factor(P);
    let inner = Square::identity() + L.transpose() * information * L;
    let inverse = inner.cholesky()?.inverse();
    let P = L * inverse * L.transpose();
    let P = 0.5 * (P + P.transpose());
    P.iter().all(|v| v.is_finite()).then_some(P)
}

/// The Jacobian's inverse `J⁻¹` of the error after a further correction: `x ⊞ δ ⊟ x̂ ≈ d + J δ`.
///
/// A rotation's error grows as `Log(Exp(δ) Exp(d)) ≈ d + J_l⁻¹(d) δ`, so that J⁻¹ is `J_l(d)`.
pub(crate) fn transport(d: &Tangent) -> Square {
    let mut J = Square::identity();
    for i in [at::ROTATION, at::BASE_ROTATION, at::LIDAR_ROTATION] {
        let block = left_jacobian(&d.fixed_rows::<3>(i).into_owned());
        J.fixed_view_mut::<3, 3>(i, i).copy_from(&block);
    }
    J
}

fn left_jacobian(phi: &Vector3<f64>) -> Matrix3<f64> {
    // The right one's inverse at −φ is the left one's; both are near one.
    let inverse = so3::right_jacobian_inverse(&-phi);
    inverse.try_inverse().unwrap_or_else(Matrix3::identity)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::{DIM, tests::some_state};
    use proptest::prelude::*;

    fn covariance(values: &[f64]) -> Square {
        let L = Square::from_fn(|i, j| {
            if j <= i {
                values[(i * 5 + j * 3) % values.len()] + f64::from(u8::from(i == j))
            } else {
                0.0
            }
        });
        L * L.transpose()
    }

    proptest! {
        #[test]
        fn the_posterior_is_that_of_the_gain(
            values in prop::collection::vec(-0.3..0.3_f64, 40),
            rows in prop::collection::vec(-1.0..1.0_f64, DIM * 3),
        ) {
            let P = covariance(&values);
            let H = nalgebra::SMatrix::<f64, 3, DIM>::from_column_slice(&rows);
            let S = H * P * H.transpose() + Matrix3::identity() * 0.04;
            let Some(inverse) = S.try_inverse() else { return Err(TestCaseError::reject("singular")) };
            let K = P * H.transpose() * inverse;
            let expected = (Square::identity() - K * H) * P;
            let found = posterior(&P, &(H.transpose() * H / 0.04));
            prop_assert!(found.is_some_and(|f| (f - expected).norm() < 1e-6 * expected.norm()));
        }

        #[test]
        fn the_transport_follows_a_further_correction(
            d in prop::collection::vec(-0.2..0.2_f64, DIM),
            e in prop::collection::vec(-1.0..1.0_f64, DIM),
        ) {
            let (x, d, e, h) = (some_state(), Tangent::from_vec(d), Tangent::from_vec(e), 1e-6);
            let moved = x.plus(&d);
            let ahead = moved.plus(&(e * h)).minus(&x);
            let behind = moved.plus(&(e * -h)).minus(&x);
            let change = transport(&d) * (ahead - behind) / (2.0 * h);
            let rotations = [at::ROTATION, at::BASE_ROTATION, at::LIDAR_ROTATION];
            for i in rotations {
                let off = change.fixed_rows::<3>(i) - e.fixed_rows::<3>(i);
                prop_assert!(off.norm() < 1e-6);
            }
        }
    }

    #[test]
    fn what_is_known_exactly_stays_so() -> Result<(), &'static str> {
        let mut P = Square::identity() * 0.01;
        P.row_mut(25).fill(0.0);
        P.column_mut(25).fill(0.0);
        let mut information = Square::zeros();
        information.fixed_view_mut::<31, 31>(0, 0).fill(10.0);
        let found = posterior(&P, &information).ok_or("no posterior")?;
        assert!(found.row(25).norm() == 0.0 && found[(0, 0)] < 0.01);
        Ok(())
    }
}
