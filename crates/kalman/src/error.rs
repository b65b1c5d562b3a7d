// SPDX-License-Identifier: MIT OR Apache-2.0
//! Why the filter cannot go on.

use thiserror::Error;

/// What ends an estimate.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum KalmanError {
    /// A number that is not finite, from finite input.
    #[error("the filter diverged at {time:.2} s: its state is not finite")]
    NotFinite {
        /// s.
        time: f64,
    },
    /// A velocity that no carrier has.
    #[error(
        "the filter diverged at {time:.2} s: it moves at {speed:.0} m/s; the lidar's points do not \
         fit the inertial samples (mount, encoder, units)"
    )]
    TooFast {
        /// s.
        time: f64,
        /// m/s.
        speed: f64,
    },
}
