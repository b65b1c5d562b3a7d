// SPDX-License-Identifier: MIT OR Apache-2.0
//! The k nearest features that were seen at another time.

#![allow(
    clippy::inline_always,
    reason = "only what is inlined into a dispatched function uses the machine's instructions"
)]

use std::ops::Range;

use pulp::Arch;
use rayon::prelude::*;

use super::grid::{Grid, LANES};

/// Marks an empty place in a list of neighbours.
pub const NONE: u32 = u32::MAX;

/// Query cells per parallel task.
const CELLS_PER_TASK: usize = 64;

/// Original indices of queries, and their lists of distances and indices one after the other.
type Found = (Vec<u32>, Vec<(f32, u32)>);

/// What counts as a neighbour.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    /// Longest list.
    pub k: usize,
    /// Largest distance in the six-dimensional feature space; at most the grid's cell size.
    pub max_distance: f32,
    /// Neighbours must differ in time by more than this, s.
    pub min_time_gap: f32,
}

/// A list of at most `k` neighbours for each query, nearest first.
#[derive(Clone, Debug)]
pub struct Neighbors {
    k: usize,
    indices: Vec<u32>,
    /// Squared distances; infinite where a place is empty.
    distances: Vec<f32>,
}

impl Neighbors {
    /// Neighbours of query `i` by their original indices, nearest first.
    pub fn of(&self, i: usize) -> &[u32] {
        let list = &self.indices[i * self.k..(i + 1) * self.k];
        let n = list.iter().position(|&j| j == NONE).unwrap_or(self.k);
        &list[..n]
    }

    /// Neighbours of query `i` with their squared distances, nearest first.
    pub fn with_distances(&self, i: usize) -> impl Iterator<Item = (u32, f32)> + '_ {
        let places = i * self.k..(i + 1) * self.k;
        let indices = self.indices[places.clone()].iter().copied();
        indices
            .zip(self.distances[places].iter().copied())
            .take_while(|&(j, _)| j != NONE)
    }

    /// Longest list.
    pub fn k(&self) -> usize {
        self.k
    }

    /// Number of queries.
    pub fn len(&self) -> usize {
        self.indices.len().checked_div(self.k).unwrap_or(0)
    }

    /// Whether there were no queries.
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }
}

impl Grid {
    /// For each feature of `queries` its nearest features in `self`.
    ///
    /// Both grids have the same cell size. Equal distances are ordered by original index.
    pub fn nearest(&self, queries: &Self, search: &Search) -> Neighbors {
        let arch = Arch::new();
        let tasks: Vec<usize> = (0..queries.n_cells()).step_by(CELLS_PER_TASK).collect();
        let found: Vec<Found> = tasks
            .into_par_iter()
            .map(|first| {
                let cells = first..(first + CELLS_PER_TASK).min(queries.n_cells());
                // The widest instructions of the machine; the order of operations is the same.
                arch.dispatch(|| self.search_cells(queries, cells, search))
            })
            .collect();
        let k = search.k;
        let mut indices = vec![NONE; queries.len() * k];
        let mut distances = vec![f32::INFINITY; queries.len() * k];
        for (originals, lists) in found {
            for (query, list) in originals.iter().zip(lists.chunks_exact(k)) {
                for (place, &(distance, index)) in (*query as usize * k..).zip(list) {
                    indices[place] = index;
                    distances[place] = distance;
                }
            }
        }
        Neighbors {
            k,
            indices,
            distances,
        }
    }

    /// Original indices of the queries in `cells`, and their lists one after the other.
    #[inline(always)]
    fn search_cells(&self, queries: &Self, cells: Range<usize>, search: &Search) -> Found {
        let (mut originals, mut lists) = (Vec::new(), Vec::new());
        let mut best = Best::new(search);
        for cell in cells {
            let columns = self.columns_around(queries.cell_key(cell));
            for s in queries.cell(cell) {
                let (feature, time) = queries.feature(s);
                best.clear();
                for column in &columns {
                    if column.square_distance(&feature) <= best.worst {
                        self.scan(&column.run, &feature, time, search, &mut best);
                    }
                }
                originals.push(queries.original(s));
                lists.extend_from_slice(&best.list);
            }
        }
        (originals, lists)
    }

