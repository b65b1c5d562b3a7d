// SPDX-License-Identifier: MIT OR Apache-2.0
//! `_core.MapSurvey` and `_core.MapCells`: what the points of a map say about each other.

use bentwing_cells::{Cells, Settings, Survey};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::arrays::{finite, finite_number, finite_rows, require_rows, rows, same};
use crate::errors::in_pool;

type DescribedArrays<'py> = (
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<bool>>,
);

/// Takes the points of a map chunk by chunk.
#[pyclass(module = "bentwing._core")]
pub(crate) struct MapSurvey(Option<Survey>);

#[pymethods]
impl MapSurvey {
    #[new]
    #[pyo3(signature = (*, edge, max_cells, start, step, max_rays, margin))]
    fn new(
        edge: f64,
        max_cells: usize,
        start: f64,
        step: f64,
        max_rays: usize,
        margin: f64,
    ) -> PyResult<Self> {
        for (name, value) in [("edge", edge), ("step", step)] {
            if finite_number(name, value)? <= 0.0 {
                let message = format!("{name}: expected a positive number, got {value}");
                return Err(PyValueError::new_err(message));
            }
        }
        Ok(Self(Some(Survey::new(Settings {
            edge,
            max_cells: max_cells.max(1),
            start: finite_number("start", start)?,
            step,
            max_rays: max_rays.max(1),
            margin: finite_number("margin", margin)?,
        }))))
    }

    /// Adds points with the unit directions, lengths and times of their beams.
    #[allow(clippy::too_many_arguments, reason = "arrays by name in Python")]
    #[pyo3(signature = (points, *, beams, ranges, times, doubtful, threads=0))]
    fn add(
        &mut self,
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        beams: PyReadonlyArray2<'_, f32>,
        ranges: PyReadonlyArray1<'_, f32>,
        times: PyReadonlyArray1<'_, f64>,
        doubtful: PyReadonlyArray1<'_, bool>,
        threads: usize,
    ) -> PyResult<()> {
        let points = finite_rows("points", &points)?;
        let n = points.len();
        let (beams, ranges) = (rows("beams", &beams)?, same("ranges", &ranges, n)?);
        let (times, doubtful) = (finite("times", &times, n)?, same("doubtful", &doubtful, n)?);
        require_rows("beams", beams.len(), n)?;
        let survey = self.0.as_mut().ok_or_else(finished)?;
        in_pool(py, threads, || {
            survey.add(points, beams, ranges, times, doubtful);
        })
    }

    /// Follows the beams; ends the survey.
    #[pyo3(signature = (*, threads=0))]
    fn finish(&mut self, py: Python<'_>, threads: usize) -> PyResult<MapCells> {
        let survey = self.0.take().ok_or_else(finished)?;
        in_pool(py, threads, || MapCells(survey.finish()))
    }
}

/// Cells of a complete survey.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct MapCells(Cells);

#[pymethods]
impl MapCells {
    /// Edge of the cells, m.
    #[getter]
    fn edge(&self) -> f64 {
        self.0.edge()
    }

    /// Number of cells.
    #[getter]
    fn n_cells(&self) -> usize {
        self.0.n_cells()
    }

    /// Number of cells whose content moved.
    #[getter]
    fn n_moving(&self) -> usize {
        self.0.n_moving()
    }

    /// Number of beams that were followed.
    #[getter]
    fn n_rays(&self) -> usize {
        self.0.n_rays()
    }

    /// Incidence (rad), thickness (m), whether it moved and whether other points support it.
    #[pyo3(signature = (points, *, beams, threads=0))]
    fn describe<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        beams: PyReadonlyArray2<'py, f32>,
        threads: usize,
    ) -> PyResult<DescribedArrays<'py>> {
        let points = finite_rows("points", &points)?;
        let beams = rows("beams", &beams)?;
        require_rows("beams", beams.len(), points.len())?;
        let found = in_pool(py, threads, || self.0.describe(points, beams))?;
        Ok((
            found.incidence.into_pyarray(py),
            found.thickness.into_pyarray(py),
            found.is_moving.into_pyarray(py),
            found.is_supported.into_pyarray(py),
        ))
    }
}

fn finished() -> PyErr {
    PyRuntimeError::new_err("the survey is finished")
}
