// SPDX-License-Identifier: MIT OR Apache-2.0
//! Surfels as the neighbour search sees them.

use crate::Flight;

/// Halls beside each other do not touch, and share no cells' boundaries; voxels.
const HALL_STEP: f32 = 57.3;

/// Features as structure of arrays.
#[derive(Clone, Debug, Default)]
pub struct Features {
    /// Positions in the map, voxels.
    pub positions: Vec<[f32; 3]>,
    /// Normals in the map.
    pub normals: Vec<[f32; 3]>,
    /// Times, s.
    pub times: Vec<f64>,
}

impl Features {
    /// The surfels of one level of a flight.
    pub fn of(flight: &Flight, level: usize) -> Self {
        let mut features = Self::default();
        let (R_imu_lidar, t_imu_lidar) = flight.globals.head.lidar_in_imu(0.0);
        for set in flight.surfels() {
            let size = set.voxel_sizes[level];
            for i in set.level(level) {
                let pose = flight.trajectory.pose(set.stamps[i]);
                let mean = pose.p + pose.R * (R_imu_lidar * set.means[i] + t_imu_lidar);
                let normal = pose.R * (R_imu_lidar * set.normals[i]);
                features.positions.push((mean / size).cast().into());
                features.normals.push(normal.cast().into());
                features.times.push(set.stamps[i]);
            }
        }
        features
    }

    /// `n` features: the same hall again and again, side by side, one visit after the other.
    #[must_use]
    pub fn repeated(&self, n: usize) -> Self {
        let (len, duration) = (self.times.len(), self.times.last().copied().unwrap_or(0.0));
        let mut features = Self::default();
        for i in 0..n {
            let (hall, i) = (i / len, i % len);
            let [x, y, z] = self.positions[i];
            let shifted = [x + HALL_STEP * hall as f32, y, z];
            features.positions.push(shifted);
            features.normals.push(self.normals[i]);
            features.times.push(self.times[i] + duration * hall as f64);
        }
        features
    }

    /// Six numbers per feature, one feature after the other.
    pub fn rows(&self) -> Vec<f32> {
        let rows = self.positions.iter().zip(&self.normals);
        rows.flat_map(|(p, n)| [*p, *n]).flatten().collect()
    }
}
