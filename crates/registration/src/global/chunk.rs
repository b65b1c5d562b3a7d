// SPDX-License-Identifier: MIT OR Apache-2.0
//! Stretches of a few seconds, the units that are matched with each other.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use bentwing_neighbors::Grid;
use bentwing_surfels::SurfelSet;
use rayon::prelude::*;

use super::piece::PieceState;
use crate::matches::grid_of;
use crate::placed::Placed;

/// A stretch and where it belongs.
pub struct Chunk {
    pub piece: usize,
    pub surfels: Arc<SurfelSet>,
}

/// The surfels of a stretch where the current trajectory puts them.
pub struct Laid {
    pub placed: Placed,
    /// Search grid of each level; none if nothing is searched.
    pub grids: Vec<Grid>,
}

impl Laid {
    pub fn new(chunk: &Chunk, states: &[PieceState<'_>], searched: bool) -> Self {
        let state = &states[chunk.piece];
        let sets = std::slice::from_ref(&chunk.surfels);
        let placed = Placed::new(sets, &state.trajectory, &state.globals, &state.spline);
        let levels = 0..if searched {
            placed.voxel_sizes.len()
        } else {
            0
        };
        let grid = |l| grid_of(&placed.surfels[placed.level(l)], placed.voxel_sizes[l]);
        let grids = levels.map(grid).collect();
        Self { placed, grids }
    }
}

/// Stretches as placed in the map, of which no more than some are held.
pub struct Holder {
    laid: BTreeMap<usize, Arc<Laid>>,
    n_held: usize,
    searched: bool,
}

impl Holder {
    pub fn new(n_held: usize, searched: bool) -> Self {
        Self {
            laid: BTreeMap::new(),
            n_held,
            searched,
        }
    }

    /// Makes sure that all of `needed` are there.
    pub fn provide(
        &mut self,
        needed: &BTreeSet<usize>,
        chunks: &[Chunk],
        states: &[PieceState<'_>],
    ) {
        let missing: Vec<usize> = needed
            .iter()
            .copied()
            .filter(|k| !self.laid.contains_key(k))
            .collect();
        let mut excess = (self.laid.len() + missing.len()).saturating_sub(self.n_held);
        // Links are in the order of their stretches: the earliest ones are needed least.
        self.laid.retain(|k, _| {
            let keep = excess == 0 || needed.contains(k);
            excess -= usize::from(!keep);
            keep
        });
        let searched = self.searched;
        let lay = |&k: &usize| (k, Arc::new(Laid::new(&chunks[k], states, searched)));
        let laid: Vec<_> = missing.par_iter().map(lay).collect();
        self.laid.extend(laid);
    }

    /// A stretch that was provided.
    pub fn get(&self, k: usize) -> Option<&Laid> {
        self.laid.get(&k).map(AsRef::as_ref)
    }
}
