// SPDX-License-Identifier: MIT OR Apache-2.0
//! Surfels of an earlier stretch of the trajectory, which does not move any more.

use bentwing_surfels::SurfelSet;
use bentwing_trajectory::Trajectory;
use nalgebra::Vector3;

use crate::neighbors::Grid;
use crate::placed::{PlacedSurfel, grid_of, place};
use crate::{Globals, PoseResponse};

/// Surfels from poses that are final (Kaul 2015, section 2.1), with their search grids.
///
/// Their places still follow the calibration, and so do the poses they were seen from: were they
/// held where an earlier one had put them, they would hold the calibration at that value.
#[derive(Clone, Debug)]
pub struct FixedView {
    /// The surfels where `globals` puts them.
    pub(crate) surfels: Vec<PlacedSurfel>,
    /// The global states when the view was frozen.
    pub(crate) globals: Globals,
    /// How the poses of the surfels follow the global states.
    responses: Vec<PoseResponse>,
    /// Which response each surfel has.
    poses: Vec<usize>,
    pub(crate) level_starts: Vec<usize>,
    pub(crate) grids: Vec<Grid>,
}

impl FixedView {
    /// Freezes the surfels of `set` whose stamps lie in `[from, to)`.
    ///
    /// `responses` are those of the samples of `trajectory`; without any its poses stay.
    pub fn freeze(
        set: &[&SurfelSet],
        from: f64,
        to: f64,
        trajectory: &Trajectory,
        responses: &[PoseResponse],
        globals: &Globals,
    ) -> Self {
        let voxel_sizes = set.first().map_or(Vec::new(), |s| s.voxel_sizes.clone());
        let sample = |stamp: f64| trajectory.locate(globals.head.clock.measured(stamp)).0;
        let (first, last) = (sample(from), sample(to));
        let mut view = Self {
            surfels: Vec::new(),
            globals: globals.clone(),
            responses: responses.get(first..=last).unwrap_or(&[]).to_vec(),
            poses: Vec::new(),
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
            let poses = placed.iter().map(|s| trajectory.locate(s.time).0 - first);
            view.poses.extend(poses);
            view.grids.push(grid_of(&placed, *size));
            view.surfels.extend(placed);
            view.level_starts.push(view.surfels.len());
        }
        view
    }

    /// Adds `sign · ∂(nᵀ μ)/∂(global states)` of surfel `j`, of its pose's part.
    #[inline(always)]
    #[allow(
        clippy::inline_always,
        reason = "only what is inlined into a dispatched function uses the machine's instructions"
    )]
    pub(crate) fn add_pose_response(
        &self,
        globals: &mut [f64],
        j: usize,
        n: &Vector3<f64>,
        sign: f64,
    ) {
        let Some(response) = self.responses.get(self.poses[j]) else {
            return;
        };
        let turn = self.surfels[j].lever.cross(n);
        let row = [turn.x, turn.y, turn.z, n.x, n.y, n.z];
        for (weight, part) in row.iter().zip(response) {
            for (to, entry) in globals.iter_mut().zip(part) {
                *to += sign * weight * entry;
            }
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraints::surfel_match::add_globals;
    use crate::constraints::testing::Scene;
    use crate::{N_GLOBALS, follow};
    use proptest::prelude::*;

    proptest! {
        /// The calibration moves a frozen surfel itself, and the pose it was seen from.
        #[test]
        fn the_jacobian_agrees_with_central_differences(
            scene in Scene::any(), j in 0..8_usize, g in 0..N_GLOBALS,
        ) {
            let set = Scene::surfels();
            let response: PoseResponse = std::array::from_fn(|i| {
                std::array::from_fn(|g| 0.3 * (1.0 + i as f64 + 0.7 * g as f64).sin())
            });
            let responses = vec![response; scene.trajectory.len()];
            let (from, to) = (2.0, 2.5);
            let freeze = |step: f64| {
                let mut delta = [0.0; N_GLOBALS];
                delta[g] = step;
                let (mut globals, mut trajectory) = (scene.globals.clone(), scene.trajectory.clone());
                globals.correct(&delta);
                follow(&mut trajectory, &responses, &delta);
                FixedView::freeze(&[&set], from, to, &trajectory, &responses, &globals)
            };
            let n = Vector3::new(0.48, -0.6, 0.64);
            let view = freeze(0.0);
            let mut row = [0.0; N_GLOBALS];
            add_globals(&mut row, 0, &scene.globals.head, &view.surfels[j], &n, 1.0);
            view.add_pose_response(&mut row, j, &n, 1.0);
            let step = 1e-5;
            let along = |s: f64| n.dot(&freeze(s).surfels[j].mean);
            let slope = (along(step) - along(-step)) / (2.0 * step);
            prop_assert!((row[g] - slope).abs() < 1e-5 * (1.0 + slope.abs()), "{} {slope}", row[g]);
        }
    }
}
