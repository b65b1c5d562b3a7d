// SPDX-License-Identifier: MIT OR Apache-2.0
//! Keeps the pairs that found each other.

use crate::Neighbors;

/// Pairs `(a, b)` with `b` in the list of `a` (`forward`) and `a` in the list of `b` (`backward`),
/// ordered by `a`, then by distance.
pub fn mutual_pairs<'a>(
    forward: &'a Neighbors,
    backward: &'a Neighbors,
) -> impl Iterator<Item = (u32, u32)> + 'a {
    (0u32..).take(forward.len()).flat_map(move |a| {
        let found = forward.of(a as usize).iter().copied();
        found
            .filter(move |&b| backward.of(b as usize).contains(&a))
            .map(move |b| (a, b))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Grid, Search};

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
        let pairs: Vec<_> = mutual_pairs(&nearest, &nearest).collect();
        assert_eq!(pairs, [(1, 2), (2, 1)]);
    }
}
