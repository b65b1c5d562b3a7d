// SPDX-License-Identifier: MIT OR Apache-2.0
//! The k nearest features that were seen at another time.

use std::ops::Range;

use rayon::prelude::*;

use crate::Grid;

/// Marks an empty place in a list of neighbours.
pub const NONE: u32 = u32::MAX;

/// Candidates whose distances are computed together.
const LANES: usize = 16;

/// Query cells per parallel task.
const CELLS_PER_TASK: usize = 64;

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
}

impl Neighbors {
    /// Neighbours of query `i` by their original indices, nearest first.
    pub fn of(&self, i: usize) -> &[u32] {
        let list = &self.indices[i * self.k..(i + 1) * self.k];
        let n = list.iter().position(|&j| j == NONE).unwrap_or(self.k);
        &list[..n]
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
        let tasks: Vec<usize> = (0..queries.n_cells()).step_by(CELLS_PER_TASK).collect();
        let found: Vec<Vec<(u32, Best)>> = tasks
            .into_par_iter()
            .map(|first| {
                let last = (first + CELLS_PER_TASK).min(queries.n_cells());
                (first..last)
                    .flat_map(|c| self.search_cell(queries, c, search))
                    .collect()
            })
            .collect();
        let mut indices = vec![NONE; queries.len() * search.k];
        for (query, best) in found.into_iter().flatten() {
            let list = &mut indices[query as usize * search.k..][..search.k];
            for (place, (_, j)) in list.iter_mut().zip(best.list) {
                *place = j;
            }
        }
        Neighbors {
            k: search.k,
            indices,
        }
    }

    fn search_cell(&self, queries: &Self, cell: usize, search: &Search) -> Vec<(u32, Best)> {
        let runs = self.runs_around(queries.cell_key(cell));
        let search_one = |s: usize| {
            let (feature, time) = queries.feature(s);
            let mut best = Best::new(search);
            for run in &runs {
                self.scan(run, &feature, time, search, &mut best);
            }
            (queries.original(s), best)
        };
        queries.cell(cell).map(search_one).collect()
    }

    /// Scans a run of candidates, several distances at a time.
    fn scan(
        &self,
        run: &Range<usize>,
        feature: &[f32; 6],
        time: f32,
        search: &Search,
        best: &mut Best,
    ) {
        let mut first = run.start;
        while first < run.end {
            let last = (first + LANES).min(run.end);
            let (columns, times) = self.run(first..last);
            let mut distances = [f32::INFINITY; LANES];
            gated_distances(&columns, times, feature, time, search, &mut distances);
            for (lane, &d) in distances[..last - first].iter().enumerate() {
                if d <= best.worst {
                    best.insert(d, self.original(first + lane));
                }
            }
            first = last;
        }
    }
}

/// Squared distances of up to `LANES` candidates; infinite where the time gap is too small.
#[inline]
fn gated_distances(
    columns: &[&[f32]; 6],
    times: &[f32],
    feature: &[f32; 6],
    time: f32,
    search: &Search,
    distances: &mut [f32; LANES],
) {
    let n = times.len();
    let mut sums = [0.0_f32; LANES];
    for (column, &f) in columns.iter().zip(feature) {
        for (sum, &c) in sums[..n].iter_mut().zip(&column[..n]) {
            let difference = c - f;
            *sum += difference * difference;
        }
    }
    for ((d, &sum), &t) in distances[..n].iter_mut().zip(&sums[..n]).zip(times) {
        *d = if (t - time).abs() > search.min_time_gap {
            sum
        } else {
            f32::INFINITY
        };
    }
}

/// The best candidates so far, nearest first.
#[derive(Debug)]
struct Best {
    list: Vec<(f32, u32)>,
    k: usize,
    /// Squared distance a candidate must not exceed.
    worst: f32,
}

impl Best {
    fn new(search: &Search) -> Self {
        let worst = search.max_distance * search.max_distance;
        Self {
            list: Vec::with_capacity(search.k + 1),
            k: search.k,
            worst,
        }
    }

    fn insert(&mut self, distance: f32, index: u32) {
        let at = self
            .list
            .partition_point(|&(d, i)| (d, i) < (distance, index));
        self.list.insert(at, (distance, index));
        self.list.truncate(self.k);
        if self.list.len() == self.k
            && let Some(&(d, _)) = self.list.last()
        {
            self.worst = d;
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
