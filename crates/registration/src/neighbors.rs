// SPDX-License-Identifier: MIT OR Apache-2.0
//! Finds, for every surfel, the nearest surfels in position and normal that were seen at another
//! time (Kaul 2015, section 2.1, which uses a kd-tree with a time threshold in the search).
//!
//! Features are six numbers: the position in units of the voxel size and the unit normal. Matches
//! further apart than `max_distance` are useless, so the search is not a tree but a sorted voxel
//! grid with cells of that size: the candidates of all queries in a cell are nine contiguous runs of
//! memory, scanned without a branch per candidate. The result is exact, and the same for any number
//! of threads.
//!
//! ```
//! use bentwing_registration::neighbors::{Grid, Search};
//!
//! let positions = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.1, 0.0]];
//! let normals = [[0.0, 0.0, 1.0]; 3];
//! let grid = Grid::new(&positions, &normals, &[0.0, 0.1, 2.0], 1.0);
//! let search = Search { k: 1, max_distance: 1.0, min_time_gap: 0.3 };
//! let nearest = grid.nearest(&grid, &search);
//! assert_eq!(nearest.of(0), [2]); // point 1 is closer, but was seen at almost the same time
//! ```

mod grid;
mod mutual;
mod search;

pub use grid::Grid;
pub use mutual::{claimed_pairs, mutual_pairs};
pub use search::{NONE, Neighbors, Search};
