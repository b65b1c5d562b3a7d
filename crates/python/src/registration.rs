// SPDX-License-Identifier: MIT OR Apache-2.0
//! `_core.register_window` and what goes in and comes out.

use std::sync::Arc;

use bentwing_registration as core;
use bentwing_registration::{FixedView as RustView, GlobalPrior, Initial, N_GLOBALS, Problem};
use bentwing_surfels::SurfelSet;
use nalgebra::Matrix3;
use numpy::{PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, ToPyArray};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{finite_rows, to_array2};
use crate::errors::{detached, in_pool, solve_error};
use crate::globals::Globals;
use crate::surfels::Surfels;
use crate::trajectory::{Imu, Samples};

#[derive(FromPyObject)]
pub(crate) struct RegistrationSettings {
    knot_interval: f64,
    range_sigma: f64,
    n_neighbors: usize,
    max_match_distance: f64,
    min_match_gap: f64,
    first_cauchy_scale: f64,
    cauchy_scale: f64,
    max_outer: usize,
    n_inner: usize,
    min_translation: f64,
    min_rotation: f64,
    velocity_sigma: f64,
    rate_sigma: f64,
    gyro_sigma: f64,
    accel_sigma: f64,
    motion_accel_density: f64,
    motion_angular_density: f64,
}

impl From<RegistrationSettings> for core::Settings {
    fn from(s: RegistrationSettings) -> Self {
        Self {
            knot_interval: s.knot_interval,
            range_sigma: s.range_sigma,
            n_neighbors: s.n_neighbors,
            max_match_distance: s.max_match_distance,
            min_match_gap: s.min_match_gap,
            first_cauchy_scale: s.first_cauchy_scale,
            cauchy_scale: s.cauchy_scale,
            max_outer: s.max_outer,
            n_inner: s.n_inner,
            min_translation: s.min_translation,
            min_rotation: s.min_rotation,
            velocity_sigma: s.velocity_sigma,
            rate_sigma: s.rate_sigma,
            imu_noise: core::ImuNoise {
                gyro: s.gyro_sigma,
                accel: s.accel_sigma,
            },
            motion_accel_density: s.motion_accel_density,
            motion_angular_density: s.motion_angular_density,
        }
    }
}

/// Immovable surfels in the map.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct FixedView(RustView);

#[pymethods]
impl FixedView {
    /// Freezes the surfels with stamps in `[start, stop)` where `samples` puts them.
    #[new]
    fn new(
        py: Python<'_>,
        sets: Vec<PyRef<'_, Surfels>>,
        start: f64,
        stop: f64,
        samples: &Samples,
        globals: &Globals,
    ) -> PyResult<Self> {
        let sets: Vec<&SurfelSet> = sets.iter().map(|s| s.0.as_ref()).collect();
        let (trajectory, responses, globals) = (&samples.0, &samples.1, &globals.0);
        in_pool(py, 1, || {
            RustView::freeze(&sets, start, stop, trajectory, responses, globals)
        })
        .map(Self)
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }
}

/// Result of a registration.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct Registration(core::Registration);

#[pymethods]
impl Registration {
    /// Corrected trajectory.
    #[getter]
    fn samples(&self) -> Samples {
        Samples(self.0.trajectory.clone(), self.0.responses.clone())
    }

    /// Corrected slow states.
    #[getter]
    fn globals(&self) -> Globals {
        Globals(self.0.globals.clone())
    }

