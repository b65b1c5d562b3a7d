// SPDX-License-Identifier: MIT OR Apache-2.0
//! `_core.extract_surfels` and the surfels it returns.

use std::sync::Arc;

use bentwing_surfels::{Points, SurfelSet};
use nalgebra::Matrix3;
use numpy::{
    PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods, ToPyArray,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{
    angles as angles_of, finite, finite_number, finite_rows, times, to_array2, vectors,
};
use crate::errors::in_pool;
use crate::globals::Globals;
use crate::trajectory::Samples;

#[derive(FromPyObject)]
pub(crate) struct SurfelSettings {
    voxel_size: f64,
    n_levels: usize,
    max_gap: f64,
    max_span: f64,
    min_points: u32,
    min_planarity: f64,
    min_width_ratio: f64,
    min_width: f64,
    min_incidence_cosine: f64,
    max_rate: f64,
}

/// Surfels of a stretch of time, in the lidar frame at their mean stamps.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct Surfels(pub(crate) Arc<SurfelSet>);

/// What makes surfels again: as the arguments of `Surfels::new`.
type Columns<'py> = (
    Vec<f64>,
    Vec<usize>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<u32>>,
);

#[pymethods]
impl Surfels {
    /// Surfels that are known already: those of level `l` are the rows `level_starts[l]` up to
    /// `level_starts[l + 1]`.
    #[new]
    #[allow(clippy::too_many_arguments, reason = "the columns of a table")]
    fn new(
        voxel_sizes: Vec<f64>,
        level_starts: Vec<usize>,
        means: PyReadonlyArray2<'_, f64>,
        covariances: PyReadonlyArray2<'_, f64>,
        normals: PyReadonlyArray2<'_, f64>,
        stamps: PyReadonlyArray1<'_, f64>,
        angles: PyReadonlyArray1<'_, f64>,
        n_points: PyReadonlyArray1<'_, u32>,
    ) -> PyResult<Self> {
        let means = vectors(finite_rows("means", &means)?);
        let covariances: &[[f64; 9]] = finite_rows("covariances", &covariances)?;
        let normals = vectors(finite_rows("normals", &normals)?);
        let n = means.len();
        if [covariances.len(), normals.len(), n_points.len()] != [n; 3] {
            return Err(PyValueError::new_err(format!(
                "expected as many covariances, normals and n_points as means, {n}, got {}, {} and {}",
                covariances.len(),
                normals.len(),
                n_points.len()
            )));
        }
        let bounds = [level_starts.first(), level_starts.last()];
        let cuts = level_starts.is_sorted() && level_starts.len() == voxel_sizes.len() + 1;
        if !cuts || bounds != [Some(&0), Some(&n)] {
            return Err(PyValueError::new_err(format!(
                "level_starts: expected {} increasing numbers from 0 to {n}, got {level_starts:?}",
                voxel_sizes.len() + 1
            )));
        }
        for size in &voxel_sizes {
            finite_number("voxel_sizes", *size)?;
        }
        Ok(Self(Arc::new(SurfelSet {
            means,
            covariances: covariances
                .iter()
                .map(|c| Matrix3::from_row_slice(c))
                .collect(),
            normals,
            stamps: finite("stamps", &stamps, n)?.to_vec(),
            angles: finite("angles", &angles, n)?.to_vec(),
            n_points: n_points.as_array().to_vec(),
            level_starts,
            voxel_sizes,
        })))
    }

    /// For copies and pickles.
    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<Columns<'py>> {
        let by_rows = |c: &Matrix3<f64>| std::array::from_fn(|i| c[(i / 3, i % 3)]);
        let covariances: Vec<[f64; 9]> = self.0.covariances.iter().map(by_rows).collect();
        Ok((
            self.0.voxel_sizes.clone(),
            self.0.level_starts.clone(),
            self.means(py)?,
            to_array2(py, &covariances)?,
            self.normals(py)?,
            self.stamps(py),
            self.angles(py),
            self.0.n_points.to_pyarray(py),
        ))
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    /// Mean stamps (N,), s, lidar clock.
    #[getter]
    fn stamps<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.stamps.to_pyarray(py)
    }

    /// Means (N, 3), m, lidar frame.
    #[getter]
    fn means<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        to_array2(
            py,
            &self
                .0
                .means
                .iter()
                .map(|&m| m.into())
                .collect::<Vec<[f64; 3]>>(),
        )
    }

    /// Unit normals (N, 3) towards the sensor, lidar frame.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        to_array2(
            py,
            &self
                .0
                .normals
                .iter()
                .map(|&n| n.into())
                .collect::<Vec<[f64; 3]>>(),
        )
    }

    /// Mean encoder angles (N,), rad; zero for heads without motor.
    #[getter]
    fn angles<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.angles.to_pyarray(py)
    }

    /// Voxel size of each surfel's level (N,), m.
    #[getter]
    fn voxel_sizes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let of_level = |l: usize| self.0.level(l).map(move |_| self.0.voxel_sizes[l]);
        (0..self.0.n_levels())
            .flat_map(of_level)
            .collect::<Vec<f64>>()
            .to_pyarray(py)
    }
}

/// Extracts surfels from lidar points placed with `samples`.
#[pyfunction]
#[pyo3(signature = (points, stamps, angles, samples, globals, *, settings, range_sigma, threads = 0))]
#[allow(clippy::too_many_arguments, reason = "the arrays of a batch")]
pub(crate) fn extract_surfels(
    py: Python<'_>,
    points: PyReadonlyArray2<'_, f64>,
    stamps: PyReadonlyArray1<'_, f64>,
    angles: Option<PyReadonlyArray1<'_, f64>>,
    samples: &Samples,
    globals: &Globals,
    settings: SurfelSettings,
    range_sigma: f64,
    threads: usize,
) -> PyResult<Surfels> {
    let points = finite_rows("points", &points)?;
    let stamps = times("stamps", &stamps, points.len())?;
    let has_motor = globals.0.head.motor.is_some();
    let angles = angles_of(angles.as_ref(), points.len(), has_motor)?;
    if !(range_sigma.is_finite() && range_sigma >= 0.0) {
        let message = format!("range_sigma: expected zero or more, got {range_sigma} m");
        return Err(PyValueError::new_err(message));
    }
    let settings = bentwing_surfels::Settings {
        voxel_size: settings.voxel_size,
        n_levels: settings.n_levels,
        max_gap: settings.max_gap,
        max_span: settings.max_span,
        min_points: settings.min_points,
        min_planarity: settings.min_planarity,
        min_width_ratio: settings.min_width_ratio,
        min_width: settings.min_width,
        min_incidence_cosine: settings.min_incidence_cosine,
        max_rate: settings.max_rate,
        range_sigma,
    };
    let points = Points {
        points,
        stamps,
        angles,
    };
    let (samples, head) = (&samples.0, &globals.0.head);
    let set = in_pool(py, threads, || {
        bentwing_surfels::extract(points, samples, head, &settings)
    })?;
    Ok(Surfels(Arc::new(set)))
}
