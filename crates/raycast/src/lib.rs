// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ranges and distances to a scene of triangles: what the simulator's lidars see, and what a
//! map is compared with.
//!
//! Geometry is double precision throughout, so a range over a town is as exact as one in a room.
#![forbid(unsafe_code)]

mod scene;

pub use scene::{NO_TRIANGLE, Scene, SceneError};
