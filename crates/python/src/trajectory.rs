// SPDX-License-Identifier: MIT OR Apache-2.0
//! `_core.Samples`, `_core.Imu`: what the estimator carries along.

use bentwing_registration::{N_GLOBALS, PoseResponse, UNMOVED, follow};
use bentwing_trajectory::{Imu as RustImu, Trajectory, extend_constant_velocity, extend_inertial};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyReadonlyArray3, PyUntypedArrayMethods, ToPyArray,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{
    finite_number, finite_rows, reachable, times, to_array2, unit_quaternion, vector, vectors, xyzw,
};
use crate::errors::in_pool;
use crate::globals::Globals;

/// Poses of the IMU in the map at a uniform rate, and how they follow the slow states; those behind
/// the last response do not.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct Samples(pub(crate) Trajectory, pub(crate) Vec<PoseResponse>);

/// As the arguments of `Samples::new`.
type SamplesArguments<'py> = (
    f64,
    f64,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray3<f64>>,
);

/// Points, beams and lengths.
type ShotArrays<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<f64>>,
);

impl Samples {
    /// Poses that nothing but a registration moves.
    pub(crate) fn unmoved(trajectory: Trajectory) -> Self {
        Self(trajectory, Vec::new())
    }
}

#[pymethods]
impl Samples {
    #[new]
    #[pyo3(signature = (start, dt, positions, quats_xyzw, responses = None))]
    fn new(
        start: f64,
        dt: f64,
        positions: PyReadonlyArray2<'_, f64>,
        quats_xyzw: PyReadonlyArray2<'_, f64>,
        responses: Option<PyReadonlyArray3<'_, f64>>,
    ) -> PyResult<Self> {
        let positions = vectors(finite_rows("positions", &positions)?);
        let quats = finite_rows("quats_xyzw", &quats_xyzw)?;
        let rotations: PyResult<Vec<_>> = quats
            .iter()
            .map(|q| unit_quaternion("quats_xyzw", q))
            .collect();
        let start = finite_number("start", start)?;
        let responses = responses.as_ref().map_or(Ok(Vec::new()), pose_responses)?;
        Trajectory::new(start, dt, positions, rotations?)
            .map(|trajectory| Self(trajectory, responses))
            .map_err(|e| PyValueError::new_err(e.to_string()))
    }

