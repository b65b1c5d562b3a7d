// SPDX-License-Identifier: MIT OR Apache-2.0
//! The group of rigid motions: logarithm and the Jacobian of the logarithm, rotation first.

use nalgebra::{Isometry3, Matrix3, Matrix6, Vector6};

use crate::so3;

/// Below this angle the series replaces the closed form, of which the fourth power of the angle
/// divides a difference of nearly equal numbers; the series' error is then under 1e-14.
const SMALL_ANGLE: f64 = 0.1;

/// Twist `[φ, ρ]` whose exponential is `T`: `φ = Log R`, `ρ = V(φ)⁻¹ t` (Barfoot 2017, section 7.1).
pub fn log(T: &Isometry3<f64>) -> Vector6<f64> {
    let phi = so3::log(&T.rotation);
    let t = &T.translation.vector;
    let once = phi.cross(t);
    let rho = t - 0.5 * once + so3::log_coefficient(phi.norm()) * phi.cross(&once);
    Vector6::new(phi.x, phi.y, phi.z, rho.x, rho.y, rho.z)
}

/// Inverse of the right Jacobian at `T`: `log(T · exp(ξ)) ≈ log(T) + right_jacobian_inverse(T) ξ`.
///
/// The lower left block is the derivative of `ρ = t − ½ φ×t + c(θ) φ×(φ×t)` by φ.
pub fn right_jacobian_inverse(T: &Isometry3<f64>) -> Matrix6<f64> {
    let phi = so3::log(&T.rotation);
    let t = &T.translation.vector;
    let angle = phi.norm();
    let twice = phi.cross(&phi.cross(t));
    let rotation = so3::right_jacobian_inverse(&phi);
    let lever = Matrix3::identity() * phi.dot(t) + phi * t.transpose() - 2.0 * t * phi.transpose();
    let by_phi = 0.5 * so3::hat(t)
        + so3::log_coefficient(angle) * lever
        + log_coefficient_slope(angle) * twice * phi.transpose();
    let mut jacobian = Matrix6::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
    jacobian.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    jacobian
        .fixed_view_mut::<3, 3>(3, 0)
        .copy_from(&(by_phi * rotation));
    jacobian
}

/// `c'(θ)/θ` of `c(θ) = (1 − ½θ cot ½θ)/θ²`.
fn log_coefficient_slope(angle: f64) -> f64 {
    if angle < SMALL_ANGLE {
        let a2 = angle * angle;
        return 1.0 / 360.0 + a2 * (1.0 / 7560.0 + a2 / 201_600.0);
    }
    let half = 0.5 * angle;
    let cot = half * half.cos() / half.sin();
    let csc = half / half.sin();
    (cot + csc * csc - 2.0) / (angle * angle * angle * angle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    fn isometry(phi: Vector3<f64>, t: Vector3<f64>) -> Isometry3<f64> {
        Isometry3::from_parts(t.into(), so3::exp(&phi))
    }

    fn vector(max: f64) -> impl Strategy<Value = Vector3<f64>> {
        let c = -max..max;
        (c.clone(), c.clone(), c).prop_map(|(x, y, z)| Vector3::new(x, y, z))
    }

    /// `Σ Aᵏ/k!` of the 4×4 matrix of a twist, halved until it is small.
    fn exponential(xi: &Vector6<f64>) -> Isometry3<f64> {
        let (halvings, mut twist) = (10, nalgebra::Matrix4::zeros());
        let (phi, rho) = (xi.fixed_rows::<3>(0), xi.fixed_rows::<3>(3));
        twist
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&so3::hat(&phi.into_owned()));
        twist.fixed_view_mut::<3, 1>(0, 3).copy_from(&rho);
        twist /= f64::from(1 << halvings);
        let (mut sum, mut term) = (nalgebra::Matrix4::identity(), nalgebra::Matrix4::identity());
        for k in 1..12 {
            term = term * twist / f64::from(k);
            sum += term;
        }
        for _ in 0..halvings {
            sum *= sum;
        }
        let phi = Vector3::new(xi[0], xi[1], xi[2]);
        isometry(phi, sum.fixed_view::<3, 1>(0, 3).into_owned())
    }

    proptest! {
        #[test]
        fn logarithm_inverts_the_exponential_below_half_a_turn(phi in vector(1.8), rho in vector(5.0)) {
            let xi = Vector6::new(phi.x, phi.y, phi.z, rho.x, rho.y, rho.z);
            prop_assert!((log(&exponential(&xi)) - xi).norm() < 1e-10);
        }

        #[test]
        fn right_jacobian_inverse_matches_central_differences(
            phi in vector(1.75), scale in prop_oneof![Just(1.0), Just(0.05), Just(1e-3), Just(0.0)],
            t in vector(5.0), turn in vector(1.0), shift in vector(1.0),
        ) {
            let (T, h) = (isometry(phi * scale, t), 1e-6);
            let moved = |h: f64| log(&(T * isometry(turn * h, shift * h)));
            let numeric = (moved(h) - moved(-h)) / (2.0 * h);
            let xi = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
            let analytic = right_jacobian_inverse(&T) * xi;
            prop_assert!((numeric - analytic).norm() < 1e-7 * (1.0 + analytic.norm()));
        }
    }

    #[test]
    fn series_and_closed_form_of_the_slope_agree_where_they_meet() {
        let below = log_coefficient_slope(SMALL_ANGLE * (1.0 - 1e-9));
        let above = log_coefficient_slope(SMALL_ANGLE);
        assert!((below - above).abs() < 1e-10);
    }
}
