// SPDX-License-Identifier: MIT OR Apache-2.0
//! Two observations of a patch lie in one plane: `e = nᵀ (μ_i − μ_j)` (Kaul 2015, eq. 5–6).

#![allow(
    clippy::inline_always,
    reason = "only what is inlined into a dispatched function uses the machine's instructions"
)]

use bentwing_trajectory::{Head, Motor, MotorErrors, so3};
use bentwing_voxels::sym3;
use nalgebra::{Matrix3, Vector3};

use crate::index;
use crate::placed::PlacedSurfel;

/// The plane of a match: normal and weight from the sum of both covariances.
#[derive(Clone, Copy, Debug)]
pub struct MatchPlane {
    /// Eigenvector of the smallest eigenvalue of `S_i + S_j`, towards the sensor, in the IMU frame at
    /// the time of the surfel, with which it turns from iteration to iteration.
    normal_imu: Vector3<f64>,
    /// `ξ² = 1 / (σ_r² + λ1 (1 + q))`, m⁻².
    pub information: f64,
}

impl MatchPlane {
    /// The plane between two surfels.
    ///
    /// Further than eq. 6 goes: λ1, the roughness of both patches, also lets the normal turn, and an
    /// error of the normal counts with the way between the means. In units of the patches' own
    /// extents that way is `q = dᵀ S⁻¹ d` in the plane; the plane extrapolated so far is uncertain by
    /// `λ1 q`. Without it narrow patches far apart are too certain of the sensor's yaw.
    pub fn new(surfel: &PlacedSurfel, other: &PlacedSurfel, range_sigma: f64) -> Self {
        let covariance = surfel.covariance + other.covariance;
        let eigen = sym3::eigen(&covariance);
        let roughness = eigen.values[0].max(0.0);
        let q = distance_in_plane(&covariance, &eigen, &(surfel.mean - other.mean));
        let side = eigen.normal.dot(&surfel.normal).signum();
        Self {
            normal_imu: surfel.R_map_imu.tr_mul(&eigen.normal) * side,
            information: 1.0 / (range_sigma * range_sigma + roughness * (1.0 + q)),
        }
    }

    /// The unit normal, map frame.
    #[inline(always)]
    pub fn normal(&self, surfel: &PlacedSurfel) -> Vector3<f64> {
        surfel.R_map_imu * self.normal_imu
    }
}

/// Squared Mahalanobis distance of `apart` within the plane of the two larger eigenvalues.
fn distance_in_plane(covariance: &Matrix3<f64>, eigen: &sym3::Eigen, apart: &Vector3<f64>) -> f64 {
    let n = &eigen.normal;
    let along = apart - n * n.dot(apart);
    let [_, l2, l3] = eigen.values;
    // The inverse in two dimensions, after Cayley and Hamilton.
    let q = ((l2 + l3) * along.norm_squared() - along.dot(&(covariance * along))) / (l2 * l3);
    q.max(0.0)
}

/// Writes `sign · ∂(nᵀ μ)/∂(control points)` for the four control points of `surfel`.
///
/// `∂μ/∂[δr, δt] = B_m [−l×, I]`, with l the lever from the IMU, so the row is `B_m [l × n, n]`.
#[inline(always)]
pub fn write_knots(knots: &mut [f64], surfel: &PlacedSurfel, n: &Vector3<f64>, sign: f64) {
    let turn = surfel.lever.cross(n);
    for (entries, w) in knots.chunks_exact_mut(6).zip(surfel.basis.weights) {
        let w = sign * w;
        for c in 0..3 {
            entries[c] = w * turn[c];
            entries[3 + c] = w * n[c];
        }
    }
}

/// Adds `sign · ∂(nᵀ μ)/∂(global states)` to the entries of the states from the `first` one on.
#[inline(always)]
pub fn add_globals(
    globals: &mut [f64],
    first: usize,
    head: &Head,
    surfel: &PlacedSurfel,
    n: &Vector3<f64>,
    sign: f64,
) {
    let n_imu = surfel.R_map_imu.tr_mul(n);
    let turned = surfel.R_map_imu.tr_mul(&surfel.lever) - head.T_imu_base.translation.vector;
    // The surfel is looked up at stamp − latency: a larger latency moves it back along its path.
    let passed = sign * n.dot(&surfel.velocity);
    globals[index::LATENCY - first] -= passed;
    globals[index::LATENCY_RATE - first] -= passed * surfel.clock_age;
    let rotation = turned.cross(&n_imu);
    for c in 0..3 {
        globals[index::EXTRINSIC_ROTATION.start - first + c] += sign * rotation[c];
        globals[index::EXTRINSIC_TRANSLATION.start - first + c] += sign * n_imu[c];
    }
    let nearer = -sign * n.dot(&surfel.sight.ray);
    globals[index::RANGE_OFFSET - first] += nearer;
    globals[index::RANGE_GRAZING - first] += nearer * surfel.sight.slant;
    if let Some(motor) = &head.motor {
        let to_base = head.T_imu_base.rotation.inverse();
        let (n_base, p_base) = (to_base * n_imu, to_base * turned);
        let globals = &mut globals[index::MOTOR.start - first..];
        add_motor(globals, motor, surfel, &n_base, &p_base, sign);
    }
}

