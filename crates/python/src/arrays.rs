// SPDX-License-Identifier: MIT OR Apache-2.0
//! Checked views of `NumPy` arrays: shape, layout, finiteness and order of time.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use numpy::{
    PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods, ToPyArray,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The rows of an (N, D) C-contiguous array.
pub(crate) fn rows<'a, T: numpy::Element, const D: usize>(
    name: &str,
    array: &'a PyReadonlyArray2<'_, T>,
) -> PyResult<&'a [[T; D]]> {
    let shape = array.shape();
    if shape[1] != D {
        let message = format!(
            "{name}: expected shape (N, {D}), got ({}, {})",
            shape[0], shape[1]
        );
        return Err(PyValueError::new_err(message));
    }
    // `as_slice` alone would accept Fortran order and read columns as rows.
    let flat = array.as_slice().ok().filter(|_| array.is_c_contiguous());
    let not_contiguous = || PyValueError::new_err(format!("{name}: expected a C-contiguous array"));
    Ok(flat.ok_or_else(not_contiguous)?.as_chunks().0)
}

/// As [`rows`], for coordinates: refuses NaN and infinity.
pub(crate) fn finite_rows<'a, const D: usize>(
    name: &str,
    array: &'a PyReadonlyArray2<'_, f64>,
) -> PyResult<&'a [[f64; D]]> {
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

/// A contiguous array of `n` finite numbers.
pub(crate) fn finite<'a>(
    name: &str,
    array: &'a PyReadonlyArray1<'_, f64>,
    n: usize,
) -> PyResult<&'a [f64]> {
    let not_contiguous = || PyValueError::new_err(format!("{name}: expected a contiguous array"));
    let values = array.as_slice().ok().ok_or_else(not_contiguous)?;
    if values.len() != n {
        let message = format!("{name}: expected shape ({n},), got ({},)", values.len());
        return Err(PyValueError::new_err(message));
    }
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(values),
        Some(i) => Err(PyValueError::new_err(format!(
            "{name}: element {i} is not finite: {}",
            values[i]
        ))),
    }
}

/// A contiguous array of as many values as `points` has rows.
pub(crate) fn same<'a, T: numpy::Element>(
    name: &str,
    array: &'a PyReadonlyArray1<'_, T>,
    n: usize,
) -> PyResult<&'a [T]> {
    require_rows(name, array.len(), n)?;
    let not_contiguous = |_| PyValueError::new_err(format!("{name}: expected a contiguous array"));
    array.as_slice().map_err(not_contiguous)
}

/// Refuses another number of rows than `points` has.
pub(crate) fn require_rows(name: &str, found: usize, expected: usize) -> PyResult<()> {
    if found == expected {
        return Ok(());
    }
    Err(PyValueError::new_err(format!(
        "{name}: expected {expected} rows as points has, got {found}"
    )))
}

/// Encoder angles of the points: needed with a motor, without meaning and optional without one.
pub(crate) fn angles<'a>(
    array: Option<&'a PyReadonlyArray1<'_, f64>>,
    n: usize,
    has_motor: bool,
) -> PyResult<&'a [f64]> {
    match array {
        Some(array) => finite("angles", array, n),
        None if has_motor && n > 0 => Err(PyValueError::new_err(
            "angles: expected the motor's angle of every point, as globals have a motor, got None",
        )),
        None => Ok(&[]),
    }
}

/// As [`finite`], and non-decreasing.
pub(crate) fn times<'a>(
    name: &str,
    array: &'a PyReadonlyArray1<'_, f64>,
    n: usize,
) -> PyResult<&'a [f64]> {
    let times = finite(name, array, n)?;
    match times.windows(2).position(|t| t[1] < t[0]) {
        None => Ok(times),
        Some(i) => {
            let message = format!(
                "{name}: must not decrease, but element {} is {} after {}",
                i + 1,
                times[i + 1],
                times[i]
            );
            Err(PyValueError::new_err(message))
        }
    }
}

/// A finite number.
pub(crate) fn finite_number(name: &str, value: f64) -> PyResult<f64> {
    if value.is_finite() {
        return Ok(value);
    }
    let message = format!("{name}: expected a finite number, got {value}");
    Err(PyValueError::new_err(message))
}

/// Longest time that is carried on at once, s; samples come a hundred times a second, and what is
/// carried on for longer than this has left every place that could be found again.
const LONGEST_STEP: f64 = 3600.0;

/// A time to carry on to from another, for which there will be memory.
pub(crate) fn reachable(name: &str, from: f64, until: f64) -> PyResult<f64> {
    if finite_number(name, until)? - from <= LONGEST_STEP {
        return Ok(until);
    }
    let message = format!(
        "{name}: expected a time up to {LONGEST_STEP} s after {from} s, got {until} s; times are in \
         seconds"
    );
    Err(PyValueError::new_err(message))
}

/// A finite three-vector.
pub(crate) fn finite_vector(name: &str, value: [f64; 3]) -> PyResult<Vector3<f64>> {
    if value.iter().all(|v| v.is_finite()) {
        return Ok(value.into());
    }
    let message = format!("{name}: expected finite numbers, got {value:?}");
    Err(PyValueError::new_err(message))
}

/// Three-vectors of the rows.
pub(crate) fn vectors(rows: &[[f64; 3]]) -> Vec<Vector3<f64>> {
    rows.iter().map(|r| Vector3::from(*r)).collect()
}

/// A unit quaternion from x, y, z, w; refuses norms that are not one.
pub(crate) fn unit_quaternion(name: &str, q: &[f64; 4]) -> PyResult<UnitQuaternion<f64>> {
    let q = Quaternion::new(q[3], q[0], q[1], q[2]);
    // Written so that NaN, which compares with nothing, is refused as well.
    let is_unit = (q.norm() - 1.0).abs() <= 1e-3;
    if !is_unit {
        let message = format!("{name}: expected a unit quaternion, got norm {}", q.norm());
        return Err(PyValueError::new_err(message));
    }
    Ok(UnitQuaternion::new_normalize(q))
}

/// A quaternion as x, y, z, w.
pub(crate) fn xyzw(q: &UnitQuaternion<f64>) -> [f64; 4] {
    [q.i, q.j, q.k, q.w]
}

/// An (N, D) array from rows.
pub(crate) fn to_array2<'py, T: numpy::Element + Copy, const D: usize>(
    py: Python<'py>,
    rows: &[[T; D]],
) -> PyResult<Bound<'py, PyArray2<T>>> {
    use numpy::PyArrayMethods;
    rows.as_flattened().to_pyarray(py).reshape([rows.len(), D])
}

/// A vector as an array (3,).
pub(crate) fn vector<'py>(py: Python<'py>, v: &Vector3<f64>) -> Bound<'py, PyArray1<f64>> {
    v.as_slice().to_pyarray(py)
}
