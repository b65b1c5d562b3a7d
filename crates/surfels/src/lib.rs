// SPDX-License-Identifier: MIT OR Apache-2.0
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod extract;
mod passage;
mod place;
mod surfel;

pub use extract::{Points, Settings, extract};
pub use place::{PlacedShots, place_points, place_shots};
pub use surfel::SurfelSet;
