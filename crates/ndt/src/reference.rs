// SPDX-License-Identifier: MIT OR Apache-2.0
//! What scans are registered to: the surfaces that keyframes have seen, on several levels.

use nalgebra::{Isometry3, Vector3};
use rayon::prelude::*;

use crate::gaussian::{Gaussian, Shape};
use crate::grid::Grid;

/// The surfaces of the keyframes, in the map, from fine voxels to coarse ones.
#[derive(Clone, Debug)]
pub struct Reference {
    levels: Vec<Grid>,
    shape: Shape,
}

impl Reference {
    /// An empty reference with voxels of `voxel_size`, m, on the finest of `n_levels`, doubling.
    pub fn new(voxel_size: f64, n_levels: usize, shape: Shape) -> Self {
        let size = |level| voxel_size * f64::from(1_u32 << level);
        Self {
            levels: (0..n_levels as u32).map(|l| Grid::new(size(l))).collect(),
            shape,
        }
    }

    /// Number of levels.
    pub fn n_levels(&self) -> usize {
        self.levels.len()
    }

    /// Edge of the voxels of a level, m.
    pub(crate) fn size(&self, level: usize) -> f64 {
        self.levels[level].size()
    }

    /// Number of distributions on all levels.
    pub fn n_surfaces(&self) -> usize {
        self.levels.iter().map(Grid::n_surfaces).sum()
    }

    /// Adds the points of a keyframe, `T_map_scan` being its pose and `lidar`, m, map frame, the place
    /// from which they were seen.
    pub fn insert(
        &mut self,
        points: &[[f64; 3]],
        T_map_scan: &Isometry3<f64>,
        lidar: &Vector3<f64>,
    ) {
        let placed: Vec<[f64; 3]> = (points.par_iter())
            .map(|p| T_map_scan.transform_point(&(*p).into()).coords.into())
            .collect();
        let shape = self.shape;
        (self.levels.par_iter_mut()).for_each(|level| level.insert(&placed, lidar, &shape));
    }

    /// Forgets what is farther than `radius`, m, from `centre`, map frame.
    pub fn keep_within(&mut self, centre: &Vector3<f64>, radius: f64) {
        (self.levels.par_iter_mut()).for_each(|level| level.keep_within(centre, radius));
    }

    /// The finest distribution at a place in the map, from a level on, and its level.
    #[inline]
    pub(crate) fn at(&self, p: &[f64; 3], finest: usize) -> Option<(usize, &Gaussian)> {
        let mut levels = self.levels.iter().enumerate().skip(finest);
        levels.find_map(|(level, grid)| grid.at(p).map(|surface| (level, surface)))
    }
}
