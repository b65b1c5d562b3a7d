// SPDX-License-Identifier: MIT OR Apache-2.0
//! Symmetric 3×3 matrices and their closed-form eigendecomposition.

use bentwing_trajectory::so3;
use nalgebra::{Matrix3, Vector3};

/// Eigenvalues in increasing order and the unit eigenvector of the smallest one.
#[derive(Clone, Copy, Debug)]
pub struct Eigen {
    /// `λ1 <= λ2 <= λ3`.
    pub values: [f64; 3],
    /// Unit eigenvector of `λ1`; of arbitrary direction where `λ1` is not simple.
    pub normal: Vector3<f64>,
}

/// Eigenvalues of the symmetric matrix `a` by the trigonometric formula.
pub fn eigen(a: &Matrix3<f64>) -> Eigen {
    let mean = a.trace() / 3.0;
    let b = a - Matrix3::from_diagonal_element(mean);
    let p2 = b.norm_squared() / 6.0;
    if p2 <= f64::MIN_POSITIVE {
        return Eigen {
            values: [mean; 3],
            normal: Vector3::z(),
        };
    }
    let p = p2.sqrt();
    let half_det = (b / p).determinant() * 0.5;
    let angle = half_det.clamp(-1.0, 1.0).acos() / 3.0;
    let largest = mean + 2.0 * p * angle.cos();
    let smallest = mean + 2.0 * p * (angle + 2.0 * std::f64::consts::FRAC_PI_3).cos();
    let middle = 3.0 * mean - largest - smallest;
    Eigen {
        values: [smallest, middle, largest],
        normal: null_vector(a, smallest),
    }
}

/// Eigenvalues in increasing order, and their eigenvectors.
pub fn axes(a: &Matrix3<f64>) -> ([f64; 3], [Vector3<f64>; 3]) {
    let e = eigen(a);
    let [u, v] = so3::orthogonal_pair(&e.normal);
    // Across the first eigenvector the matrix is 2 × 2.
    let (uu, uv, vv) = (u.dot(&(a * u)), u.dot(&(a * v)), v.dot(&(a * v)));
    let (sin, cos) = (0.5 * (2.0 * uv).atan2(uu - vv)).sin_cos();
    let (largest, middle) = (u * cos + v * sin, v * cos - u * sin);
    (e.values, [e.normal, middle, largest])
}

/// Unit vector in the null space of `a − λ`: the longest cross product of two of its rows.
fn null_vector(a: &Matrix3<f64>, lambda: f64) -> Vector3<f64> {
    let m = a - Matrix3::from_diagonal_element(lambda);
    let rows = [m.column(0), m.column(1), m.column(2)];
    let crosses = [
        rows[0].cross(&rows[1]),
        rows[1].cross(&rows[2]),
        rows[2].cross(&rows[0]),
    ];
    let mut best = crosses[0];
    for c in &crosses[1..] {
        if c.norm_squared() > best.norm_squared() {
            best = *c;
        }
    }
    best.try_normalize(0.0).unwrap_or_else(Vector3::z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn eigenvectors_rebuild_the_matrix(
            l1 in 1e-4..1e-2_f64, f2 in 1.5..20.0_f64, f3 in 1.5..20.0_f64,
            a in -3.0..3.0_f64, b in -3.0..3.0_f64, c in -3.0..3.0_f64,
        ) {
            let diagonal = Vector3::new(l1, l1 * f2, l1 * f2 * f3);
            let R = UnitQuaternion::from_euler_angles(a, b, c).to_rotation_matrix().into_inner();
            let m = R * Matrix3::from_diagonal(&diagonal) * R.transpose();
            let (values, vectors) = axes(&m);
            let rebuilt: Matrix3<f64> = (0..3).map(|i| vectors[i] * vectors[i].transpose() * values[i]).sum();
            prop_assert!((rebuilt - m).norm() < 1e-9 * m.norm());
        }

        #[test]
        fn values_and_normal_of_a_rotated_ellipsoid_are_found(
            l1 in 1e-5..1e-2_f64, f2 in 1.5..50.0_f64, f3 in 1.0..50.0_f64,
            a in -3.0..3.0_f64, b in -3.0..3.0_f64, c in -3.0..3.0_f64,
        ) {
            let values = [l1, l1 * f2, l1 * f2 * f3];
            let R = UnitQuaternion::from_euler_angles(a, b, c).to_rotation_matrix().into_inner();
            let m = R * Matrix3::from_diagonal(&Vector3::from(values)) * R.transpose();
            let e = eigen(&m);
            for (got, expected) in e.values.iter().zip(values) {
                prop_assert!((got - expected).abs() < 1e-12 * values[2].max(1.0));
            }
            prop_assert!(e.normal.cross(&R.column(0).into_owned()).norm() < 1e-6);
        }
    }

    #[test]
    fn degenerate_matrices_give_finite_answers() {
        for m in [
            Matrix3::zeros(),
            Matrix3::identity(),
            Matrix3::from_element(1.0),
        ] {
            let e = eigen(&m);
            assert!(e.values.iter().all(|v| v.is_finite()));
            assert!((e.normal.norm() - 1.0).abs() < 1e-12);
        }
    }
}
