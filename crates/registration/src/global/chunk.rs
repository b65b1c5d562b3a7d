// SPDX-License-Identifier: MIT OR Apache-2.0
//! Stretches of a few seconds, the units that are matched with each other.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use bentwing_surfels::SurfelSet;
use rayon::prelude::*;

use super::bend::{Bend, N_NEIGHBORS, bends};
use crate::Settings;
use crate::neighbors::{Grid, Search, mutual_pairs};
use crate::placed::{Placed, grid_of};
use crate::state::State;

/// A stretch and where it belongs.
pub struct Chunk {
    pub piece: usize,
    pub surfels: Arc<SurfelSet>,
}

/// The surfels of a stretch where the current trajectory puts them.
pub struct Laid {
    pub placed: Placed,
    /// What matches are found with; nothing if none are searched.
    pub searched: Searched,
}

/// What is found once for all links of a stretch.
#[derive(Default)]
pub struct Searched {
    /// Search grid of each level.
    pub grids: Vec<Grid>,
    /// Pairs of each level within the stretch.
    pub own_pairs: Vec<Vec<(u32, u32)>>,
    /// How the surface bends at each surfel of all levels.
    pub bends: Vec<Bend>,
}

impl Laid {
    /// Places the surfels of a stretch and, given settings, searches them in themselves.
    pub fn new(chunk: &Chunk, states: &[State<'_>], search: Option<&Settings>) -> Self {
        let placed = states[chunk.piece].place(std::slice::from_ref(&chunk.surfels));
        let searched = search.map_or_else(Searched::default, |s| Searched::of(&placed, s));
        Self { placed, searched }
    }
}

impl Searched {
    fn of(placed: &Placed, settings: &Settings) -> Self {
        let mut found = Self::default();
        for (level, &size) in placed.voxel_sizes.iter().enumerate() {
            let surfels = &placed.surfels[placed.level(level)];
            let grid = grid_of(surfels, size);
            let k = settings.n_neighbors.max(N_NEIGHBORS);
            let nearest = grid.nearest(
                &grid,
                &Search {
                    k,
                    ..settings.search()
                },
            );
            let pairs = mutual_pairs(&nearest, settings.n_neighbors).collect();
            found.own_pairs.push(pairs);
            found.bends.extend(bends(surfels, &nearest, size));
            found.grids.push(grid);
        }
        found
    }
}

/// Stretches as placed in the map, of which no more than some are held.
pub struct Holder<'a> {
    laid: BTreeMap<usize, Arc<Laid>>,
    n_held: usize,
    search: Option<&'a Settings>,
}

impl<'a> Holder<'a> {
    pub fn new(n_held: usize, search: Option<&'a Settings>) -> Self {
        Self {
            laid: BTreeMap::new(),
            n_held,
            search,
        }
    }

    /// Makes sure that all of `needed` are there.
    pub fn provide(&mut self, needed: &BTreeSet<usize>, chunks: &[Chunk], states: &[State<'_>]) {
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
        let search = self.search;
        let lay = |&k: &usize| (k, Arc::new(Laid::new(&chunks[k], states, search)));
        let laid: Vec<_> = missing.par_iter().map(lay).collect();
        self.laid.extend(laid);
    }

    /// A stretch that was provided.
    pub fn get(&self, k: usize) -> Option<&Laid> {
        self.laid.get(&k).map(AsRef::as_ref)
    }
}
