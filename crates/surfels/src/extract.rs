// SPDX-License-Identifier: MIT OR Apache-2.0
//! From points to surfels.

#![allow(
    clippy::inline_always,
    reason = "only what is inlined into a dispatched function uses the machine's instructions"
)]

use bentwing_trajectory::{Head, Trajectory};
use bentwing_voxels::{VoxelKey, sym3};
use nalgebra::{Matrix3, Vector3};
use pulp::{Arch, Simd, WithSimd};
use rustc_hash::FxHashMap;

use crate::SurfelSet;
use crate::passage::Passage;
use crate::place::Placer;

/// Points that are placed before they are merged.
const BLOCK: usize = 1 << 14;

/// Voxels that are found without the hash map: 2 to this power.
const RECENT_BITS: u32 = 12;

/// The budget of a shorter stretch is that of this one, s.
const MIN_DURATION: f64 = 0.1;

/// What makes a surfel.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Voxel size of the finest level, m; each further level doubles it.
    pub voxel_size: f64,
    /// Number of levels.
    pub n_levels: usize,
    /// A cell is split where its points pause for longer than this, s.
    pub max_gap: f64,
    /// A cell is split when its points span more than this, s.
    pub max_span: f64,
    /// Fewest points of a surfel.
    pub min_points: u32,
    /// Least `2 (λ2 − λ1) / (λ1 + λ2 + λ3)`.
    pub min_planarity: f64,
    /// Least `λ2 / λ3`.
    pub min_width_ratio: f64,
    /// Least `√λ2` in units of the voxel size; rejects single scan lines, whose normal is free
    /// to turn about the line.
    pub min_width: f64,
    /// Least cosine between normal and ray. What looks like a surface seen edge-on is the plane of
    /// the scan itself, bent at a corner or about a trunk.
    pub min_incidence_cosine: f64,
    /// Most surfels per second of data.
    pub max_rate: f64,
    /// Standard deviation of a range, m.
    pub range_sigma: f64,
}

/// Time-stamped points of the lidar.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    /// Positions, m, lidar frame.
    pub points: &'a [[f64; 3]],
    /// Non-decreasing stamps, s, lidar clock.
    pub stamps: &'a [f64],
    /// Encoder angles, rad; empty for heads without motor.
    pub angles: &'a [f64],
}

/// What was seen of one voxel in one go.
struct Cell {
    key: VoxelKey,
    passage: Passage,
}

/// Extracts the surfels of all levels from points placed with `trajectory` (Kaul 2015, 2.1).
pub fn extract(
    points: Points<'_>,
    trajectory: &Trajectory,
    head: &Head,
    settings: &Settings,
) -> SurfelSet {
    let origin = trajectory.positions()[0];
    let mut set = SurfelSet {
        level_starts: vec![0],
        ..SurfelSet::default()
    };
    let mut ranks = Vec::new();
    let mut cells = cells_of(points, &Placer::new(trajectory, head), origin, settings);
    for level in 0..settings.n_levels {
        if level > 0 {
            let mut merger = Merger::new(settings);
            for cell in &cells {
                merger.add(cell.key.coarser(), &cell.passage);
            }
            cells = merger.merged;
        }
        let size = settings.voxel_size * f64::from(1u32 << level);
        for cell in &cells {
            if push_surfel(
                &mut set,
                &cell.passage,
                &origin,
                size,
                trajectory,
                head,
                settings,
            ) {
                ranks.push(rank(cell.key, level));
            }
        }
        set.level_starts.push(set.len());
        set.voxel_sizes.push(size);
    }
    let duration = points
        .stamps
        .last()
        .zip(points.stamps.first())
        .map_or(0.0, |(b, a)| b - a);
    let budget = (settings.max_rate * duration.max(MIN_DURATION)) as usize;
    limit(set, &ranks, budget).shrunk()
}

