// SPDX-License-Identifier: MIT OR Apache-2.0
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod key;
mod map;
mod moments;
pub mod sym3;
mod thin;

pub use key::{VoxelKey, voxel_of};
pub use map::{Memory, Tally, Voxel, VoxelMap};
pub use moments::{MIN_POINTS, MIN_WIDTH, Moments};
pub use thin::thin;
