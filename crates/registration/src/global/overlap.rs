// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which stretches have seen the same places, and which of them are matched.

use std::collections::BTreeSet;

use bentwing_voxels::{VoxelKey, voxel_of};
use rayon::prelude::*;

use super::chunk::{Chunk, Laid};
use super::problem::Plan;
use crate::state::State;

/// Edge of the places that are compared, m: that of the second coarsest of the usual levels.
const PLACE: f64 = 1.6;

/// The places a stretch has seen, and from which side: sorted and without repetition.
pub struct Places(Vec<(VoxelKey, u8)>);

impl Places {
    fn of(laid: &Laid) -> Self {
        let surfels = laid.placed.surfels.iter();
        let mut keys: Vec<(VoxelKey, u8)> = surfels
            .map(|s| {
                let axis = s.normal.iamax();
                let side = axis as u8 * 2 + u8::from(s.normal[axis] > 0.0);
                (VoxelKey::new(voxel_of(&s.mean.into(), PLACE)), side)
            })
            .collect();
        keys.sort_unstable();
        keys.dedup();
        Self(keys)
    }

    /// Share of the smaller set that both have.
    fn overlap(&self, other: &Self) -> f64 {
        let (a, b) = (&self.0, &other.0);
        let (mut i, mut j, mut n) = (0, 0, 0);
        while i < a.len() && j < b.len() {
            n += usize::from(a[i] == b[j]);
            let (x, y) = (a[i] <= b[j], b[j] <= a[i]);
            i += usize::from(x);
            j += usize::from(y);
        }
        f64::from(n as u32) / (a.len().min(b.len()).max(1) as f64)
    }
}

/// Pairs `(a, b)`, `a <= b`, of stretches that are matched, in order.
///
/// Each is matched with itself, with its successor, and with at most `n_visits` others, the best one
/// of each of as many groups that follow each other in time: so that different visits take part, and the
/// number of matches grows no faster than the recording.
pub fn links(chunks: &[Chunk], states: &[State<'_>], plan: &Plan) -> Vec<(usize, usize)> {
    let places = |c: &Chunk| Places::of(&Laid::new(c, states, None));
    let places: Vec<Places> = chunks.par_iter().map(places).collect();
    let chosen: Vec<Vec<usize>> = (0..chunks.len())
        .into_par_iter()
        .map(|a| visits(a, &places, |b| follow(chunks, a, b), plan))
        .collect();
    let mut links = BTreeSet::new();
    for (a, others) in chosen.iter().enumerate() {
        links.insert((a, a));
        if follow(chunks, a, a + 1) {
            links.insert((a, a + 1));
        }
        links.extend(others.iter().map(|&b| (a.min(b), a.max(b))));
    }
    links.into_iter().collect()
}

/// Whether two stretches are the same or follow each other without a break.
pub fn follow(chunks: &[Chunk], a: usize, b: usize) -> bool {
    let piece = |k: usize| chunks.get(k).map(|c| c.piece);
    a.abs_diff(b) <= 1 && piece(a) == piece(b)
}

fn visits(a: usize, places: &[Places], near: impl Fn(usize) -> bool, plan: &Plan) -> Vec<usize> {
    let seen: Vec<(usize, f64)> = (0..places.len())
        .filter(|&b| !near(b))
        .map(|b| (b, places[a].overlap(&places[b])))
        .filter(|&(_, overlap)| overlap > plan.min_overlap)
        .collect();
    let group = seen.len().div_ceil(plan.n_visits.max(1)).max(1);
    let best = |group: &[(usize, f64)]| {
        let mut best = group[0];
        for &other in group {
            if other.1 > best.1 {
                best = other;
            }
        }
        best.0
    };
    seen.chunks(group).map(best).take(plan.n_visits).collect()
}
