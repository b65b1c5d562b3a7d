// SPDX-License-Identifier: MIT OR Apache-2.0
//! Keeps the pairs that found each other.

use super::search::{NONE, Neighbors};

/// Pairs `(a, b)`, `a < b`, of a set searched in itself in which each is among the `k` first of the
/// other, ordered by `a`, then by distance.
pub fn mutual_pairs(nearest: &Neighbors, k: usize) -> impl Iterator<Item = (u32, u32)> + '_ {
    let first = move |a: u32| nearest.of(a as usize).iter().take(k).copied();
    (0u32..).take(nearest.len()).flat_map(move |a| {
        first(a)
            .filter(move |&b| a < b && first(b).any(|c| c == a))
            .map(move |b| (a, b))
    })
}

/// Pairs `(query, target)` of a set searched in another: of the queries that list a target it
/// keeps the nearest ones, as many as a list is long; ordered by query, then by distance.
///
/// Unlike a search in both directions this costs no second search, and a target is not lost to a
/// query that prefers another target.
pub fn claimed_pairs(nearest: &Neighbors, n_targets: usize) -> Vec<(u32, u32)> {
    let k = nearest.k();
    let mut claims = vec![(f32::INFINITY, NONE); n_targets * k];
    for query in 0..nearest.len() {
        for (target, distance) in nearest.with_distances(query) {
            let mut claim = (distance, query as u32);
            for kept in &mut claims[target as usize * k..][..k] {
                if claim < *kept {
                    std::mem::swap(kept, &mut claim);
                }
            }
        }
    }
    let of_query = |query: u32| {
        let listed = nearest.of(query as usize).iter().copied();
        let claims = &claims;
        listed
            .filter(move |&t| claims[t as usize * k..][..k].iter().any(|c| c.1 == query))
            .map(move |t| (query, t))
    };
    (0u32..).take(nearest.len()).flat_map(of_query).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neighbors::{Grid, Search};

    #[test]
    fn a_crowded_neighbour_does_not_answer_every_query() {
        // 0 and 1 are closest to 2; only 1 is what 2 finds closest.
        let positions = [[0.0, 0.0, 0.0], [0.4, 0.0, 0.0], [0.5, 0.0, 0.0]];
        let grid = Grid::new(&positions, &[[0.0, 0.0, 1.0]; 3], &[0.0, 0.1, 2.0], 1.0);
        let search = Search {
            k: 1,
            max_distance: 1.0,
            min_time_gap: 0.3,
        };
        let nearest = grid.nearest(&grid, &search);
        let pairs: Vec<_> = mutual_pairs(&nearest, 1).collect();
        assert_eq!(pairs, [(1, 2)]);
    }

    #[test]
    fn a_target_keeps_only_its_nearest_claims() {
        let queries = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.3, 0.0, 0.0]];
        let normals = [[0.0, 0.0, 1.0]; 3];
        let queries = Grid::new(&queries, &normals, &[5.0; 3], 1.0);
        let target = Grid::new(&[[0.12, 0.0, 0.0]], &normals[..1], &[0.0], 1.0);
        let search = Search {
            k: 2,
            max_distance: 1.0,
            min_time_gap: 0.3,
        };
        let pairs = claimed_pairs(&target.nearest(&queries, &search), 1);
        assert_eq!(pairs, [(0, 0), (1, 0)]);
    }
}
