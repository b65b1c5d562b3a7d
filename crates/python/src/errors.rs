// SPDX-License-Identifier: MIT OR Apache-2.0
//! The one place that releases the GIL.

use pyo3::marker::Ungil;
use pyo3::prelude::*;

/// Runs `work` without the GIL, so that other Python threads go on.
///
/// The arrays `work` reads must not be modified meanwhile; nothing can prevent that.
#[expect(
    clippy::disallowed_methods,
    reason = "everyone else calls this function"
)]
pub(crate) fn detached<T: Ungil>(py: Python<'_>, work: impl Ungil + FnOnce() -> T) -> T {
    py.detach(work)
}
