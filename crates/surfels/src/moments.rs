// SPDX-License-Identifier: MIT OR Apache-2.0
//! Running sums over points: count, time, motor angle, position and second moments.

use nalgebra::{Matrix3, Vector3};

/// Sums over the points of one cell of space and time.
#[derive(Clone, Copy, Debug)]
pub struct Moments {
    n: u32,
    first_time: f64,
    last_time: f64,
    time: f64,
    angle: f64,
    sum: [f64; 3],
    /// xx, xy, xz, yy, yz, zz.
    products: [f64; 6],
}

impl Moments {
    /// Moments of one point; `p` is relative to an origin that all merged moments share.
    pub fn of_point(p: [f64; 3], time: f64, angle: f64) -> Self {
        let [x, y, z] = p;
        Self {
            n: 1,
            first_time: time,
            last_time: time,
            time,
            angle,
            sum: p,
            products: [x * x, x * y, x * z, y * y, y * z, z * z],
        }
    }

    /// Adds a point that is not earlier than the first one.
    #[inline]
    pub fn add_point(&mut self, p: [f64; 3], time: f64, angle: f64) {
        let [x, y, z] = p;
        self.n += 1;
        self.last_time = self.last_time.max(time);
        self.time += time;
        self.angle += angle;
        for (a, b) in self.sum.iter_mut().zip(p) {
            *a += b;
        }
        let products = [x * x, x * y, x * z, y * y, y * z, z * z];
        for (a, b) in self.products.iter_mut().zip(products) {
            *a += b;
        }
    }

    /// Adds the points of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.n += other.n;
        self.first_time = self.first_time.min(other.first_time);
        self.last_time = self.last_time.max(other.last_time);
        self.time += other.time;
        self.angle += other.angle;
        for (a, b) in self.sum.iter_mut().zip(other.sum) {
            *a += b;
        }
        for (a, b) in self.products.iter_mut().zip(other.products) {
            *a += b;
        }
    }

    /// Number of points.
    pub fn n(&self) -> u32 {
        self.n
    }

    /// Times of the first and the last point, s.
    pub fn span(&self) -> (f64, f64) {
        (self.first_time, self.last_time)
    }

    /// Mean time, s.
    pub fn mean_time(&self) -> f64 {
        self.time / f64::from(self.n)
    }

    /// Mean motor angle, rad.
    pub fn mean_angle(&self) -> f64 {
        self.angle / f64::from(self.n)
    }

    /// Mean position relative to the shared origin, m.
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merged_moments_are_those_of_all_points() {
        let points = [
            [1.0, 2.0, 3.0],
            [2.0, 0.0, 1.0],
            [0.0, 1.0, -1.0],
            [5.0, 5.0, 5.0],
        ];
        let mut left = Moments::of_point(points[0], 0.3, 1.0);
        left.merge(&Moments::of_point(points[1], 0.1, 2.0));
        let mut right = Moments::of_point(points[2], 0.2, 3.0);
        right.merge(&Moments::of_point(points[3], 0.4, 6.0));
        left.merge(&right);
        assert_eq!(left.n(), 4);
        assert_eq!(left.span(), (0.1, 0.4));
        assert!((left.mean_time() - 0.25).abs() < 1e-15);
        assert!((left.mean_angle() - 3.0).abs() < 1e-15);
        assert_eq!(left.mean(), Vector3::new(2.0, 2.0, 2.0));
        let direct = points.iter().map(|p| Vector3::from(*p) - left.mean());
        let direct: Matrix3<f64> = direct.map(|d| d * d.transpose() / 4.0).sum();
        assert!((left.covariance() - direct).norm() < 1e-14);
    }
}
