// SPDX-License-Identifier: MIT OR Apache-2.0
//! Why there is no solution.

use thiserror::Error;

/// Why the normal equations have no solution.
#[derive(Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SolveError {
    /// Finite differences of the samples would reach over more knots than a row has.
    #[error(
        "poses every {dt} s are too sparse for knots every {knot_interval} s: expected more than two \
         poses per knot"
    )]
    Sparse {
        /// Interval of the poses, s.
        dt: f64,
        /// Interval of the knots, s.
        knot_interval: f64,
    },
    /// An unknown that nothing constrains.
    #[error("the normal equations are singular at {unknown}")]
    Singular {
        /// Name of the first unknown without information.
        unknown: String,
    },
    /// The equations hold NaN or infinity.
    #[error("the normal equations hold a value that is not finite")]
    NotFinite,
    /// The factorization gave up for a reason of its own (memory, index range).
    #[error("the sparse factorization failed: {0}")]
    Factorization(String),
}
