// SPDX-License-Identifier: MIT OR Apache-2.0
//! How surfaces bend, from the normals of neighbouring surfels.
//!
//! The mean of the points on a bent patch does not lie on the surface, but behind it by what grows
//! with the extent of the patch. Two observations of a patch have different extents: a trunk is seen
//! from afar in a few lines across its whole width, from nearby in pieces. So their means differ along
//! the normal, always with the same sign from far to near: where hardly anything is plane, the
//! trajectory would come out too large.

use bentwing_trajectory::so3;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::neighbors::Neighbors;
use crate::placed::PlacedSurfel;

/// Neighbours that tell how a surface bends.
pub const N_NEIGHBORS: usize = 8;

/// Expected curvature, in one over the voxel size.
const EXPECTED: f64 = 2.0;

/// Standard deviation of the components of a normal.
const NORMAL_SIGMA: f64 = 0.07;

/// Of points spread evenly over a diameter: their variance in units of the radius squared.
const HALF_A_CIRCLE: f64 = 1.0 / 3.0;

/// Surfels per parallel task.
const SURFELS_PER_TASK: usize = 256;

/// How a surface bends.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bend {
    /// Shape operator in the map frame, 1/m, positive where it bends away from the sensor.
    pub shape: Matrix3<f64>,
    /// What tells it: squared distances of the neighbours, m².
    pub known: f64,
}

/// How the surface bends at each surfel of a level that was searched in itself.
pub fn bends(surfels: &[PlacedSurfel], nearest: &Neighbors, voxel_size: f64) -> Vec<Bend> {
    let bend = |(i, surfel)| {
        let neighbors = nearest.of(i).iter().map(|&j| &surfels[j as usize]);
        bend_at(surfel, neighbors, voxel_size)
    };
    let mut found = Vec::new();
    let surfels = surfels.par_iter().with_min_len(SURFELS_PER_TASK);
    surfels.enumerate().map(bend).collect_into_vec(&mut found);
    found
}

/// The shape operator between two surfels.
pub fn between(a: &Bend, b: &Bend) -> Matrix3<f64> {
    let known = a.known + b.known;
    if known > 0.0 {
        (a.shape * a.known + b.shape * b.known) / known
    } else {
        Matrix3::zeros()
    }
}

/// How far behind the surface the mean of points with this covariance lies, m.
///
/// Of a paraboloid `½ tr(W S)`. The rest is for trunks seen in their whole width: with `x = W² λ` it is
/// that of an arc with radius `1/W` whose points spread evenly with variance λ, to 2 %.
pub fn depth(bend: &Matrix3<f64>, covariance: &Matrix3<f64>) -> f64 {
    let x = bend.dot(&(covariance * bend)).clamp(0.0, HALF_A_CIRCLE);
    0.5 * bend.dot(covariance) * (1.0 + 0.45 * x + 4.0 * x.powi(3))
}