    /// For copies and pickles.
    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<SamplesArguments<'py>> {
        Ok((
            self.0.start(),
            self.0.dt(),
            self.positions(py)?,
            self.quats_xyzw(py)?,
            response_array(py, &self.1)?,
        ))
    }

    /// Time of the first sample, s.
    #[getter]
    fn start(&self) -> f64 {
        self.0.start()
    }

    /// Time of the last sample, s.
    #[getter]
    fn end(&self) -> f64 {
        self.0.end()
    }

    /// Number of samples.
    fn __len__(&self) -> usize {
        self.0.len()
    }

    /// Positions (N, 3), m, map frame.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows: Vec<[f64; 3]> = self.0.positions().iter().map(|&p| p.into()).collect();
        to_array2(py, &rows)
    }

    /// Rotations (N, 4) as unit quaternions x, y, z, w.
    #[getter]
    fn quats_xyzw<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows: Vec<[f64; 4]> = self.0.rotations().iter().map(xyzw).collect();
        to_array2(py, &rows)
    }

    /// Samples `first` to `last`, both included.
    fn slice(&self, first: usize, last: usize) -> PyResult<Self> {
        if first >= last || last >= self.0.len() {
            let message = format!(
                "samples {first} to {last} of {} cannot be cut",
                self.0.len()
            );
            return Err(PyValueError::new_err(message));
        }
        Trajectory::new(
            self.0.time(first),
            self.0.dt(),
            self.0.positions()[first..=last].to_vec(),
            self.0.rotations()[first..=last].to_vec(),
        )
        .map(|trajectory| {
            let n = self.1.len();
            let responses = self.1[first.min(n)..(last + 1).min(n)].to_vec();
            Self(trajectory, responses)
        })
        .map_err(|e| PyValueError::new_err(e.to_string()))
    }

    /// Position (3,), m, at `time`.
    fn position_at<'py>(&self, py: Python<'py>, time: f64) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let time = finite_number("time", time)?;
        Ok(vector(py, &self.0.pose(time).p))
    }

    /// These samples with those from `first` on replaced by `newer`.
    fn replaced(&self, first: usize, newer: &Self) -> PyResult<Self> {
        if first > self.0.len() {
            let message = format!("first: expected at most {}, got {first}", self.0.len());
            return Err(PyValueError::new_err(message));
        }
        if newer.0.dt() != self.0.dt() {
            let message = format!(
                "newer: expected samples every {} s as here, got {} s",
                self.0.dt(),
                newer.0.dt()
            );
            return Err(PyValueError::new_err(message));
        }
        let positions = [&self.0.positions()[..first], newer.0.positions()].concat();
        let rotations = [&self.0.rotations()[..first], newer.0.rotations()].concat();
        let mut responses = self.1[..first.min(self.1.len())].to_vec();
        if !newer.1.is_empty() {
            responses.resize(first, UNMOVED);
            responses.extend_from_slice(&newer.1);
        }
        Trajectory::new(self.0.start(), self.0.dt(), positions, rotations)
            .map(|trajectory| Self(trajectory, responses))
            .map_err(|e| PyValueError::new_err(e.to_string()))
    }

    /// These samples extended to `until` by the IMU, or at constant velocity without one; and the
    /// number of samples for which the IMU had a gap.
    fn extended(
        &self,
        imu: Option<&Imu>,
        globals: &Globals,
        until: f64,
    ) -> PyResult<(Self, usize)> {
        let until = reachable("until", self.0.end(), until)?;
        let mut trajectory = self.0.clone();
        let n_blind = match imu {
            None => {
                extend_constant_velocity(&mut trajectory, until);
                0
            }
            Some(imu) => {
                let g = &globals.0;
                extend_inertial(&mut trajectory, &imu.0, &g.unit, &g.gravity, until)
            }
        };
        Ok((Self(trajectory, self.1.clone()), n_blind))
    }

    /// These samples where a correction (57,) of the slow states moves them.
    #[allow(
        clippy::large_types_passed_by_value,
        reason = "taken from Python as a whole"
    )]
    fn following(&self, correction: [f64; N_GLOBALS]) -> Self {
        let mut trajectory = self.0.clone();
        follow(&mut trajectory, &self.1, &correction);
        Self(trajectory, self.1.clone())
    }

    /// How samples follow the slow states (K, 6, 57): derivatives of their rotations, rad, and their
    /// translations, m, in the map.
    fn responses_at<'py>(
        &self,
        py: Python<'py>,
        samples: Vec<usize>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let at = |i: &usize| self.1.get(*i).unwrap_or(&UNMOVED);
        let chosen: Vec<PoseResponse> = samples.iter().map(at).copied().collect();
        response_array(py, &chosen)
    }

    /// Lidar points (N, 3) placed in the map.
    #[pyo3(signature = (points, stamps, angles, globals, *, threads = 0))]
    fn place<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        stamps: PyReadonlyArray1<'py, f64>,
        angles: Option<PyReadonlyArray1<'py, f64>>,
        globals: &Globals,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = finite_rows("points", &points)?;
        let stamps = times("stamps", &stamps, points.len())?;
        let head = &globals.0.head;
        let angles = crate::arrays::angles(angles.as_ref(), points.len(), head.motor.is_some())?;
        let placed = in_pool(py, threads, || {
            bentwing_surfels::place_points(points, stamps, angles, &self.0, head)
        })?;
        to_array2(py, &placed)
    }

    /// Lidar points placed in the map (N, 3), the unit directions of their beams there (N, 3) and the
    /// beams' lengths (N,), m.
    #[pyo3(signature = (points, stamps, angles, globals, *, threads = 0))]
    fn place_shots<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        stamps: PyReadonlyArray1<'py, f64>,
        angles: Option<PyReadonlyArray1<'py, f64>>,
        globals: &Globals,
        threads: usize,
    ) -> PyResult<ShotArrays<'py>> {
        let points = finite_rows("points", &points)?;
        let stamps = times("stamps", &stamps, points.len())?;
        let head = &globals.0.head;
        let angles = crate::arrays::angles(angles.as_ref(), points.len(), head.motor.is_some())?;
        let shots = in_pool(py, threads, || {
            bentwing_surfels::place_shots(points, stamps, angles, &self.0, head)
        })?;
        let points = to_array2(py, &shots.points)?;
        let beams = to_array2(py, &shots.beams)?;
        Ok((points, beams, shots.lengths.into_pyarray(py)))
    }
}

