// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the matches of a window can see, and how well they fit.

use nalgebra::{Matrix3, Vector3};

/// Sums over the matches of the last iteration.
#[derive(Clone, Debug)]
pub struct Health {
    /// Matches within the window.
    pub n_moving: usize,
    /// Matches with fixed views.
    pub n_fixed: usize,
    /// `Σ w`: the effective number of matches.
    pub weight: f64,
    /// `Σ w (ξ e)²`.
    pub squared_residual: f64,
    /// Matches whose residual is below two standard deviations.
    pub n_inliers: usize,
    /// `Σ w n nᵀ`: which directions the normals cover.
    pub translation: Matrix3<f64>,
    /// `Σ w (d × n)(d × n)ᵀ`, d the unit vector from the IMU: which rotations are seen.
    pub rotation: Matrix3<f64>,
}

impl Default for Health {
    fn default() -> Self {
        Self {
            n_moving: 0,
            n_fixed: 0,
            weight: 0.0,
            squared_residual: 0.0,
            n_inliers: 0,
            translation: Matrix3::zeros(),
            rotation: Matrix3::zeros(),
        }
    }
}

impl Health {
    /// Adds a match with normalized residual `x` and Cauchy weight `w`.
    pub(crate) fn add(
        &mut self,
        is_fixed: bool,
        x: f64,
        w: f64,
        n: &Vector3<f64>,
        lever: &Vector3<f64>,
    ) {
        self.n_fixed += usize::from(is_fixed);
        self.n_moving += usize::from(!is_fixed);
        self.weight += w;
        self.squared_residual += w * x * x;
        self.n_inliers += usize::from(x.abs() < 2.0);
        self.translation += n * n.transpose() * w;
        let turn = lever.cross(n) / lever.norm().max(f64::MIN_POSITIVE);
        self.rotation += turn * turn.transpose() * w;
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.n_moving += other.n_moving;
        self.n_fixed += other.n_fixed;
        self.weight += other.weight;
        self.squared_residual += other.squared_residual;
        self.n_inliers += other.n_inliers;
        self.translation += other.translation;
        self.rotation += other.rotation;
    }
}
