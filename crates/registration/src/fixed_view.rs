// SPDX-License-Identifier: MIT OR Apache-2.0
//! Surfels of an earlier stretch of the trajectory, which does not move any more.

use bentwing_neighbors::Grid;
use bentwing_surfels::SurfelSet;
use bentwing_trajectory::Trajectory;

use crate::placed::{PlacedSurfel, place};
use crate::{Globals, matches::grid_of};

/// Surfels from poses that are final (Kaul 2015, section 2.1), with their search grids.
///
/// Their places still follow the calibration: were they held where an earlier one had put them,
/// they would hold the calibration at that value.
#[derive(Clone, Debug)]
pub struct FixedView {
    /// The surfels where `globals` puts them.
    pub(crate) surfels: Vec<PlacedSurfel>,
    /// The global states when the view was frozen.
    pub(crate) globals: Globals,
    pub(crate) level_starts: Vec<usize>,
    pub(crate) grids: Vec<Grid>,
}

impl FixedView {
    /// Freezes the surfels of `set` whose stamps lie in `[from, to)`.
    pub fn freeze(
        set: &[&SurfelSet],
        from: f64,
        to: f64,
        trajectory: &Trajectory,
        globals: &Globals,
    ) -> Self {
        let voxel_sizes = set.first().map_or(Vec::new(), |s| s.voxel_sizes.clone());
        let mut view = Self {
            surfels: Vec::new(),
            globals: globals.clone(),
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
            view.surfels.extend(placed);
            view.level_starts.push(view.surfels.len());
        }
        view
    }

    /// Number of surfels.
    pub fn len(&self) -> usize {
        self.surfels.len()
    }

    /// Whether there are no surfels.
    pub fn is_empty(&self) -> bool {
        self.surfels.is_empty()
    }
}
