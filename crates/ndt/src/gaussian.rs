// SPDX-License-Identifier: MIT OR Apache-2.0
//! The normal distribution of the surface in one voxel.

use bentwing_voxels::{MIN_POINTS, MIN_WIDTH, Moments, sym3};
use nalgebra::{Matrix3, Vector3};

/// Least cosine between the normal and the mean direction to the lidar. A single scan line that is bent,
/// over a ridge or down a wall, spreads along the plane in which the lidar turned its beam, and that
/// is no surface: it contains every ray. True surfaces seen so flatly are measured badly anyway.
const MIN_FACING: f64 = 0.2;

/// What regularizes the distributions.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Least standard deviation, m: the noise of a range.
    pub sigma: f64,
    /// Least standard deviation in voxels, the eigenvalue floor of Magnusson 2009, section 6.2.
    pub roughness: f64,
}

/// A normal distribution with the information it gives about a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gaussian {
    pub mean: Vector3<f64>,
    /// `Σ (1/λ − 1/λ_cut) u uᵀ` over the eigenvectors u, none negative, 1/m².
    pub information: Matrix3<f64>,
    /// Largest eigenvalue of `information`, 1/m².
    pub sharpest: f64,
}

impl Gaussian {
    /// Distribution of the points in a voxel of edge `size` around `middle`, if they show a surface;
    /// `facing` is the mean of their unit directions to the lidar.
    ///
    /// The inverse of the covariance would pull scans along the surface too, to where the keyframe's
    /// lines lay and so towards not having moved; what a wide distribution has is therefore taken off.
    pub(crate) fn of(
        moments: &Moments,
        facing: &Vector3<f64>,
        middle: &Vector3<f64>,
        size: f64,
        shape: &Shape,
    ) -> Option<Self> {
        if moments.n() < MIN_POINTS {
            return None;
        }
        let covariance = moments.covariance();
        let (values, axes) = sym3::axes(&covariance);
        let wide = (MIN_WIDTH * size).powi(2);
        if values[1] < wide || axes[0].dot(facing).abs() < MIN_FACING {
            return None;
        }
        let floor = shape.sigma.max(shape.roughness * size).powi(2);
        let cut = 1.0 / wide;
        let gains = values.map(|v| (1.0 / v.max(floor) - cut).max(0.0));
        if gains[0] <= 0.0 {
            return None;
        }
        let parts = axes.iter().zip(gains).map(|(u, g)| u * u.transpose() * g);
        Some(Self {
            mean: middle + moments.mean(),
            information: parts.sum(),
            sharpest: gains[0],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    const SHAPE: Shape = Shape {
        sigma: 0.02,
        roughness: 0.02,
    };

    fn moments(points: impl Iterator<Item = Vector3<f64>>) -> Moments {
        let mut sums = Moments::default();
        for p in points {
            sums.add_point(p.into());
        }
        sums
    }

    proptest! {
        #[test]
        fn a_tilted_plane_gives_information_along_its_normal_alone(a in -3.0..3.0_f64, b in -3.0..3.0_f64) {
            let R = UnitQuaternion::from_euler_angles(a, b, 0.0);
            let grid = (0..400).map(|i| R * Vector3::new(f64::from(i % 20) * 0.05 - 0.475, f64::from(i / 20) * 0.05 - 0.475, 0.0));
            let middle = Vector3::new(7.0, -3.0, 2.0);
            let facing = R * Vector3::new(0.9, 0.0, 0.3);
            let found = Gaussian::of(&moments(grid), &facing, &middle, 1.0, &SHAPE);
            prop_assert!(found.is_some());
            if let Some(g) = found {
                let n = R * Vector3::z();
                let expected_gain = 2500.0 - (MIN_WIDTH * 1.0).powi(-2);
                let expected = n * n.transpose() * expected_gain;
                prop_assert!((g.information - expected).norm() < 1e-6 * expected.norm());
                prop_assert!((g.sharpest - expected_gain).abs() < 1e-6);
                prop_assert!((g.mean - middle).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn a_scan_line_few_points_and_a_full_voxel_say_nothing() {
        let line =
            (0..40).map(|i| Vector3::new(f64::from(i) * 0.02, 0.001 * f64::from(i % 3), 0.0));
        let few = (0..5).map(|i| Vector3::new(f64::from(i % 2), f64::from(i / 2), 0.0));
        let full = (0..1000).map(|i| {
            Vector3::new(
                f64::from(i % 10),
                f64::from(i / 10 % 10),
                f64::from(i / 100),
            ) * 0.1
        });
        let (up, zero) = (Vector3::z(), Vector3::zeros());
        let of = |m: Moments| Gaussian::of(&m, &up, &zero, 1.0, &SHAPE);
        assert!(of(moments(line)).is_none());
        assert!(of(moments(few)).is_none());
        assert!(of(moments(full)).is_none());
    }

    /// Over the edge of a roof a line lies in the plane of the rays; a wall is seen from its side.
    #[test]
    fn a_bent_scan_line_says_nothing_and_a_wall_does() {
        let edge = || {
            (0..40).map(|i| {
                let s = f64::from(i) * 0.02 - 0.4;
                Vector3::new(s, 0.001 * f64::from(i % 3), -s.abs())
            })
        };
        let zero = Vector3::zeros();
        let of = |facing| Gaussian::of(&moments(edge()), &facing, &zero, 1.0, &SHAPE);
        assert!(of(Vector3::new(0.2, 0.0, 0.98)).is_none());
        assert!(of(Vector3::new(0.0, 0.8, 0.6)).is_some());
    }
}
