// SPDX-License-Identifier: MIT OR Apache-2.0
//! Surfels that do not move: from earlier in the trajectory, or from a prior map.

use bentwing_neighbors::Grid;
use bentwing_surfels::SurfelSet;
use bentwing_trajectory::Trajectory;
use nalgebra::{Matrix3, Vector3};

use crate::placed::place;
use crate::{Globals, matches::grid_of};

/// A set of immovable surfels in the map (Kaul 2015, section 2.1), with its search grids.
#[derive(Clone, Debug)]
pub struct FixedView {
    /// Means, m, map frame.
    pub(crate) means: Vec<Vector3<f64>>,
    /// Covariances of the points, m², map frame.
    pub(crate) covariances: Vec<Matrix3<f64>>,
    pub(crate) level_starts: Vec<usize>,
    pub(crate) grids: Vec<Grid>,
}

impl FixedView {
    /// Freezes the surfels of `set` whose stamps lie in `[from, to)` where they are now.
    pub fn freeze(
        set: &[&SurfelSet],
        from: f64,
        to: f64,
        trajectory: &Trajectory,
        globals: &Globals,
    ) -> Self {
        let voxel_sizes = set.first().map_or(Vec::new(), |s| s.voxel_sizes.clone());
        let mut view = Self {
            means: Vec::new(),
            covariances: Vec::new(),
            level_starts: vec![0],
            grids: Vec::new(),
        };
        for (level, size) in voxel_sizes.iter().enumerate() {
            let mut placed = Vec::new();
            for s in set {
                let within = s
                    .level(level)
                    .filter(|&i| (from..to).contains(&s.stamps[i]));
                placed.extend(within.map(|i| place(s, i, trajectory, globals)));
            }
            view.grids.push(grid_of(&placed, *size));
            view.means.extend(placed.iter().map(|p| p.mean));
            view.covariances.extend(placed.iter().map(|p| p.covariance));
            view.level_starts.push(view.means.len());
        }
        view
    }

    /// Number of surfels.
    pub fn len(&self) -> usize {
        self.means.len()
    }

    /// Whether there are no surfels.
    pub fn is_empty(&self) -> bool {
        self.means.is_empty()
    }
}
