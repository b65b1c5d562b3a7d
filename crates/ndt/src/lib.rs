// SPDX-License-Identifier: MIT OR Apache-2.0
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod gaussian;
mod grid;
mod reference;
mod register;
mod score;

pub use gaussian::Shape;
pub use reference::Reference;
pub use register::{Expectation, NdtError, Registration, register};