    /// Covariance (57, 57) of the slow states; zero where frozen.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows: Vec<[f64; N_GLOBALS]> = self
            .0
            .covariance
            .row_iter()
            .map(|r| std::array::from_fn(|c| r[c]))
            .collect();
        to_array2(py, &rows)
    }

    /// Covariances (N, 6, 6) of the correction of each sample, computed when they are asked for.
    ///
    /// Rotation first, rad and m, perturbed on the left in the map frame.
    fn sample_covariances<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let found = detached(py, || self.0.sample_covariances());
        let flat: Vec<f64> = found.iter().flat_map(|c| c.iter().copied()).collect();
        flat.to_pyarray(py).reshape([found.len(), 6, 6])
    }

    /// Covariance (6, 6) of the correction at `time`, computed when it is asked for; as of
    /// `sample_covariances`.
    fn covariance_at<'py>(
        &self,
        py: Python<'py>,
        time: f64,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let found = detached(py, || self.0.posterior.at(time));
        let rows: Vec<[f64; 6]> = found
            .row_iter()
            .map(|r| std::array::from_fn(|c| r[c]))
            .collect();
        to_array2(py, &rows)
    }

    /// Correction (57,) that leads from the prior's mean to `globals`.
    #[getter]
    fn offset(&self) -> [f64; N_GLOBALS] {
        self.0.offset
    }

    /// Surfels that took part.
    #[getter]
    fn n_surfels(&self) -> usize {
        self.0.n_surfels
    }

    /// Matches within the window.
    #[getter]
    fn n_matches(&self) -> usize {
        self.0.health.n_moving
    }

    /// Matches with fixed views.
    #[getter]
    fn n_fixed_matches(&self) -> usize {
        self.0.health.n_fixed
    }

    /// Share of the matches with a residual below two standard deviations.
    #[getter]
    fn inlier_share(&self) -> f64 {
        let health = &self.0.health;
        health.n_inliers as f64 / (health.n_moving + health.n_fixed).max(1) as f64
    }

    /// Weighted root mean square of the matches' residuals in standard deviations.
    #[getter]
    fn residual_rms(&self) -> f64 {
        let health = &self.0.health;
        (health.squared_residual / health.weight.max(f64::MIN_POSITIVE)).sqrt()
    }

    /// Eigenvalues (3,) of the mean outer product of the matches' normals, increasing.
    #[getter]
    fn translation_eigenvalues(&self) -> [f64; 3] {
        eigenvalues(&self.0.health.translation, self.0.health.weight)
    }

    /// Eigenvalues (3,) of the mean outer product of the rotations the matches see, increasing.
    #[getter]
    fn rotation_eigenvalues(&self) -> [f64; 3] {
        eigenvalues(&self.0.health.rotation, self.0.health.weight)
    }

    /// Direction (3,) in the map in which the matches say least about the translation.
    #[getter]
    fn weakest_direction(&self) -> [f64; 3] {
        bentwing_voxels::sym3::eigen(&self.0.health.translation)
            .normal
            .into()
    }

    /// Residuals of the gyro over a second, root mean square over what its noise leaves to expect.
    #[getter]
    fn gyro_rms(&self) -> Option<f64> {
        self.0.imu_fit.gyro.map(|fit| fit.rms)
    }

    /// The same of the accelerometer.
    #[getter]
    fn accel_rms(&self) -> Option<f64> {
        self.0.imu_fit.accel.map(|fit| fit.rms)
    }

    /// Correlation of neighbouring residuals of the gyro beyond what is expected.
    #[getter]
    fn gyro_correlation(&self) -> Option<f64> {
        self.0.imu_fit.gyro.map(|fit| fit.correlation)
    }

    /// The same of the accelerometer.
    #[getter]
    fn accel_correlation(&self) -> Option<f64> {
        self.0.imu_fit.accel.map(|fit| fit.correlation)
    }

    /// Outer iterations.
    #[getter]
    fn n_outer(&self) -> usize {
        self.0.n_outer
    }

    /// Whether the last step was below the thresholds.
    #[getter]
    fn converged(&self) -> bool {
        self.0.converged
    }

    /// Samples of the trajectory without inertial data.
    #[getter]
    fn n_blind(&self) -> usize {
        self.0.n_blind
    }
}

fn eigenvalues(sum: &Matrix3<f64>, weight: f64) -> [f64; 3] {
    bentwing_voxels::sym3::eigen(&(sum / weight.max(f64::MIN_POSITIVE))).values
}

/// A finite (57, 57) array as a matrix over the slow states.
pub(crate) fn global_matrix(
    name: &str,
    array: &PyReadonlyArray2<'_, f64>,
) -> PyResult<core::GlobalMatrix> {
    let rows: &[[f64; N_GLOBALS]] = finite_rows(name, array)?;
    if rows.len() != N_GLOBALS {
        let message = format!(
            "{name}: expected shape ({N_GLOBALS}, {N_GLOBALS}), got ({}, {N_GLOBALS})",
            rows.len()
        );
        return Err(PyValueError::new_err(message));
    }
    Ok(core::GlobalMatrix::from_fn(|r, c| rows[r][c]))
}

/// Corrects `samples` and `globals` by surfel matches and inertial samples.
#[pyfunction]
#[pyo3(signature = (
    samples, surfels, views, imu, globals, *, information, offset, frozen, joined, settings,
    threads = 0,
))]
#[allow(
    clippy::large_types_passed_by_value,
    reason = "taken from Python as a whole"
)]
#[allow(clippy::too_many_arguments, reason = "the parts of a problem")]
pub(crate) fn register_window(
    py: Python<'_>,
    samples: &Samples,
    surfels: Vec<PyRef<'_, Surfels>>,
    views: Vec<PyRef<'_, FixedView>>,
    imu: Option<&Imu>,
    globals: &Globals,
    information: PyReadonlyArray2<'_, f64>,
    offset: [f64; N_GLOBALS],
    frozen: [bool; N_GLOBALS],
    joined: bool,
    settings: RegistrationSettings,
    threads: usize,
) -> PyResult<Registration> {
    let information = global_matrix("information", &information)?;
    let sets: Vec<Arc<SurfelSet>> = surfels.iter().map(|s| Arc::clone(&s.0)).collect();
    let views: Vec<&RustView> = views.iter().map(|v| &v.0).collect();
    let imu = imu.map(|imu| &imu.0);
    let problem = Problem {
        trajectory: samples.0.clone(),
        responses: &samples.1,
        sets: &sets,
        views: &views,
        imu,
        globals: globals.0.clone(),
        prior: &GlobalPrior {
            information,
            offset,
            frozen,
        },
        initial: if joined {
            Initial::Joined
        } else {
            Initial::FirstPose
        },
    };
    let settings = settings.into();
    in_pool(py, threads, || core::register_window(&problem, &settings))?
        .map(Registration)
        .map_err(|e| solve_error(py, &e))
}
