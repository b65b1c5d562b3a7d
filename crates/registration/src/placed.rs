// SPDX-License-Identifier: MIT OR Apache-2.0
//! Surfels placed in the map by the current trajectory and calibration.

use std::sync::Arc;

use bentwing_surfels::SurfelSet;
use bentwing_trajectory::{Basis, CorrectionSpline, Sight, Trajectory};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::Globals;
use crate::neighbors::Grid;

/// Features are searched within cells of this size, in voxels.
const CELL: f32 = 1.0;

/// Least surfels per parallel task.
const SURFELS_PER_TASK: usize = 256;

/// A surfel in the map, with what its derivatives need.
#[derive(Clone, Copy, Debug)]
pub struct PlacedSurfel {
    /// Mean, m, map frame.
    pub mean: Vector3<f64>,
    /// Covariance of the points, m², map frame.
    pub covariance: Matrix3<f64>,
    /// Unit normal towards the sensor, map frame.
    pub normal: Vector3<f64>,
    /// Time in the IMU clock, s.
    pub time: f64,
    /// Control points that move it.
    pub basis: Basis,
    /// Rotation of the IMU at that time.
    pub R_map_imu: Matrix3<f64>,
    /// Mean seen from the IMU, in the axes of the map.
    pub lever: Vector3<f64>,
    /// Velocity of the mean as a point fixed to the IMU, m/s, map frame.
    pub velocity: Vector3<f64>,
    /// Its stamp since the epoch of the lidar's clock, s.
    pub clock_age: f64,
    /// Encoder angle, rad.
    pub angle: f64,
    /// Mean in the lidar frame, m.
    pub mean_lidar: Vector3<f64>,
    /// How it was looked at, map frame.
    pub sight: Sight,
}

/// Surfels of several sets in the map, grouped by level.
#[derive(Clone, Debug)]
pub struct Placed {
    /// The surfels; those of level `l` are `level_starts[l] .. level_starts[l + 1]`.
    pub surfels: Vec<PlacedSurfel>,
    /// First surfel of each level, and the number of surfels.
    pub level_starts: Vec<usize>,
    /// Voxel size of each level, m.
    pub voxel_sizes: Vec<f64>,
}

impl Placed {
    /// Places the surfels of `sets`, which have the same levels.
    pub fn new(
        sets: &[Arc<SurfelSet>],
        trajectory: &Trajectory,
        globals: &Globals,
        spline: &CorrectionSpline,
    ) -> Self {
        let voxel_sizes = sets.first().map_or(Vec::new(), |s| s.voxel_sizes.clone());
        let mut sources = Vec::new();
        let mut level_starts = vec![0];
        for level in 0..voxel_sizes.len() {
            for set in sets {
                sources.extend(set.level(level).map(|i| (set.as_ref(), i)));
            }
            level_starts.push(sources.len());
        }
        let place = |&(set, i): &(&SurfelSet, usize)| {
            let mut placed = place(set, i, trajectory, globals);
            placed.basis = spline.basis(placed.time);
            placed
        };
        let mut surfels = Vec::new();
        let tasks = sources.par_iter().with_min_len(SURFELS_PER_TASK);
        tasks.map(place).collect_into_vec(&mut surfels);
        Self {
            surfels,
            level_starts,
            voxel_sizes,
        }
    }

    /// Indices of the surfels of `level`.
    pub fn level(&self, level: usize) -> std::ops::Range<usize> {
        self.level_starts[level]..self.level_starts[level + 1]
    }
}

/// The search grid of placed surfels of one level.
pub fn grid_of(surfels: &[PlacedSurfel], voxel_size: f64) -> Grid {
    let positions: Vec<[f32; 3]> = surfels
        .iter()
        .map(|s| (s.mean / voxel_size).cast::<f32>().into())
        .collect();
    let normals: Vec<[f32; 3]> = surfels
        .iter()
        .map(|s| s.normal.cast::<f32>().into())
        .collect();
    let times: Vec<f64> = surfels.iter().map(|s| s.time).collect();
    Grid::new(&positions, &normals, &times, CELL)
}

/// Places surfel `i` of `set`; its basis is left to the caller.
pub fn place(
    set: &SurfelSet,
    i: usize,
    trajectory: &Trajectory,
    globals: &Globals,
) -> PlacedSurfel {
    let clock = &globals.head.clock;
    let time = clock.measured(set.stamps[i]);
    let pose = trajectory.pose(time);
    let (v, omega) = trajectory.velocity(time);
    let (R_imu_lidar, t_imu_lidar) = globals.head.lidar_in_imu(set.angles[i]);
    let sight = Sight::of(&set.means[i], &set.normals[i]);
    let mean_lidar = set.means[i] - sight.ray * globals.head.ranges.error(&sight);
    let lever = pose.R * (R_imu_lidar * mean_lidar + t_imu_lidar);
    let R_map_lidar = pose.R * R_imu_lidar;
    PlacedSurfel {
        mean: pose.p + lever,
        covariance: R_map_lidar * set.covariances[i] * R_map_lidar.transpose(),
        normal: R_map_lidar * set.normals[i],
        time,
        basis: Basis {
            first: 0,
            weights: [0.0; 4],
        },
        R_map_imu: pose.R,
        lever,
        velocity: v + omega.cross(&lever),
        clock_age: set.stamps[i] - clock.epoch,
        angle: set.angles[i],
        mean_lidar,
        sight: Sight {
            ray: R_map_lidar * sight.ray,
            ..sight
        },
    }
}
