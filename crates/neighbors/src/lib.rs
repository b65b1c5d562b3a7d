// SPDX-License-Identifier: MIT OR Apache-2.0
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod grid;
mod mutual;
mod search;

pub use grid::Grid;
pub use mutual::{claimed_pairs, mutual_pairs};
pub use search::{NONE, Neighbors, Search};
