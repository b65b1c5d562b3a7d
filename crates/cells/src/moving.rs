// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cells that beams have passed through: what was in them has moved.
//!
//! A cell held something that moved if beams went through the middle of its points at several
//! times at which neither it nor a cell beside it was hit (the neighbourhood tells a body that was
//! elsewhere from a surface or a bush that single beams slip through; Schmid et al. 2023, Dynablox,
//! ask the same of free space). Cells beside those need only have been empty themselves.

use std::sync::atomic::{AtomicU64, Ordering};

use bentwing_voxels::VoxelKey;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::block::{self, Shard, middle_of, present, shard_of};
use crate::cell::{Bins, Core, Plane, count_without};
use crate::rays::Ray;
use crate::walk::walk;

/// Beams per parallel task.
const CHUNK: usize = 2048;
/// A beam that meets a flat surface at less than this (sine of about 15°) may have passed beside it.
const MIN_SINE: f64 = 0.26;
/// A cell must have been empty at so many steps of time, …
const MIN_EMPTY: u32 = 3;
/// … and so many times as often as it was hit.
const EMPTY_PER_HIT: u32 = 2;

/// Follows the rays; says of each cell, by shard, whether it held something that moved.
pub(crate) fn find(
    shards: &[Shard],
    edge: f64,
    rays: &[Ray],
    margin: f64,
) -> (Vec<Vec<bool>>, usize) {
    let seen_through = seen_through(shards, edge, rays, margin);
    let strong = flags(shards, |s, i| is_strong(shards, &seen_through, s, i));
    let all = flags(shards, |s, i| {
        strong[s][i]
            || is_empty_itself(shards, &seen_through, s, i)
                && around(shards[s].coordinates[i])
                    .any(|at| block::find(shards, at).is_some_and(|(s, i)| strong[s][i as usize]))
    });
    let n = all.iter().flatten().filter(|&&m| m).count();
    (all, n)
}

/// When each cell was seen through, by shard.
fn seen_through(shards: &[Shard], edge: f64, rays: &[Ray], margin: f64) -> Vec<Vec<Bins>> {
    let shapes: Vec<Vec<(Option<Core>, Option<Plane>)>> = shards
        .par_iter()
        .map(|shard| {
            let cells = shard.cells.iter();
            cells
                .map(|c| (Core::of(&c.sums, edge), Plane::of(&c.sums, edge)))
                .collect()
        })
        .collect();
    let marks: Vec<Vec<[AtomicU64; 4]>> = shards
        .iter()
        .map(|shard| {
            shard
                .cells
                .iter()
                .map(|_| <[AtomicU64; 4]>::default())
                .collect()
        })
        .collect();
    // Setting bits gives the same in any order.
    rays.par_iter().with_min_len(CHUNK).for_each(|ray| {
        let origin = ray.origin.map(f64::from);
        let direction = ray.direction.map(f64::from);
        let reach = f64::from(ray.length) - margin;
        walk(
            &origin,
            &direction,
            (0.0, reach),
            4.0 * edge,
            |at, enter, leave| {
                let key = VoxelKey::new(at);
                let shard = shard_of(key);
                let Some(block) = shards[shard].block(key) else {
                    return;
                };
                walk(&origin, &direction, (enter, leave), edge, |cell, _, _| {
                    if cell.map(|c| c >> 2) != at {
                        return; // a rounding error beyond the block's border
                    }
                    let [x, y, z] = cell.map(|c| (c & 3) as usize);
                    let Some(index) = present(block, x << 4 | y << 2 | z) else {
                        return;
                    };
                    let (core, plane) = &shapes[shard][index as usize];
                    let middle = middle_of(cell, edge);
                    let from = Vector3::from([0, 1, 2].map(|a| origin[a] - middle[a]));
                    if passes(
                        core.as_ref(),
                        plane.as_ref(),
                        &from,
                        &direction.into(),
                        reach,
                    ) {
                        let word = &marks[shard][index as usize][usize::from(ray.bin) / 64];
                        word.fetch_or(1 << (ray.bin % 64), Ordering::Relaxed);
                    }
                });
            },
        );
    });
    let read = |cell: [AtomicU64; 4]| cell.map(AtomicU64::into_inner);
    marks
        .into_iter()
        .map(|shard| shard.into_iter().map(read).collect())
        .collect()
}

/// Whether a ray goes through the middle of what a cell holds.
fn passes(
    core: Option<&Core>,
    plane: Option<&Plane>,
    origin: &Vector3<f64>,
    direction: &Vector3<f64>,
    reach: f64,
) -> bool {
    let crossing = core.and_then(|c| c.crossing(origin, direction));
    let is_within = crossing.is_some_and(|along| (0.0..reach).contains(&along));
    is_within
        && plane.is_none_or(|p| {
            let sine = Vector3::from(p.normal).map(f64::from).dot(direction).abs();
            !p.is_flat || sine > MIN_SINE
        })
}

fn flags(shards: &[Shard], is_so: impl Fn(usize, usize) -> bool + Sync) -> Vec<Vec<bool>> {
    let of_shard =
        |(s, shard): (usize, &Shard)| (0..shard.cells.len()).map(|i| is_so(s, i)).collect();
    shards.par_iter().enumerate().map(of_shard).collect()
}

fn is_empty_itself(shards: &[Shard], through: &[Vec<Bins>], s: usize, i: usize) -> bool {
    let hits = &shards[s].cells[i].hits;
    is_enough(count_without(&through[s][i], hits), hits)
}

/// Whether a cell was empty often enough while all around it was as well.
fn is_strong(shards: &[Shard], through: &[Vec<Bins>], s: usize, i: usize) -> bool {
    if !is_empty_itself(shards, through, s, i) {
        return false;
    }
    let hits = shards[s].cells[i].hits;
    let mut all = hits;
    for at in around(shards[s].coordinates[i]) {
        if let Some((s, i)) = block::find(shards, at) {
            for (a, b) in all.iter_mut().zip(shards[s].cells[i as usize].hits) {
                *a |= b;
            }
        }
    }
    is_enough(count_without(&through[s][i], &all), &hits)
}

fn is_enough(n_empty: u32, hits: &Bins) -> bool {
    n_empty >= MIN_EMPTY && n_empty >= EMPTY_PER_HIT * count_without(hits, &Bins::default())
}

/// The 26 cells beside one.
fn around([x, y, z]: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    let offsets = (0..27_i64).filter(|&k| k != 13);
    offsets.map(move |k| [x + k / 9 - 1, y + k / 3 % 3 - 1, z + k % 3 - 1])
}
