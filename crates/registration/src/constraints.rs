// SPDX-License-Identifier: MIT OR Apache-2.0
//! The constraints: each gives residuals, exact Jacobians and weights.

pub mod imu;
pub mod initial;
pub mod motion;
pub mod prior;
pub mod rest;
pub mod shown_noise;
mod stencil;
pub mod surfel_match;
pub mod velocity;

#[cfg(test)]
pub(crate) mod testing;
