// SPDX-License-Identifier: MIT OR Apache-2.0
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod blocks;
mod calibration;
mod cholesky;
mod chordal;
mod dogleg;
mod equations;
mod error;
mod graph;
mod motion;
mod poses;
mod readmission;
mod robust;
mod solve;
mod supernodes;
mod terms;
#[cfg(test)]
mod testing;
mod voting;

pub use error::GraphError;
pub use graph::{GravityTerm, Link, PoseGraph};
pub use robust::Robust;
pub use solve::{Settings, Solution, solve};
