// SPDX-License-Identifier: MIT OR Apache-2.0
//! Running sums over points: count, position and second moments.

use nalgebra::{Matrix3, Vector3};

use crate::sym3::{self, Eigen};

/// Fewer points in a voxel of a map show no shape.
pub const MIN_POINTS: u32 = 6;
/// The middle standard deviation, in voxels, below which the points of a map's voxel are one scan line:
/// the surface is then free to turn about it. Along a surface points end where the voxel does or where
/// the scan lines lay, and an edge of the voxel filled evenly has 0.29; so whatever is wider than this
/// is no shape of the surface.
pub const MIN_WIDTH: f64 = 0.07;

/// Entries of `products`.
const PAIRS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Sums over the points of one voxel, relative to an origin that all merged moments share.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moments {
    n: u32,
    sum: [f64; 3],
    /// xx, xy, xz, yy, yz, zz.
    products: [f64; 6],
}

impl Moments {
    /// Moments of one point.
    #[inline]
    pub fn of_point(p: [f64; 3]) -> Self {
        Self {
            n: 1,
            sum: p,
            products: PAIRS.map(|(i, j)| p[i] * p[j]),
        }
    }

    /// Adds a point.
    #[inline]
    pub fn add_point(&mut self, p: [f64; 3]) {
        self.merge(&Self::of_point(p));
    }

    /// Adds the points of `other`.
    #[inline]
    pub fn merge(&mut self, other: &Self) {
        self.n += other.n;
        for (a, b) in self.sum.iter_mut().zip(other.sum) {
            *a += b;
        }
        for (a, b) in self.products.iter_mut().zip(other.products) {
            *a += b;
        }
    }

    /// These moments about another origin, from which this one is at `shift`.
    #[must_use]
    pub fn shifted(&self, shift: [f64; 3]) -> Self {
        let (n, s) = (f64::from(self.n), self.sum);
        let mut moved = *self;
        for axis in 0..3 {
            moved.sum[axis] = s[axis] + n * shift[axis];
        }
        for (product, (i, j)) in moved.products.iter_mut().zip(PAIRS) {
            *product = *product + s[i] * shift[j] + shift[i] * s[j] + n * shift[i] * shift[j];
        }
        moved
    }

    /// Number of points.
    pub fn n(&self) -> u32 {
        self.n
    }

    /// Mean position, m.
    pub fn mean(&self) -> Vector3<f64> {
        Vector3::from(self.sum) / f64::from(self.n)
    }

    /// Covariance of the positions (divided by n), m².
    pub fn covariance(&self) -> Matrix3<f64> {
        let n = f64::from(self.n);
        let m = self.mean();
        let [xx, xy, xz, yy, yz, zz] = self.products.map(|s| s / n);
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) - m * m.transpose()
    }

    /// Variances along the principal axes, m², and the normal of the plane through the points.
    pub fn eigen(&self) -> Eigen {
        sym3::eigen(&self.covariance())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn of_all(points: &[[f64; 3]]) -> Moments {
        let mut sums = Moments::default();
        for &p in points {
            sums.add_point(p);
        }
        sums
    }

    #[test]
    fn merged_moments_are_those_of_all_points() {
        let points = [
            [1.0, 2.0, 3.0],
            [2.0, 0.0, 1.0],
            [0.0, 1.0, -1.0],
            [5.0, 5.0, 5.0],
        ];
        let mut left = of_all(&points[..2]);
        left.merge(&of_all(&points[2..]));
        assert_eq!(left.n(), 4);
        assert_eq!(left.mean(), Vector3::new(2.0, 2.0, 2.0));
        let direct = points.iter().map(|p| Vector3::from(*p) - left.mean());
        let direct: Matrix3<f64> = direct.map(|d| d * d.transpose() / 4.0).sum();
        assert!((left.covariance() - direct).norm() < 1e-14);
    }

    proptest! {
        #[test]
        fn moments_can_be_moved_to_another_origin(
            points in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 1..30),
            shift in prop::array::uniform3(-2.0..2.0_f64),
        ) {
            let there: Vec<_> = points.iter().map(|p| [0, 1, 2].map(|a| p[a] + shift[a])).collect();
            let (moved, there) = (of_all(&points).shifted(shift), of_all(&there));
            prop_assert!((moved.mean() - there.mean()).norm() < 1e-12);
            prop_assert!((moved.covariance() - there.covariance()).norm() < 1e-12);
        }
    }
}
