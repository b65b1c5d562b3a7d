// SPDX-License-Identifier: MIT OR Apache-2.0
//! `_core.las_records`: points as LAS stores them.

use bentwing_las::{Columns, Extra, Scaling, records};
use numpy::{
    Element, IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{finite, finite_number, rows};
use crate::errors::{in_pool, las_error};

type Column<'py, T> = Option<PyReadonlyArray1<'py, T>>;

/// Records of point format 6 with the extra bytes in `stored`, one behind the other (bytes).
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "arrays by name in Python")]
#[pyo3(signature = (
    points, *, times, ranges, intensity, ring, incidence, thickness, shift, sigma, run_id,
    stored, offsets, step,
    gps_origin, intensity_scale, threads = 0
))]
pub(crate) fn las_records<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    times: PyReadonlyArray1<'py, f64>,
    ranges: PyReadonlyArray1<'py, f32>,
    intensity: Column<'py, f32>,
    ring: Column<'py, u16>,
    incidence: Column<'py, f32>,
    thickness: Column<'py, f32>,
    shift: Column<'py, f32>,
    sigma: Column<'py, f32>,
    run_id: Column<'py, u16>,
    stored: Vec<String>,
    offsets: [f64; 3],
    step: f64,
    gps_origin: f64,
    intensity_scale: f32,
    threads: usize,
) -> PyResult<Bound<'py, PyArray1<u8>>> {
    let points = rows("points", &points)?;
    let n = points.len();
    let ranges = Some(ranges);
    let columns = Columns {
        points,
        times: finite("times", &times, n)?,
        ranges: column("ranges", ranges.as_ref(), n)?.unwrap_or_default(),
        intensity: column("intensity", intensity.as_ref(), n)?,
        ring: extra("ring", ring.as_ref(), n, &stored)?,
        incidence: extra("incidence", incidence.as_ref(), n, &stored)?,
        thickness: extra("thickness", thickness.as_ref(), n, &stored)?,
        shift: extra("shift", shift.as_ref(), n, &stored)?,
        sigma: extra("sigma", sigma.as_ref(), n, &stored)?,
        run_id: extra("run_id", run_id.as_ref(), n, &stored)?,
    };
    let scaling = Scaling {
        offsets,
        step: finite_number("step", step)?,
        gps_origin: finite_number("gps_origin", gps_origin)?,
        intensity: intensity_scale,
    };
    let found = in_pool(py, threads, || records(&columns, &scaling))?;
    Ok(found.map_err(|e| las_error(py, &e))?.into_pyarray(py))
}

fn column<'a, T: Element>(
    name: &str,
    array: Option<&'a PyReadonlyArray1<'_, T>>,
    n: usize,
) -> PyResult<Option<&'a [T]>> {
    let Some(array) = array else { return Ok(None) };
    if array.len() != n {
        let message = format!(
            "{name}: expected {n} values as points has, got {}",
            array.len()
        );
        return Err(PyValueError::new_err(message));
    }
    let not_contiguous = |_| PyValueError::new_err(format!("{name}: expected a contiguous array"));
    array.as_slice().map(Some).map_err(not_contiguous)
}

fn extra<'a, T: Element>(
    name: &str,
    array: Option<&'a PyReadonlyArray1<'_, T>>,
    n: usize,
    stored: &[String],
) -> PyResult<Extra<'a, T>> {
    Ok(Extra {
        is_stored: stored.iter().any(|s| s == name),
        values: column(name, array, n)?,
    })
}