/// An array (K, 6, 57) of responses.
fn response_array<'py>(
    py: Python<'py>,
    responses: &[PoseResponse],
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let flat = responses.as_flattened().as_flattened();
    flat.to_pyarray(py).reshape([responses.len(), 6, N_GLOBALS])
}

/// The responses in an array (K, 6, 57).
fn pose_responses(array: &PyReadonlyArray3<'_, f64>) -> PyResult<Vec<PoseResponse>> {
    let shape = array.shape();
    let flat = array.as_slice().ok().filter(|_| array.is_c_contiguous());
    match flat {
        Some(flat) if shape[1..] == [6, N_GLOBALS] => Ok(flat.as_chunks().0.as_chunks().0.to_vec()),
        _ => Err(PyValueError::new_err(format!(
            "responses: expected a C-contiguous array (K, 6, {N_GLOBALS}), got {shape:?}"
        ))),
    }
}

fn axes_at_limit<'a>(
    array: &'a PyReadonlyArray2<'_, bool>,
    n_rows: usize,
) -> PyResult<&'a [[bool; 6]]> {
    let flat = array.as_slice().ok().filter(|_| array.is_c_contiguous());
    match flat {
        Some(flat) if array.shape() == [n_rows, 6] => Ok(flat.as_chunks().0),
        _ => Err(PyValueError::new_err(format!(
            "at_limit: expected a C-contiguous array ({n_rows}, 6) of bool, got {:?}",
            array.shape()
        ))),
    }
}

/// Inertial samples in time order.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct Imu(pub(crate) RustImu);

#[pymethods]
impl Imu {
    #[new]
    #[pyo3(signature = (stamps, gyro, accel, at_limit=None))]
    fn new(
        stamps: PyReadonlyArray1<'_, f64>,
        gyro: PyReadonlyArray2<'_, f64>,
        accel: PyReadonlyArray2<'_, f64>,
        at_limit: Option<PyReadonlyArray2<'_, bool>>,
    ) -> PyResult<Self> {
        let gyro = vectors(finite_rows("gyro", &gyro)?);
        let accel = vectors(finite_rows("accel", &accel)?);
        let stamps = times("stamps", &stamps, gyro.len())?.to_vec();
        if accel.len() != gyro.len() {
            let message = format!("accel: expected {} rows, got {}", gyro.len(), accel.len());
            return Err(PyValueError::new_err(message));
        }
        let Some(at_limit) = at_limit else {
            return Ok(Self(RustImu::new(stamps, gyro, accel)));
        };
        let rows = axes_at_limit(&at_limit, stamps.len())?;
        Ok(Self(RustImu::with_limits(stamps, gyro, accel, rows)))
    }

    /// Forces (M, 3), m/s², without blows to the housing.
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows: Vec<[f64; 3]> = self.0.forces().iter().map(|&f| f.into()).collect();
        to_array2(py, &rows)
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }
}
