// SPDX-License-Identifier: MIT OR Apache-2.0
//! `_core.SurfaceSample`: where along its beam each point of a map most probably is.

use bentwing_refinement::{N_WORDS, Noise, Sample, Settings, words_of};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::arrays::{finite, finite_number, finite_rows, require_rows, rows, same, to_array2};
use crate::errors::in_pool;

/// The noise, moves and standard deviations.
type Refined<'py> = (
    RangeNoise,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
);

/// How noisy the ranges of a map are, as its smooth surfaces show it.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct RangeNoise(Noise);

#[pymethods]
impl RangeNoise {
    /// Standard deviations of ranges, m.
    fn sigmas<'py>(
        &self,
        py: Python<'py>,
        ranges: PyReadonlyArray1<'_, f32>,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let ranges = same("ranges", &ranges, ranges.len())?;
        let sigmas: Vec<f32> = ranges.iter().map(|&r| self.0.sigma(r) as f32).collect();
        Ok(sigmas.into_pyarray(py))
    }
}

/// Takes the points of a part of a map.
#[pyclass(module = "bentwing._core")]
pub(crate) struct SurfaceSample(Option<Sample>);

#[pymethods]
impl SurfaceSample {
    #[new]
    #[pyo3(signature = (*, edge, n_levels, enough, fewest_passes, most_noise))]
    fn new(
        edge: f64,
        n_levels: u32,
        enough: usize,
        fewest_passes: f64,
        most_noise: f64,
    ) -> PyResult<Self> {
        positive("edge", edge)?;
        Ok(Self(Some(Sample::new(Settings {
            edge,
            n_levels: n_levels.clamp(1, 8),
            enough: enough.max(1),
            fewest_passes: finite_number("fewest_passes", fewest_passes)?,
            most_noise: finite_number("most_noise", most_noise)?,
        }))))
    }

    /// Adds points as `shot_words` has them, and whether each is to be refined or only tells where others
    /// are.
    #[pyo3(signature = (words, *, own))]
    fn add(
        &mut self,
        py: Python<'_>,
        words: PyReadonlyArray2<'_, u32>,
        own: PyReadonlyArray1<'_, bool>,
    ) -> PyResult<()> {
        let words = rows::<_, N_WORDS>("words", &words)?;
        let own = same("own", &own, words.len())?;
        let sample = self.0.as_mut().ok_or_else(used)?;
        crate::errors::detached(py, || sample.add(words, own));
        Ok(())
    }

    /// The noise of the ranges: the given one, or else that which smooth surfaces show; and of the points
    /// to be refined, in their order, the moves along the beams (m, away from the lidar; 0 where a point
    /// stays) and the standard deviations that are left (m). None without smooth surfaces. Ends the sample.
    #[pyo3(signature = (*, noise=None, threads=0))]
    fn refine<'py>(
        &mut self,
        py: Python<'py>,
        noise: Option<&RangeNoise>,
        threads: usize,
    ) -> PyResult<Option<Refined<'py>>> {
        let sample = self.0.take().ok_or_else(used)?;
        let known = noise.map(|n| n.0.clone());
        let found = in_pool(py, threads, || sample.refine(known))?;
        Ok(found.map(|f| {
            let columns = (f.moves.into_pyarray(py), f.sigmas.into_pyarray(py));
            (RangeNoise(f.noise), columns.0, columns.1)
        }))
    }
}

/// Points with the unit directions, lengths and times of their beams as a sample takes them, (N, 5).
#[pyfunction]
#[pyo3(signature = (points, *, beams, ranges, times, edge, pass_length))]
pub(crate) fn shot_words<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    beams: PyReadonlyArray2<'py, f32>,
    ranges: PyReadonlyArray1<'py, f32>,
    times: PyReadonlyArray1<'py, f64>,
    edge: f64,
    pass_length: f64,
) -> PyResult<Bound<'py, PyArray2<u32>>> {
    let points = finite_rows("points", &points)?;
    let n = points.len();
    let (beams, ranges) = (rows("beams", &beams)?, same("ranges", &ranges, n)?);
    require_rows("beams", beams.len(), n)?;
    let times = finite("times", &times, n)?;
    let sizes = (
        positive("edge", edge)?,
        positive("pass_length", pass_length)?,
    );
    let words = crate::errors::detached(py, || words_of(points, beams, ranges, times, sizes));
    to_array2(py, &words)
}

fn positive(name: &str, value: f64) -> PyResult<f64> {
    if finite_number(name, value)? > 0.0 {
        return Ok(value);
    }
    let message = format!("{name}: expected a positive number, got {value}");
    Err(PyValueError::new_err(message))
}

fn used() -> PyErr {
    PyRuntimeError::new_err("the sample is used up")
}