/// Keeps at most `budget` surfels: levels with few keep all of theirs, the others share the rest.
///
/// Voxels are kept in the order of their ranks, so that a voxel kept now is kept when it is seen
/// again, and surfels do not lose their counterparts.
fn limit(set: SurfelSet, ranks: &[u64], budget: usize) -> SurfelSet {
    if set.len() <= budget {
        return set;
    }
    let mut by_size: Vec<usize> = (0..set.n_levels()).collect();
    by_size.sort_by_key(|&l| set.level(l).len());
    let mut keep = vec![true; set.len()];
    let mut left = budget;
    for (done, &level) in by_size.iter().enumerate() {
        let share = left / (set.n_levels() - done);
        let range = set.level(level);
        left -= share.min(range.len());
        if range.len() > share {
            let mut sorted: Vec<u64> = ranks[range.clone()].to_vec();
            let (_, &mut threshold, _) = sorted.select_nth_unstable(share);
            for i in range {
                keep[i] = ranks[i] < threshold;
            }
        }
    }
    set.filtered(&keep)
}

/// A fixed pseudo-random number for each voxel (the finalizer of `SplitMix64`).
fn rank(key: VoxelKey, level: usize) -> u64 {
    let mut x = key.bits() ^ (level as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// Merges the points of each voxel, block by block: what is placed is merged before it has left
/// the cache.
fn cells_of(
    points: Points<'_>,
    placer: &Placer<'_>,
    origin: Vector3<f64>,
    settings: &Settings,
) -> Vec<Cell> {
    let arch = Arch::new();
    let mut placed = vec![[0.0; 3]; BLOCK.min(points.points.len())];
    let mut keys = vec![VoxelKey::NONE; placed.len()];
    let mut merger = Merger::new(settings);
    for first in (0..points.points.len()).step_by(BLOCK) {
        let block = first..(first + BLOCK).min(points.points.len());
        let (placed, keys) = (&mut placed[..block.len()], &mut keys[..block.len()]);
        let angles = points.angles.get(block.clone()).unwrap_or(&[]);
        placer.place(
            &points.points[block.clone()],
            &points.stamps[block.clone()],
            angles,
            placed,
        );
        arch.dispatch(Packing {
            points: placed,
            size: settings.voxel_size,
            keys,
        });
        for (i, (p, &key)) in block.zip(placed.iter().zip(keys.iter())) {
            let angle = points.angles.get(i).copied().unwrap_or(0.0);
            let local = [p[0] - origin.x, p[1] - origin.y, p[2] - origin.z];
            merger.add(key, &Passage::of_point(local, points.stamps[i], angle));
        }
    }
    merger.merged
}

/// Merges cells of the same voxel as long as neither a pause nor the span of time forbids it.
///
/// Takes them in order of their first times and keeps them so.
struct Merger<'a> {
    settings: &'a Settings,
    merged: Vec<Cell>,
    /// Where the latest cell of each voxel is.
    open: FxHashMap<VoxelKey, usize>,
    /// The same for some voxels, in the place that their keys' hashes give them.
    recent: Vec<(VoxelKey, usize)>,
}

impl<'a> Merger<'a> {
    fn new(settings: &'a Settings) -> Self {
        Self {
            settings,
            merged: Vec::new(),
            open: FxHashMap::default(),
            recent: vec![(VoxelKey::NONE, 0); 1 << RECENT_BITS],
        }
    }

    #[inline]
    fn add(&mut self, key: VoxelKey, seen: &Passage) {
        match self.cell_for(key, seen.span()) {
            Some(earlier) => earlier.merge(seen),
            None => self.push(key, *seen),
        }
    }

    /// The latest cell of the voxel, if what has been seen in the span of time belongs to it.
    #[inline]
    fn cell_for(&mut self, key: VoxelKey, span: (f64, f64)) -> Option<&mut Passage> {
        let recent = &mut self.recent[key.class(RECENT_BITS)];
        if recent.0 != key {
            *recent = (key, *self.open.get(&key)?);
        }
        let passage = &mut self.merged[recent.1].passage;
        belongs(passage.span(), span, self.settings).then_some(passage)
    }

    /// Opens the next cell of a voxel.
    fn push(&mut self, key: VoxelKey, passage: Passage) {
        self.recent[key.class(RECENT_BITS)] = (key, self.merged.len());
        self.open.insert(key, self.merged.len());
        self.merged.push(Cell { key, passage });
    }
}

#[inline]
fn belongs(earlier: (f64, f64), later: (f64, f64), settings: &Settings) -> bool {
    later.0 - earlier.1 <= settings.max_gap && later.1 - earlier.0 <= settings.max_span
}

/// Adds the surfel of a cell, if it is one; returns whether it is.
fn push_surfel(
    set: &mut SurfelSet,
    passage: &Passage,
    origin: &Vector3<f64>,
    size: f64,
    trajectory: &Trajectory,
    head: &Head,
    settings: &Settings,
) -> bool {
    let moments = &passage.moments;
    if moments.n() < settings.min_points {
        return false;
    }
    let covariance = moments.covariance();
    let eigen = sym3::eigen(&covariance);
    let [l1, l2, l3] = eigen.values;
    let planarity = 2.0 * (l2 - l1) / (l1 + l2 + l3);
    let is_surface = planarity > settings.min_planarity
        && l2 > settings.min_width_ratio * l3
        && l2 > (settings.min_width * size).powi(2);
    if !is_surface {
        return false;
    }
    let (stamp, angle) = (passage.mean_time(), passage.mean_angle());
    let pose = trajectory.pose(head.clock.measured(stamp));
    let (R_imu_lidar, t_imu_lidar) = head.lidar_in_imu(angle);
    let R_lidar_map = (pose.R * R_imu_lidar).transpose();
    let t_map_lidar = pose.p + pose.R * t_imu_lidar;
    let mean = R_lidar_map * (moments.mean() + origin - t_map_lidar);
    let seen = R_lidar_map * covariance * R_lidar_map.transpose();
    let covariance = without_range_noise(&seen, &mean, settings.range_sigma);
    let normal = sym3::eigen(&covariance).normal;
    let away = normal.dot(&mean);
    if away.abs() < settings.min_incidence_cosine * mean.norm() {
        return false;
    }
    set.means.push(head.ranges.measured(&mean));
    set.covariances.push(covariance);
    // Turned to the sensor: otherwise thin walls match front to back.
    set.normals.push(if away > 0.0 { -normal } else { normal });
    set.stamps.push(stamp);
    set.angles.push(angle);
    set.n_points.push(moments.n());
    true
}

/// Share of the spread along the ray that is left at least.
const LEFT: f64 = 0.1;

/// Takes the noise of the ranges, which spreads points along their rays, out of a covariance.
///
/// It is no roughness, and where a surface is seen at a grazing angle it turns the normal, always
/// to the same side: a sensor that climbs would see the ground move with it.
fn without_range_noise(
    covariance: &Matrix3<f64>,
    mean: &Vector3<f64>,
    range_sigma: f64,
) -> Matrix3<f64> {
    let (ray, Some(inverse)) = (mean.normalize(), covariance.try_inverse()) else {
        return *covariance;
    };
    // More than this along the ray, and the rest is no covariance.
    let most = 1.0 / ray.dot(&(inverse * ray));
    let noise = (range_sigma * range_sigma).min((1.0 - LEFT) * most);
    covariance - ray * ray.transpose() * noise.max(0.0)
}

/// Packs the voxel coordinates of each point into a key.
struct Packing<'a> {
    points: &'a [[f64; 3]],
    size: f64,
    keys: &'a mut [VoxelKey],
}

impl WithSimd for Packing<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (p, key) in self.points.iter().zip(self.keys) {
            *key = VoxelKey::of_whole([p[0], p[1], p[2]].map(|c| (c / self.size).floor()));
        }
    }
}

#[cfg(test)]
mod tests;
