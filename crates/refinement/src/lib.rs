// SPDX-License-Identifier: MIT OR Apache-2.0
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod gather;
mod grid;
mod noise;
mod piece;
mod radix;
mod refine;
mod sample;
mod sheet;
mod split;
mod spots;
mod step;
mod steps;
mod surfaces;

pub use noise::Noise;
pub use refine::Refined;
pub use sample::{N_WORDS, Sample, Settings, words_of};
