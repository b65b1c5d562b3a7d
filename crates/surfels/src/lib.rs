// SPDX-License-Identifier: MIT OR Apache-2.0
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod extract;
mod moments;
mod place;
mod surfel;
pub mod sym3;
mod thin;
pub mod voxel;

pub use extract::{Points, Settings, extract};
pub use moments::Moments;
pub use place::place_points;
pub use surfel::SurfelSet;
pub use thin::thin;
