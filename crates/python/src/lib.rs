// SPDX-License-Identifier: MIT OR Apache-2.0
//! Python bindings: checks arrays, releases the GIL, maps errors; holds no algorithm.

#![allow(
    clippy::needless_pass_by_value,
    reason = "PyO3 hands arrays and lists over by value"
)]

use pyo3::prelude::*;

mod arrays;
mod cells;
mod errors;
mod global;
mod globals;
mod kalman;
mod las;
mod laz;
mod ndt;
mod pose_graph;
mod raycast;
mod refinement;
mod registration;
mod surfels;
mod trajectory;

/// The compiled core of bentwing.
#[pymodule(gil_used = true)]
mod _core {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::cells::{MapCells, MapSurvey};
    #[pymodule_export]
    use crate::global::{GlobalRegistration, Piece, register_globally};
    #[pymodule_export]
    use crate::globals::Globals;
    #[pymodule_export]
    use crate::kalman::{KalmanFilter, KalmanSweep};
    #[pymodule_export]
    use crate::las::las_records;
    #[pymodule_export]
    use crate::laz::LazCompressor;
    #[pymodule_export]
    use crate::ndt::{NdtReference, NdtRegistration, thin_points};
    #[pymodule_export]
    use crate::pose_graph::{PoseGraphSolution, solve_pose_graph};
    #[pymodule_export]
    use crate::raycast::Scene;
    #[pymodule_export]
    use crate::refinement::{RangeNoise, SurfaceSample, shot_words};
    #[pymodule_export]
    use crate::registration::{FixedView, Registration, register_window};
    #[pymodule_export]
    use crate::surfels::{Surfels, extract_surfels};
    #[pymodule_export]
    use crate::trajectory::{Imu, Samples};

    #[pymodule_init]
    fn init(m: &Bound<'_, PyModule>) -> PyResult<()> {
        m.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
