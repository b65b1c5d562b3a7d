// SPDX-License-Identifier: MIT OR Apache-2.0
//! `_core.Scene`: rays and distances to a triangle mesh.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{finite_rows, rows};
use crate::errors::detached;

type RangesAndTriangles<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<i32>>);

/// Triangles that can be asked for the first hit along a ray and the nearest point.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct Scene(bentwing_raycast::Scene);

#[pymethods]
impl Scene {
    #[new]
    fn new(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        triangles: PyReadonlyArray2<'_, u32>,
    ) -> PyResult<Self> {
        let vertices = finite_rows("vertices", &vertices)?;
        let triangles = rows("triangles", &triangles)?.to_vec();
        detached(py, || bentwing_raycast::Scene::new(vertices, triangles))
            .map(Self)
            .map_err(|error| PyValueError::new_err(error.to_string()))
    }

    /// Number of triangles.
    #[getter]
    fn n_triangles(&self) -> usize {
        self.0.n_triangles()
    }

    /// Range and triangle of the first surface along each ray; infinity and -1 without one.
    fn cast<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f64>,
        directions: PyReadonlyArray2<'py, f64>,
        max_range: f64,
    ) -> PyResult<RangesAndTriangles<'py>> {
        let origins = finite_rows("origins", &origins)?;
        let directions = finite_rows("directions", &directions)?;
        if origins.len() != directions.len() {
            let message = format!(
                "directions: expected {} rows as origins has, got {}",
                origins.len(),
                directions.len()
            );
            return Err(PyValueError::new_err(message));
        }
        if max_range.is_nan() || max_range <= 0.0 {
            return Err(PyValueError::new_err(format!(
                "max_range: expected a positive number, got {max_range}"
            )));
        }
        let (ranges, triangles) = detached(py, || self.0.cast(origins, directions, max_range));
        Ok((ranges.into_pyarray(py), triangles.into_pyarray(py)))
    }

    /// Distance to the nearest surface (negative behind it) and its triangle.
    fn distance<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<RangesAndTriangles<'py>> {
        let points = finite_rows("points", &points)?;
        let (distances, triangles) = detached(py, || self.0.distance(points));
        Ok((distances.into_pyarray(py), triangles.into_pyarray(py)))
    }
}
