// SPDX-License-Identifier: MIT OR Apache-2.0
//! The rotation group: exponential, logarithm and its Jacobian, and quaternions as matrices.

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

/// Below this angle the series replace the closed forms; their error is then under 1e-17.
const SMALL_ANGLE: f64 = 1e-4;

/// Cross-product matrix: `hat(a) * b == a × b`.
pub fn hat(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// Rotation by the vector `phi`, rad.
pub fn exp(phi: &Vector3<f64>) -> UnitQuaternion<f64> {
    let half = 0.5 * phi.norm();
    let (w, scale) = if half < SMALL_ANGLE {
        let h2 = half * half;
        (1.0 - 0.5 * h2, 0.5 * (1.0 - h2 / 6.0))
    } else {
        let (sin, cos) = half.sin_cos();
        (cos, 0.5 * sin / half)
    };
    let v = phi * scale;
    UnitQuaternion::new_normalize(Quaternion::new(w, v.x, v.y, v.z))
}

/// Rotation vector of `q`, rad, with a norm of at most π.
pub fn log(q: &UnitQuaternion<f64>) -> Vector3<f64> {
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    let v = q.imag() * sign;
    let sin = v.norm();
    let scale = if sin < SMALL_ANGLE {
        2.0 + sin * sin / 3.0
    } else {
        2.0 * sin.atan2(q.w * sign) / sin
    };
    v * scale
}

/// `Exp(phi) R`, with unit norm again: the perturbation on the left, in the outer frame of R.
#[inline]
pub fn turned(phi: &Vector3<f64>, R: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    renormalized(exp(phi) * R)
}

/// The same rotation without the norm's rounding errors.
#[inline]
pub fn renormalized(q: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(q.into_inner())
}

/// The matrix of a rotation.
#[inline]
pub fn matrix(q: &UnitQuaternion<f64>) -> Matrix3<f64> {
    q.to_rotation_matrix().into_inner()
}

/// The rotation of a matrix that is one.
#[inline]
pub fn of_matrix(R: Matrix3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(R))
}

/// Inverse of the right Jacobian: `log(exp(phi) · exp(δ)) ≈ phi + right_jacobian_inverse(phi) δ`.
pub fn right_jacobian_inverse(phi: &Vector3<f64>) -> Matrix3<f64> {
    let h = hat(phi);
    Matrix3::identity() + 0.5 * h + log_coefficient(phi.norm()) * h * h
}

/// The right Jacobian, `exp(phi + δ) ≈ exp(phi) · exp(J δ)`, of rotations of some degrees at most: what
/// its series leaves out is below `|phi|⁵ / 720`.
pub fn right_jacobian_of_small(phi: &Vector3<f64>) -> Matrix3<f64> {
    let (h, square) = (hat(phi), phi.norm_squared());
    Matrix3::identity() - h * (0.5 - square / 24.0) + h * h * (1.0 / 6.0 - square / 120.0)
}

/// `(1 − ½θ cot ½θ)/θ²`, the factor of `φ×(φ×·)` in the inverses of the group's Jacobians.
pub(crate) fn log_coefficient(angle: f64) -> f64 {
    if angle < 1e-3 {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        1.0 / (angle * angle) - (1.0 + angle.cos()) / (2.0 * angle * angle.sin())
    }
}

/// Two unit vectors that complete the unit vector `axis` to a right-handed frame.
pub fn orthogonal_pair(axis: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let away = if axis.x.abs() < 0.6 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let first = axis.cross(&away);
    let first = first / first.norm();
    [first, axis.cross(&first)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector(max: f64) -> impl Strategy<Value = Vector3<f64>> {
        let c = -max..max;
        (c.clone(), c.clone(), c).prop_map(|(x, y, z)| Vector3::new(x, y, z))
    }

    proptest! {
        #[test]
        fn logarithm_inverts_the_exponential_below_half_a_turn(phi in vector(1.8)) {
            prop_assert!((log(&exp(&phi)) - phi).norm() < 1e-12);
        }

        #[test]
        fn small_and_closed_form_branches_agree(phi in vector(1.0), scale in 1e-6..2e-3_f64) {
            let small = phi * scale;
            let q = UnitQuaternion::from_scaled_axis(small);
            prop_assert!((q.into_inner() - exp(&small).into_inner()).norm() < 1e-15);
        }

        #[test]
        fn right_jacobian_inverse_matches_central_differences(phi in vector(1.5), d in vector(1.0)) {
            let h = 1e-6;
            let forward = log(&(exp(&phi) * exp(&(d * h))));
            let backward = log(&(exp(&phi) * exp(&(-d * h))));
            let numeric = (forward - backward) / (2.0 * h);
            let analytic = right_jacobian_inverse(&phi) * d;
            prop_assert!((numeric - analytic).norm() < 1e-8 * (1.0 + analytic.norm()));
        }

        #[test]
        fn right_jacobian_of_small_is_the_inverse_of_the_inverse(phi in vector(0.05)) {
            let product = right_jacobian_of_small(&phi) * right_jacobian_inverse(&phi);
            prop_assert!((product - Matrix3::identity()).norm() < 1e-8);
        }

        #[test]
        fn orthogonal_pair_completes_a_right_handed_frame(a in vector(1.0)) {
            prop_assume!(a.norm() > 1e-3);
            let a = a / a.norm();
            let [u, v] = orthogonal_pair(&a);
            prop_assert!((u.cross(&v) - a).norm() < 1e-12);
            prop_assert!(u.dot(&a).abs() < 1e-12);
        }
    }
}
