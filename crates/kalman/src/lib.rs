// SPDX-License-Identifier: MIT OR Apache-2.0
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod drift;
mod error;
mod features;
mod filter;
mod gain;
mod map;
mod measure;
mod nodes;
mod odometry;
mod predict;
mod state;
mod update;

pub use bentwing_voxels::Memory;
pub use error::KalmanError;
pub use features::{Feature, Features, Sweep, features};
pub use filter::{Filter, Outcome, Pose, Settings, Start};
pub use map::MapSettings;
pub use odometry::OdometryPose;
pub use predict::{Noise, Sample};
pub use state::{DIM, Mounted, Square, State, Tangent, at};
pub use update::Fit;
