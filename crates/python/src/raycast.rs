// SPDX-License-Identifier: MIT OR Apache-2.0
//! `_core.Scene`: rays and distances to a triangle mesh.
#![expect(
    clippy::needless_pass_by_value,
    reason = "PyO3 extracts arguments by value"
)]

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

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

/// The rows of an (N, 3) C-contiguous array.
fn rows<'a, T: numpy::Element>(
    name: &str,
    array: &'a PyReadonlyArray2<'_, T>,
) -> PyResult<&'a [[T; 3]]> {
    let shape = array.shape();
    if shape[1] != 3 {
        let message = format!(
            "{name}: expected shape (N, 3), got ({}, {})",
            shape[0], shape[1]
        );
        return Err(PyValueError::new_err(message));
    }
    let not_contiguous = || PyValueError::new_err(format!("{name}: expected a C-contiguous array"));
    // `as_slice` alone would accept Fortran order and read columns as rows.
    if !array.is_c_contiguous() {
        return Err(not_contiguous());
    }
    let flat = array.as_slice().map_err(|_strided| not_contiguous())?;
    Ok(flat.as_chunks().0)
}

/// As [`rows`], for coordinates: refuses NaN and infinity.
fn finite_rows<'a>(name: &str, array: &'a PyReadonlyArray2<'_, f64>) -> PyResult<&'a [[f64; 3]]> {
    let rows = rows(name, array)?;
    match rows
        .iter()
        .position(|row| !row.iter().all(|value| value.is_finite()))
    {
        None => Ok(rows),
        Some(row) => {
            let message = format!("{name}: row {row} is not finite: {:?}", rows[row]);
            Err(PyValueError::new_err(message))
        }
    }
}
