// SPDX-License-Identifier: MIT OR Apache-2.0
//! The one place that releases the GIL, and the one that turns Rust errors into Python's.

use bentwing_kalman::KalmanError;
use bentwing_las::LasError;
use bentwing_ndt::NdtError;
use bentwing_pose_graph::GraphError;
use bentwing_registration::SolveError;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
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

/// As [`detached`], in a pool of its own with `threads` threads (0: one per core).
pub(crate) fn in_pool<T: Ungil + Send>(
    py: Python<'_>,
    threads: usize,
    work: impl Ungil + Send + FnOnce() -> T,
) -> PyResult<T> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|e| PyRuntimeError::new_err(format!("threads: {e}")))?;
    Ok(detached(py, || pool.install(work)))
}

/// The Python exception for a failed solution.
pub(crate) fn solve_error(py: Python<'_>, error: &SolveError) -> PyErr {
    let name = match error {
        SolveError::Singular { .. } => "SingularSystemError",
        SolveError::NotFinite => "DivergedError",
        _ => "EstimationError",
    };
    raised(py, name, &error.to_string())
}

/// The Python exception for a pose graph without solution.
pub(crate) fn graph_error(py: Python<'_>, error: &GraphError) -> PyErr {
    let name = match error {
        GraphError::Loose { .. } | GraphError::Singular { .. } => "SingularSystemError",
        GraphError::NotFinite => "DivergedError",
        GraphError::Factorization(_) => "EstimationError",
        _ => return PyValueError::new_err(error.to_string()),
    };
    raised(py, name, &error.to_string())
}

/// The Python exception for a scan without a pose.
pub(crate) fn ndt_error(py: Python<'_>, error: &NdtError) -> PyErr {
    let name = match error {
        NdtError::TooFewMatches { .. } => "NotEnoughDataError",
        NdtError::Singular { .. } => "SingularSystemError",
        NdtError::NotFinite => "DivergedError",
        _ => "EstimationError",
    };
    raised(py, name, &error.to_string())
}

/// The Python exception for points that no file can hold.
pub(crate) fn las_error(py: Python<'_>, error: &LasError) -> PyErr {
    raised(py, "EstimationError", &error.to_string())
}

/// The Python exception for a filter that cannot go on.
pub(crate) fn kalman_error(py: Python<'_>, error: &KalmanError) -> PyErr {
    raised(py, "DivergedError", &error.to_string())
}

/// An exception of `bentwing.base.errors`.
fn raised(py: Python<'_>, name: &str, message: &str) -> PyErr {
    let class = py
        .import("bentwing.base.errors")
        .and_then(|m| m.getattr(name));
    match class.and_then(|c| c.call1((message,))) {
        Ok(exception) => PyErr::from_value(exception),
        Err(failed) => failed,
    }
}
