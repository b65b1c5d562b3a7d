// SPDX-License-Identifier: MIT OR Apache-2.0
//! The first look at a map: cells and beams, from its points chunk by chunk.

use bentwing_voxels::voxel_of;
use rayon::prelude::*;

use crate::block::{N_SHARDS, Shard, block_of, middle_of, shard_of};
use crate::cell::{N_BINS, set};
use crate::describe::Cells;
use crate::moving;
use crate::rays::{Ray, RaySample};

/// Points per parallel task; fixed, so that results do not depend on the number of threads.
const CHUNK: usize = 8192;

/// How a map is surveyed.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Edge of the cells, m.
    pub edge: f64,
    /// More cells are joined eight to one.
    pub max_cells: usize,
    /// When the first point was measured, s.
    pub start: f64,
    /// Length of a step of time, s; there are 256, the last one takes all that is later.
    pub step: f64,
    /// More beams are thinned by half.
    pub max_rays: usize,
    /// A beam says nothing about what is closer than this to its end, m.
    pub margin: f64,
}

/// A survey of a map that is not complete.
#[derive(Clone, Debug)]
pub struct Survey {
    settings: Settings,
    edge: f64,
    shards: Vec<Shard>,
    rays: RaySample,
}

impl Survey {
    /// A survey without points.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            edge: settings.edge,
            shards: vec![Shard::default(); N_SHARDS],
            rays: RaySample::new(settings.max_rays),
        }
    }

    /// Number of cells so far.
    pub fn n_cells(&self) -> usize {
        self.shards.iter().map(|s| s.cells.len()).sum()
    }

    /// Adds points (m, map frame) with the unit directions of their beams, the beams' lengths and
    /// times. What is `doubtful` says nothing about surfaces.
    pub fn add(
        &mut self,
        points: &[[f64; 3]],
        beams: &[[f32; 3]],
        ranges: &[f32],
        times: &[f64],
        doubtful: &[bool],
    ) {
        let (edge, settings) = (self.edge, self.settings);
        let cells: Vec<[i64; 3]> = points
            .par_iter()
            .with_min_len(CHUNK)
            .map(|p| voxel_of(p, edge))
            .collect();
        let shards: Vec<u8> = cells
            .par_iter()
            .with_min_len(CHUNK)
            .map(|&c| shard_of(block_of(c).0) as u8)
            .collect();
        let bins: Vec<u8> = times.iter().map(|&t| bin_of(t, &settings)).collect();
        self.shards
            .par_iter_mut()
            .enumerate()
            .for_each(|(s, shard)| {
                for (i, _) in shards
                    .iter()
                    .enumerate()
                    .filter(|&(_, &k)| usize::from(k) == s)
                {
                    if doubtful[i] {
                        continue;
                    }
                    let middle = middle_of(cells[i], edge);
                    let p = [0, 1, 2].map(|a| points[i][a] - middle[a]);
                    let cell = shard.cell_mut(cells[i]);
                    cell.sums.add_point(p);
                    set(&mut cell.hits, bins[i]);
                }
            });
        for i in 0..points.len() {
            self.rays.offer(|| {
                let (p, d, length) = (points[i], beams[i], ranges[i]);
                let reach = f64::from(length);
                let origin = [0, 1, 2].map(|a| (p[a] - f64::from(d[a]) * reach) as f32);
                let is_long = reach.is_finite() && reach > settings.margin;
                is_long.then_some(Ray {
                    origin,
                    direction: d,
                    length,
                    bin: bins[i],
                })
            });
        }
        while self.n_cells() > self.settings.max_cells {
            self.coarsen();
        }
    }

    /// Follows the beams and decides what moved.
    pub fn finish(self) -> Cells {
        let (moving, n_moving) = moving::find(
            &self.shards,
            self.edge,
            &self.rays.rays,
            self.settings.margin,
        );
        Cells::new(
            self.shards,
            self.edge,
            &moving,
            n_moving,
            self.rays.rays.len(),
        )
    }

    /// Joins the cells eight to one.
    fn coarsen(&mut self) {
        let (fine, coarse) = (self.edge, 2.0 * self.edge);
        let mut shards = vec![Shard::default(); N_SHARDS];
        for shard in &self.shards {
            for (cell, &at) in shard.cells.iter().zip(&shard.coordinates) {
                let above = at.map(|c| c >> 1);
                let (from, to) = (middle_of(at, fine), middle_of(above, coarse));
                let joined = shards[shard_of(block_of(above).0)].cell_mut(above);
                let shift = [0, 1, 2].map(|a| from[a] - to[a]);
                joined.sums.merge(&cell.sums.shifted(shift));
                for (a, b) in joined.hits.iter_mut().zip(cell.hits) {
                    *a |= b;
                }
            }
        }
        (self.edge, self.shards) = (coarse, shards);
    }
}

fn bin_of(time: f64, settings: &Settings) -> u8 {
    let step = ((time - settings.start) / settings.step).floor();
    step.clamp(0.0, (N_BINS - 1) as f64) as u8
}
