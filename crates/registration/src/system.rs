// SPDX-License-Identifier: MIT OR Apache-2.0
//! The normal equations and their solution: rows are summed, tied to the past, factorized.

mod dense;
mod error;
mod exported;
mod layout;
pub(crate) mod normal_equations;
mod quadratic;
pub(crate) mod response;
mod rows;
pub(crate) mod solve;
mod sparse;

pub use error::SolveError;
pub use exported::System;
pub use normal_equations::NormalEquations;
pub use response::{PoseResponse, UNMOVED, follow};
pub use rows::RowGroup;
pub use solve::{Solution, Solver};
