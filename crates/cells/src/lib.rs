// SPDX-License-Identifier: MIT OR Apache-2.0
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod block;
mod cell;
mod describe;
mod moving;
mod rays;
mod survey;
mod walk;

pub use describe::{Cells, Described};
pub use survey::{Settings, Survey};
