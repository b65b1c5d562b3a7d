// SPDX-License-Identifier: MIT OR Apache-2.0
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod blows;
mod correction_spline;
mod head;
mod imu;
mod limits;
mod motor;
mod propagation;
mod range_bias;
mod samples;
pub mod se3;
pub mod so3;
mod unit;

pub use correction_spline::{Basis, CorrectionSpline, StencilWeights};
pub use head::{Head, LidarClock};
pub use imu::{Imu, Increment, NodeForce};
pub use motor::{Motor, MotorErrors};
pub use propagation::{extend_constant_velocity, extend_inertial};
pub use range_bias::{RangeBias, Sight};
pub use samples::{Pose, Trajectory, TrajectoryError};
pub use unit::InertialUnit;
