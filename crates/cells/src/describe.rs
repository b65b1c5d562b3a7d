// SPDX-License-Identifier: MIT OR Apache-2.0
//! The second look: what the cells say about each point.

use bentwing_voxels::{Moments, voxel_of};
use rayon::prelude::*;

use crate::block::{self, N_SHARDS, Shard, middle_of};
use crate::cell::Plane;

/// Points per parallel task.
const CHUNK: usize = 4096;
/// A point farther from its surface than this many thicknesses, and than `OFF`, is not on it.
const OFF_THICKNESSES: f32 = 3.0;
const OFF: f32 = 0.04;
/// So many points in a cell support each other.
const SUPPORT: u32 = 2;

/// Cells of a complete survey.
#[derive(Clone, Debug)]
pub struct Cells {
    shards: Vec<Shard>,
    found: Vec<Vec<Found>>,
    edge: f64,
    n_moving: usize,
    n_rays: usize,
}

#[derive(Clone, Copy, Debug)]
struct Found {
    plane: Option<Plane>,
    is_moving: bool,
    is_supported: bool,
}

/// What is known of some points, in their order.
#[derive(Clone, Debug, Default)]
pub struct Described {
    /// Angle between beam and normal, rad; NaN where there is no surface.
    pub incidence: Vec<f32>,
    /// Standard deviation across the surface, m; NaN where there is none.
    pub thickness: Vec<f32>,
    /// Whether the point is of something that moved.
    pub is_moving: Vec<bool>,
    /// Whether other points say that there is something.
    pub is_supported: Vec<bool>,
}

impl Cells {
    pub(crate) fn new(
        mut shards: Vec<Shard>,
        edge: f64,
        moving: &[Vec<bool>],
        n_moving: usize,
        n_rays: usize,
    ) -> Self {
        let of_shard = |s: usize| -> Vec<Found> {
            let found = |i| Found {
                plane: plane_of(&shards, edge, s, i),
                is_moving: moving[s][i],
                is_supported: shards[s].cells[i].sums.n() >= SUPPORT,
            };
            (0..shards[s].cells.len()).map(found).collect()
        };
        let found = (0..N_SHARDS).into_par_iter().map(of_shard).collect();
        for shard in &mut shards {
            shard.cells = Vec::new();
        }
        Self {
            shards,
            found,
            edge,
            n_moving,
            n_rays,
        }
    }

    /// Edge of the cells, m: that of the settings, or larger if there were too many.
    pub fn edge(&self) -> f64 {
        self.edge
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.found.iter().map(Vec::len).sum()
    }

    /// Number of cells whose content moved.
    pub fn n_moving(&self) -> usize {
        self.n_moving
    }

    /// Number of beams that were followed.
    pub fn n_rays(&self) -> usize {
        self.n_rays
    }

    /// Describes points (m, map frame) measured by beams of these unit directions.
    pub fn describe(&self, points: &[[f64; 3]], beams: &[[f32; 3]]) -> Described {
        let one = |(p, beam): (&[f64; 3], &[f32; 3])| self.describe_one(p, beam);
        let rows: Vec<(f32, f32, bool, bool)> = points
            .par_iter()
            .zip_eq(beams)
            .with_min_len(CHUNK)
            .map(one)
            .collect();
        let mut described = Described::default();
        for (incidence, thickness, is_moving, is_supported) in rows {
            described.incidence.push(incidence);
            described.thickness.push(thickness);
            described.is_moving.push(is_moving);
            described.is_supported.push(is_supported);
        }
        described
    }

    fn describe_one(&self, p: &[f64; 3], beam: &[f32; 3]) -> (f32, f32, bool, bool) {
        let at = voxel_of(p, self.edge);
        let Some(found) = self.at(at) else {
            return (f32::NAN, f32::NAN, false, false);
        };
        let Some(plane) = found.plane else {
            return (f32::NAN, f32::NAN, found.is_moving, found.is_supported);
        };
        let middle = middle_of(at, self.edge);
        let n = plane.normal;
        let height: f32 = (0..3)
            .map(|a| n[a] * ((p[a] - middle[a]) as f32 - plane.mean[a]))
            .sum();
        let is_off = height.abs() > OFF.max(OFF_THICKNESSES * plane.thickness);
        let cosine: f32 = (0..3).map(|a| n[a] * beam[a]).sum();
        // What stands off a surface beside something that moved belongs to it: shoes on a floor.
        let is_moving =
            found.is_moving || is_off && plane.is_flat && self.moves_towards(p, &n, height);
        let incidence = cosine.abs().min(1.0).acos();
        (
            incidence,
            plane.thickness,
            is_moving,
            !is_off || found.is_supported,
        )
    }

    fn moves_towards(&self, p: &[f64; 3], normal: &[f32; 3], height: f32) -> bool {
        let reach = self.edge.copysign(f64::from(height));
        let beside = [0, 1, 2].map(|a| p[a] + f64::from(normal[a]) * reach);
        self.at(voxel_of(&beside, self.edge))
            .is_some_and(|f| f.is_moving)
    }

    fn at(&self, cell: [i64; 3]) -> Option<&Found> {
        let (shard, index) = block::find(&self.shards, cell)?;
        Some(&self.found[shard][index as usize])
    }
}

/// A wall that lies on the border of cells is in two of them, each with a half of its noise: points
/// beside a cell join it where its surface becomes thicker by no more than this.
const JOINED_THICKER: f32 = 2.0;
const JOINED_THICKER_BY: f32 = 0.005;

/// The plane of a cell; where its own points have none, that of the points around it.
fn plane_of(shards: &[Shard], edge: f64, s: usize, i: usize) -> Option<Plane> {
    let mut sums = shards[s].cells[i].sums;
    let at = shards[s].coordinates[i];
    let Some(own) = Plane::of(&sums, edge) else {
        for k in (0..27_i64).filter(|&k| k != 13) {
            add_beside(
                &mut sums,
                shards,
                edge,
                at,
                [k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1],
            );
        }
        return Plane::of(&sums, edge);
    };
    let steepest = |a: usize, b: usize| {
        if own.normal[b].abs() > own.normal[a].abs() {
            b
        } else {
            a
        }
    };
    let axis = steepest(steepest(0, 1), 2);
    let mut plane = own;
    for side in [-1, 1] {
        let mut offset = [0; 3];
        offset[axis] = side;
        let mut joined = sums;
        add_beside(&mut joined, shards, edge, at, offset);
        let limit = JOINED_THICKER * own.thickness + JOINED_THICKER_BY;
        if let Some(p) = Plane::of(&joined, edge).filter(|p| p.thickness < limit) {
            (plane, sums) = (p, joined);
        }
    }
    Some(plane)
}

fn add_beside(sums: &mut Moments, shards: &[Shard], edge: f64, at: [i64; 3], offset: [i64; 3]) {
    if let Some((s, i)) = block::find(shards, [0, 1, 2].map(|a| at[a] + offset[a])) {
        let shift = offset.map(|o| o as f64 * edge);
        sums.merge(&shards[s].cells[i as usize].sums.shifted(shift));
    }
}
