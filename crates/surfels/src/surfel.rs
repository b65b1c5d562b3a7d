// SPDX-License-Identifier: MIT OR Apache-2.0
//! The surfels of a stretch of time, as a structure of arrays.

use nalgebra::{Matrix3, Vector3};

/// Surfels in the lidar frame at their mean stamps, grouped by level.
#[derive(Clone, Debug, Default)]
pub struct SurfelSet {
    /// Mean position, m, lidar frame.
    pub means: Vec<Vector3<f64>>,
    /// Covariance of the points, m², lidar frame.
    pub covariances: Vec<Matrix3<f64>>,
    /// Unit normal, turned to the sensor, lidar frame.
    pub normals: Vec<Vector3<f64>>,
    /// Mean stamp, s, lidar clock.
    pub stamps: Vec<f64>,
    /// Mean encoder angle, rad; zero for heads without motor.
    pub angles: Vec<f64>,
    /// Number of points.
    pub n_points: Vec<u32>,
    /// Surfels of level `l` are `level_starts[l] .. level_starts[l + 1]`.
    pub level_starts: Vec<usize>,
    /// Voxel size of each level, m.
    pub voxel_sizes: Vec<f64>,
}

impl SurfelSet {
    /// Number of surfels.
    pub fn len(&self) -> usize {
        self.means.len()
    }

    /// Whether there are no surfels.
    pub fn is_empty(&self) -> bool {
        self.means.is_empty()
    }

    /// Number of levels.
    pub fn n_levels(&self) -> usize {
        self.voxel_sizes.len()
    }

    /// Indices of the surfels of `level`.
    pub fn level(&self, level: usize) -> std::ops::Range<usize> {
        self.level_starts[level]..self.level_starts[level + 1]
    }

    /// Gives back what the vectors hold beyond their contents; sets are kept for hours.
    pub(crate) fn shrunk(mut self) -> Self {
        self.means.shrink_to_fit();
        self.covariances.shrink_to_fit();
        self.normals.shrink_to_fit();
        self.stamps.shrink_to_fit();
        self.angles.shrink_to_fit();
        self.n_points.shrink_to_fit();
        self
    }

    /// The surfels that `keep` marks.
    pub(crate) fn filtered(self, keep: &[bool]) -> Self {
        fn kept<T>(values: Vec<T>, keep: &[bool]) -> Vec<T> {
            values
                .into_iter()
                .zip(keep)
                .filter(|(_, k)| **k)
                .map(|(v, _)| v)
                .collect()
        }
        let count = |end: &usize| keep[..*end].iter().filter(|k| **k).count();
        Self {
            level_starts: self.level_starts.iter().map(count).collect(),
            means: kept(self.means, keep),
            covariances: kept(self.covariances, keep),
            normals: kept(self.normals, keep),
            stamps: kept(self.stamps, keep),
            angles: kept(self.angles, keep),
            n_points: kept(self.n_points, keep),
            voxel_sizes: self.voxel_sizes,
        }
    }
}
