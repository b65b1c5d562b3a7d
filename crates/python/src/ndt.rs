// SPDX-License-Identifier: MIT OR Apache-2.0
//! Registration of scans by the normal-distributions transform.

use bentwing_ndt as core;
use bentwing_ndt::{Expectation, NdtError};
use nalgebra::{Isometry3, Matrix3, Translation3};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray2, ToPyArray};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{finite_number, finite_rows, finite_vector, unit_quaternion, xyzw};
use crate::errors::{in_pool, ndt_error};

type Transform = ([f64; 3], [f64; 4]);

fn isometry(name: &str, (t, q): &Transform) -> PyResult<Isometry3<f64>> {
    let translation = Translation3::from(finite_vector(name, *t)?);
    Ok(Isometry3::from_parts(
        translation,
        unit_quaternion(name, q)?,
    ))
}

fn positive(name: &str, value: f64) -> PyResult<f64> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    let message = format!("{name}: expected a positive number, got {value}");
    Err(PyValueError::new_err(message))
}

/// The surfaces that keyframes have seen.
#[pyclass(module = "bentwing._core")]
pub(crate) struct NdtReference(core::Reference);

#[pymethods]
impl NdtReference {
    #[new]
    #[pyo3(signature = (*, voxel_size, n_levels, sigma, roughness))]
    fn new(voxel_size: f64, n_levels: usize, sigma: f64, roughness: f64) -> PyResult<Self> {
        if !(1..=16).contains(&n_levels) {
            let message = format!("n_levels: expected 1 to 16, got {n_levels}");
            return Err(PyValueError::new_err(message));
        }
        let shape = core::Shape {
            sigma: positive("sigma", sigma)?,
            roughness: positive("roughness", roughness)?,
        };
        let voxel_size = positive("voxel_size", voxel_size)?;
        Ok(Self(core::Reference::new(voxel_size, n_levels, shape)))
    }

    /// Number of distributions on all levels.
    fn __len__(&self) -> usize {
        self.0.n_surfaces()
    }

    /// Adds the points of a keyframe.
    #[pyo3(signature = (points, pose, *, lidar, threads = 0))]
    fn insert(
        &mut self,
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        pose: Transform,
        lidar: [f64; 3],
        threads: usize,
    ) -> PyResult<()> {
        let points = finite_rows("points", &points)?;
        let pose = isometry("pose", &pose)?;
        let lidar = finite_vector("lidar", lidar)?;
        let reference = &mut self.0;
        in_pool(py, threads, || reference.insert(points, &pose, &lidar))
    }

    /// Forgets what is farther than `radius` from `centre`.
    #[pyo3(signature = (centre, radius, *, threads = 0))]
    fn keep_within(
        &mut self,
        py: Python<'_>,
        centre: [f64; 3],
        radius: f64,
        threads: usize,
    ) -> PyResult<()> {
        let (centre, radius) = (
            finite_vector("centre", centre)?,
            positive("radius", radius)?,
        );
        let reference = &mut self.0;
        in_pool(py, threads, || reference.keep_within(&centre, radius))
    }

    /// Finds the pose at which the points of a scan fit what the keyframes saw.
    #[pyo3(signature = (
        points, expected, *, rotation_sigma, translation_sigma, independence, coarse = true, threads = 0,
    ))]
    #[allow(clippy::too_many_arguments, reason = "the parts of a problem")]
    fn register(
        &self,
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        expected: Transform,
        rotation_sigma: f64,
        translation_sigma: f64,
        independence: f64,
        coarse: bool,
        threads: usize,
    ) -> PyResult<NdtRegistration> {
        let points = finite_rows("points", &points)?;
        let expected = Expectation {
            pose: isometry("expected", &expected)?,
            rotation_sigma: positive("rotation_sigma", rotation_sigma)?,
            translation_sigma: positive("translation_sigma", translation_sigma)?,
            independence: positive("independence", independence)?,
        };
        let reference = &self.0;
        in_pool(py, threads, || {
            core::register(reference, points, &expected, coarse)
        })?
        .map(NdtRegistration)
        .map_err(|e: NdtError| ndt_error(py, &e))
    }
}

/// Result of a registration to a reference.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct NdtRegistration(core::Registration);

#[pymethods]
impl NdtRegistration {
    /// Position (3,) of the scan, m, map frame.
    #[getter]
    fn translation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let t = &self.0.pose.translation.vector;
        vec![t.x, t.y, t.z].into_pyarray(py)
    }

    /// Rotation (4,) of the scan, x y z w.
    #[getter]
    fn quat_xyzw<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        xyzw(&self.0.pose.rotation).to_pyarray(py)
    }

    /// Points in voxels with a distribution.
    #[getter]
    fn n_matched(&self) -> usize {
        self.0.n_matched
    }

    /// Share of the matched points within two standard deviations.
    #[getter]
    fn inlier_share(&self) -> f64 {
        self.0.inlier_share
    }

    /// Weighted root mean square of the distances in standard deviations.
    #[getter]
    fn residual_rms(&self) -> f64 {
        self.0.residual_rms
    }

    /// Weighted root mean square of the distances, m.
    #[getter]
    fn rmse(&self) -> f64 {
        self.0.rmse
    }

    /// Eigenvalues (3) of the information about the translation, as shares of their sum, increasing.
    #[getter]
    fn translation_eigenvalues(&self) -> [f64; 3] {
        shares(&self.0.translation)
    }

    /// Eigenvalues (3) of the information about the rotation, as shares of their sum, increasing.
    #[getter]
    fn rotation_eigenvalues(&self) -> [f64; 3] {
        shares(&self.0.rotation)
    }

    /// Evaluations of the score.
    #[getter]
    fn n_iterations(&self) -> usize {
        self.0.iterations
    }

    /// Whether the last step was short enough.
    #[getter]
    fn converged(&self) -> bool {
        self.0.converged
    }
}

fn shares(information: &Matrix3<f64>) -> [f64; 3] {
    let sum = information.trace().max(f64::MIN_POSITIVE);
    bentwing_voxels::sym3::eigen(&(information / sum)).values
}

/// Indices of some points, evenly in space: the first in each voxel, and evenly chosen ones of these
/// where they are too many.
#[pyfunction]
#[pyo3(signature = (points, *, spacing, most))]
pub(crate) fn thin_points<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'_, f64>,
    spacing: f64,
    most: usize,
) -> PyResult<Bound<'py, PyArray1<usize>>> {
    let points = finite_rows("points", &points)?;
    let spacing = positive("spacing", finite_number("spacing", spacing)?)?;
    Ok(
        crate::errors::detached(py, || bentwing_voxels::thin(points, spacing, most))
            .into_pyarray(py),
    )
}