/// Least squares of `Δn = W Δμ` in the tangent plane, for the three entries of a symmetric `W`, with
/// the expected curvature as a prior.
fn bend_at<'a>(
    surfel: &PlacedSurfel,
    neighbors: impl Iterator<Item = &'a PlacedSurfel>,
    voxel_size: f64,
) -> Bend {
    let [u, v] = so3::orthogonal_pair(&surfel.normal);
    let ridge = (NORMAL_SIGMA * voxel_size / EXPECTED).powi(2);
    let [mut uu, mut uv, mut vv] = [ridge, 0.0, ridge];
    let mut turned = Vector3::zeros();
    for other in neighbors {
        let (away, turn) = (other.mean - surfel.mean, other.normal - surfel.normal);
        let (x, y) = (u.dot(&away), v.dot(&away));
        let (a, b) = (u.dot(&turn), v.dot(&turn));
        uu += x * x;
        uv += x * y;
        vv += y * y;
        turned += Vector3::new(x * a, y * a + x * b, y * b);
    }
    let normal = Matrix3::new(uu, uv, 0.0, uv, uu + vv, uv, 0.0, uv, vv);
    let Some(w) = normal.cholesky().map(|l| l.solve(&turned)) else {
        return Bend::default();
    };
    let (u_t, v_t) = (u.transpose(), v.transpose());
    Bend {
        shape: u * u_t * w.x + (u * v_t + v * u_t) * w.y + v * v_t * w.z,
        known: uu + vv - 2.0 * ridge,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraints::surfel_match::MatchPlane;
    use bentwing_trajectory::{Basis, Sight};
    use proptest::prelude::*;

    const VOXEL: f64 = 0.4;

    fn placed(mean: Vector3<f64>, normal: Vector3<f64>) -> PlacedSurfel {
        PlacedSurfel {
            mean,
            covariance: Matrix3::zeros(),
            normal,
            time: 0.0,
            basis: Basis {
                first: 0,
                weights: [0.0; 4],
            },
            R_map_imu: Matrix3::identity(),
            lever: Vector3::zeros(),
            velocity: Vector3::zeros(),
            clock_age: 0.0,
            angle: 0.0,
            mean_lidar: Vector3::zeros(),
            sight: Sight::of(&Vector3::x(), &Vector3::x()),
        }
    }

    /// A patch of a trunk about z, whose middle is seen at `angle`.
    fn on_trunk(radius: f64, angle: f64, height: f64) -> PlacedSurfel {
        let normal = Vector3::new(angle.cos(), angle.sin(), 0.0);
        placed(normal * radius + Vector3::z() * height, normal)
    }

    /// Mean and covariance of points spread evenly across a strip of a trunk, about its middle on x.
    fn strip(radius: f64, half_width: f64) -> (Vector3<f64>, Matrix3<f64>) {
        let n = 2001;
        let point = |k: i32| {
            let y = half_width * (2.0 * f64::from(k) / f64::from(n - 1) - 1.0);
            Vector3::new((radius * radius - y * y).sqrt(), y, 0.0)
        };
        let mean = (0..n).map(point).sum::<Vector3<f64>>() / f64::from(n);
        let around = (0..n).map(|k| point(k) - mean).map(|d| d * d.transpose());
        (mean, around.sum::<Matrix3<f64>>() / f64::from(n))
    }

    proptest! {
        /// Neighbours on all sides: those in one line would not tell across from along.
        #[test]
        fn a_trunk_bends_across_and_not_along(
            radius in 0.1..0.4_f64,
            around in prop::array::uniform8((0.2..0.5_f64, 0.05..0.2_f64)),
        ) {
            let surfel = on_trunk(radius, 0.0, 0.0);
            let sides = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].into_iter().cycle();
            let others: Vec<_> = around
                .iter()
                .zip(sides)
                .map(|((angle, height), (a, z))| on_trunk(radius, a * angle, z * height))
                .collect();
            let bend = bend_at(&surfel, others.iter(), VOXEL).shape;
            // The prior takes a share that the extent of what was seen tells.
            let seen: f64 = others.iter().map(|o| o.mean.y * o.mean.y).sum();
            let ridge = (NORMAL_SIGMA * VOXEL / EXPECTED).powi(2);
            prop_assert!((bend[(1, 1)] * radius - 1.0).abs() < 0.05 + 3.0 * ridge / seen, "{bend}");
            prop_assert!(bend[(2, 2)].abs() < 1.0 && bend[(0, 0)].abs() < 1e-12, "{bend}");
        }

        #[test]
        fn a_plane_does_not_bend(offsets in prop::collection::vec(prop::array::uniform2(-0.4..0.4_f64), 1..9)) {
            let normal = Vector3::new(0.48, -0.6, 0.64);
            let [u, v] = so3::orthogonal_pair(&normal);
            let others: Vec<_> = offsets.iter().map(|o| placed(u * o[0] + v * o[1], normal)).collect();
            let bend = bend_at(&placed(Vector3::zeros(), normal), others.iter(), VOXEL);
            prop_assert!(bend.shape.norm() < 1e-9 && bend.known > 0.0);
        }

        /// Narrow and wide strips of one trunk: behind the surface by as much as their points say.
        #[test]
        fn the_depth_of_an_arc_is_that_of_its_points(radius in 0.1..0.4_f64, share in 0.05..1.0_f64) {
            let (mean, covariance) = strip(radius, share * radius);
            let mut bend = Matrix3::zeros();
            bend[(1, 1)] = 1.0 / radius;
            let expected = radius - mean.x;
            prop_assert!((depth(&bend, &covariance) - expected).abs() < 0.02 * expected);
        }
    }

    /// Seen from afar in its whole width and from nearby in a piece, a trunk stands where it stands,
    /// whichever observation comes first.
    #[test]
    fn wide_and_narrow_observations_of_a_trunk_agree() {
        let radius = 0.2;
        let of_width = |share: f64| {
            let (mean, mut covariance) = strip(radius, share * radius);
            covariance[(2, 2)] = 0.01; // as tall as a voxel
            let mut surfel = placed(mean, Vector3::x());
            surfel.covariance = covariance;
            surfel
        };
        let (far, near) = (of_width(0.95), of_width(0.5));
        let mut bend = Matrix3::zeros();
        bend[(1, 1)] = 1.0 / radius;
        for (one, other, sign) in [(&far, &near, 1.0), (&near, &far, -1.0)] {
            let plane = MatchPlane::new(one, other, 0.01);
            let error = plane.normal(one).dot(&(one.mean - other.mean));
            let offset = depth(&bend, &one.covariance) - depth(&bend, &other.covariance);
            assert!(sign * error < -0.02, "{error}");
            assert!((error + offset).abs() < 1e-3, "{error} {offset}");
        }
    }

    #[test]
    fn what_knows_more_counts_more() {
        let alone = bend_at(&on_trunk(0.2, 0.0, 0.0), [].into_iter(), VOXEL);
        assert_eq!(between(&alone, &alone), Matrix3::zeros());
        let of = |shape: f64, known| Bend {
            shape: Matrix3::identity() * shape,
            known,
        };
        assert_eq!(between(&alone, &of(5.0, 0.1)), of(5.0, 0.0).shape);
        assert_eq!(between(&of(1.0, 1.0), &of(5.0, 3.0)), of(4.0, 0.0).shape);
    }
}