/// The same of the states of a motor, with normal and mean in its frame before it turns.
#[inline(always)]
fn add_motor(
    globals: &mut [f64],
    motor: &Motor,
    surfel: &PlacedSurfel,
    n_base: &Vector3<f64>,
    p_base: &Vector3<f64>,
    sign: f64,
) {
    // Seen from the shaft as it leans.
    let lean = motor.lean(surfel.angle);
    let upright = so3::exp(&-lean);
    let (n, p) = (upright * n_base, upright * p_base);
    let of_turn = MotorErrors::harmonics(surfel.angle);
    let by_angle = sign * n.dot(&motor.axis.cross(&p));
    globals[index::ENCODER_ZERO] += by_angle;
    for (k, h) in of_turn[..2].iter().enumerate() {
        globals[index::ECCENTRICITY.start + k] += by_angle * h;
    }
    // Of `Exp(lean + δ) ≈ Exp(lean) Exp(J δ)` the way of the mean along the normal is `(Jᵀ (p × n)) · δ`.
    let by_lean = so3::right_jacobian_of_small(&lean).tr_mul(&p.cross(&n));
    let n_rotor = motor.spin(surfel.angle).inverse() * n;
    let arm = motor.T_motor_lidar.rotation * surfel.mean_lidar;
    for (k, u) in so3::orthogonal_pair(&motor.axis).iter().enumerate() {
        let size = sign * u.dot(&by_lean);
        for (i, h) in of_turn.iter().enumerate() {
            globals[index::WOBBLE.start + 4 * k + i] += size * h;
        }
        globals[index::MOTOR_TILT.start + k] += sign * n_rotor.dot(&u.cross(&arm));
        globals[index::MOTOR_OFFSET.start + k] += sign * n_rotor.dot(u);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RowGroup;
    use crate::constraints::testing::{Scene, assert_row};
    use crate::placed::place;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_distance_in_the_plane_is_measured_in_its_extents(
            turn in prop::array::uniform3(-3.0..3.0_f64),
            extents in prop::array::uniform2(0.01..1.0_f64),
            apart in prop::array::uniform3(-2.0..2.0_f64),
        ) {
            let (R, [a, b]) = (so3::exp(&turn.into()).to_rotation_matrix(), extents);
            let covariance = R * Matrix3::from_diagonal(&Vector3::new(1e-5, a * a, b * b)) * R.inverse();
            let apart = Vector3::from(apart);
            let q = distance_in_plane(&covariance, &sym3::eigen(&covariance), &(R * apart));
            let expected = (apart.y / a).powi(2) + (apart.z / b).powi(2);
            prop_assert!((q - expected).abs() < 1e-6 * (1.0 + expected), "{q} {expected}");
        }

        /// The model is eq. 3: the correction at the surfel's own time turns its lever and moves it.
        #[test]
        fn the_jacobian_agrees_with_central_differences(scene in Scene::any(), i in 0..8_usize) {
            let set = Scene::surfels();
            let spline = scene.spline();
            let mut surfel = place(&set, i, &scene.trajectory, &scene.globals);
            surfel.basis = spline.basis(surfel.time);
            let n = Vector3::new(0.48, -0.6, 0.64);
            let first = surfel.basis.first;
            let mut group = RowGroup::new(first..first + 4);
            write_knots(group.knots_mut(), &surfel, &n, 1.0);
            add_globals(group.globals_mut(), 0, &scene.globals.head, &surfel, &n, 1.0);
            assert_row(&scene, &group, |controls, globals| {
                let moved = place(&set, i, &scene.trajectory, globals);
                let d = spline.evaluate(controls, surfel.time);
                let turn = so3::exp(&Vector3::new(d[0], d[1], d[2]));
                n.dot(&(moved.mean - moved.lever + turn * moved.lever + Vector3::new(d[3], d[4], d[5])))
            })?;
        }
    }
}
