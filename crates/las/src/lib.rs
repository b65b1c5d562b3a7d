// SPDX-License-Identifier: MIT OR Apache-2.0
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod arithmetic;
mod integers;
mod layer;
mod laz;
mod records;
mod returns;

pub use laz::{Appended, Chunks};
pub use records::{Columns, Extra, LasError, Scaling, records};