    /// Scans a run of candidates, several distances at a time.
    #[inline(always)]
    fn scan(
        &self,
        run: &Range<usize>,
        feature: &[f32; 6],
        time: f32,
        search: &Search,
        best: &mut Best,
    ) {
        for first in run.clone().step_by(LANES) {
            let Some((columns, times)) = self.block(first) else {
                return;
            };
            let mut distances = [f32::INFINITY; LANES];
            gated_distances(columns, times, feature, time, search, &mut distances);
            // What is behind the end of the run belongs to other cells.
            let n = run.end - first;
            let within = distances
                .iter()
                .zip(0..)
                .map(|(&d, lane)| if lane < n { d } else { f32::INFINITY });
            let nearest = within.fold(f32::INFINITY, |a, b| if b < a { b } else { a });
            if nearest > best.worst {
                continue;
            }
            for (lane, &d) in distances.iter().enumerate().take(n) {
                if d <= best.worst {
                    best.insert(d, self.original(first + lane));
                }
            }
        }
    }
}

/// Squared distances of `LANES` candidates; infinite where the time gap is too small.
#[inline(always)]
fn gated_distances(
    columns: [&[f32; LANES]; 6],
    times: &[f32; LANES],
    feature: &[f32; 6],
    time: f32,
    search: &Search,
    distances: &mut [f32; LANES],
) {
    let mut sums = [0.0_f32; LANES];
    for (column, f) in columns.into_iter().zip(feature) {
        for (sum, c) in sums.iter_mut().zip(column) {
            let difference = c - f;
            *sum += difference * difference;
        }
    }
    for ((d, sum), t) in distances.iter_mut().zip(sums).zip(times) {
        *d = if (t - time).abs() > search.min_time_gap {
            sum
        } else {
            f32::INFINITY
        };
    }
}

/// The best `k` candidates so far, nearest first; empty places are infinitely far.
#[derive(Debug)]
struct Best {
    list: Vec<(f32, u32)>,
    /// Squared distance beyond which nothing counts.
    limit: f32,
    /// Squared distance a candidate must not exceed.
    worst: f32,
}

impl Best {
    fn new(search: &Search) -> Self {
        let limit = search.max_distance * search.max_distance;
        Self {
            list: vec![(f32::INFINITY, NONE); search.k],
            limit,
            worst: limit,
        }
    }

    fn clear(&mut self) {
        self.list.fill((f32::INFINITY, NONE));
        self.worst = self.limit;
    }

    fn insert(&mut self, distance: f32, index: u32) {
        let mut place = (distance, index);
        for entry in &mut self.list {
            if place < *entry {
                std::mem::swap(entry, &mut place);
            }
        }
        if let Some(&(last, _)) = self.list.last() {
            self.worst = last.min(self.limit);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn brute_force(features: &[([f32; 6], f64)], query: usize, search: &Search) -> Vec<u32> {
        let (f, t) = features[query];
        let mut all: Vec<(f32, u32)> = (0u32..)
            .zip(features)
            .filter(|(_, (_, s))| (*s as f32 - t as f32).abs() > search.min_time_gap)
            .map(|(i, (g, _))| {
                let square = |d: usize| (g[d] - f[d]) * (g[d] - f[d]);
                ((0..6).map(square).fold(0.0, |a, b| a + b), i)
            })
            .filter(|(d, _)| *d <= search.max_distance * search.max_distance)
            .collect();
        all.sort_by(|a, b| a.partial_cmp(b).unwrap());
        all.into_iter().take(search.k).map(|(_, i)| i).collect()
    }

    proptest! {
        #[test]
        fn the_grid_finds_what_brute_force_finds(
            features in prop::collection::vec(
                (prop::array::uniform6(-2.0..2.0_f32), 0.0..3.0_f64), 1..300),
            k in 1..9_usize,
            max_distance in 0.3..1.0_f32,
        ) {
            let positions: Vec<[f32; 3]> = features.iter().map(|(f, _)| [f[0], f[1], f[2]]).collect();
            let normals: Vec<[f32; 3]> = features.iter().map(|(f, _)| [f[3], f[4], f[5]]).collect();
            let times: Vec<f64> = features.iter().map(|(_, t)| *t).collect();
            let grid = Grid::new(&positions, &normals, &times, 1.0);
            let search = Search { k, max_distance, min_time_gap: 0.3 };
            let nearest = grid.nearest(&grid, &search);
            for query in 0..features.len() {
                prop_assert_eq!(nearest.of(query), brute_force(&features, query, &search));
            }
        }
    }

    #[test]
    fn an_empty_grid_has_no_neighbours_to_give() {
        let empty = Grid::new(&[], &[], &[], 1.0);
        let one = Grid::new(&[[0.0; 3]], &[[0.0, 0.0, 1.0]], &[0.0], 1.0);
        let search = Search {
            k: 2,
            max_distance: 1.0,
            min_time_gap: 0.3,
        };
        assert!(empty.nearest(&one, &search).of(0).is_empty());
        assert_eq!(one.nearest(&empty, &search).len(), 0);
    }
}
