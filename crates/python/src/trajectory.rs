// SPDX-License-Identifier: MIT OR Apache-2.0
//! `_core.Samples`, `_core.Imu`, `_core.Globals`: what the estimator carries along.

use bentwing_registration::{Globals as RustGlobals, N_GLOBALS, PoseResponse, UNMOVED, follow};
use bentwing_trajectory::{
    Head, Imu as RustImu, InertialUnit, LidarClock, Motor, Trajectory, extend_constant_velocity,
    extend_inertial,
};
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyReadonlyArray3, PyUntypedArrayMethods, ToPyArray,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{
    finite_number, finite_rows, finite_vector, times, to_array2, unit_quaternion, vectors, xyzw,
};
use crate::errors::in_pool;

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
        let until = finite_number("until", until)?;
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

    /// These samples where a correction (45,) of the slow states moves them.
    #[allow(
        clippy::large_types_passed_by_value,
        reason = "taken from Python as a whole"
    )]
    fn following(&self, correction: [f64; N_GLOBALS]) -> Self {
        let mut trajectory = self.0.clone();
        follow(&mut trajectory, &self.1, &correction);
        Self(trajectory, self.1.clone())
    }

    /// How samples follow the slow states (K, 6, 45): derivatives of their rotations, rad, and their
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
}

/// An array (K, 6, 45) of responses.
fn response_array<'py>(
    py: Python<'py>,
    responses: &[PoseResponse],
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let flat = responses.as_flattened().as_flattened();
    flat.to_pyarray(py).reshape([responses.len(), 6, N_GLOBALS])
}

/// The responses in an array (K, 6, 45).
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

/// Inertial samples in time order.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct Imu(pub(crate) RustImu);

#[pymethods]
impl Imu {
    #[new]
    fn new(
        stamps: PyReadonlyArray1<'_, f64>,
        gyro: PyReadonlyArray2<'_, f64>,
        accel: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Self> {
        let gyro = vectors(finite_rows("gyro", &gyro)?);
        let accel = vectors(finite_rows("accel", &accel)?);
        let stamps = times("stamps", &stamps, gyro.len())?.to_vec();
        if accel.len() != gyro.len() {
            let message = format!("accel: expected {} rows, got {}", gyro.len(), accel.len());
            return Err(PyValueError::new_err(message));
        }
        Ok(Self(RustImu::new(stamps, gyro, accel)))
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }
}

/// The slow states: latency, extrinsics, motor, biases, gravity.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct Globals(pub(crate) RustGlobals);

#[derive(FromPyObject, IntoPyObject)]
struct Transform([f64; 3], [f64; 4]);

impl Transform {
    fn of(isometry: &Isometry3<f64>) -> Self {
        let q = &isometry.rotation;
        Self(isometry.translation.vector.into(), [q.i, q.j, q.k, q.w])
    }

    fn isometry(&self, name: &str) -> PyResult<Isometry3<f64>> {
        let q = unit_quaternion(name, &self.1)?;
        let t = finite_vector(name, self.0)?;
        Ok(Isometry3::from_parts(Translation3::from(t), q))
    }
}

/// Scales and misalignments of an inertial unit: `gyro`, `g_sensitivity` and `accel` (3, 3) by rows,
/// `reference` (3), `main_axis`.
#[derive(FromPyObject, IntoPyObject)]
struct Unit([[f64; 3]; 3], [[f64; 3]; 3], [[f64; 3]; 3], [f64; 3], usize);

impl Unit {
    fn of(unit: &InertialUnit) -> Self {
        let rows = |m: &Matrix3<f64>| std::array::from_fn(|r| std::array::from_fn(|c| m[(r, c)]));
        Self(
            rows(&unit.gyro),
            rows(&unit.g_sensitivity),
            rows(&unit.accel),
            unit.reference.into(),
            unit.main_axis,
        )
    }

    /// The unit with these, without biases.
    fn checked(&self) -> PyResult<InertialUnit> {
        let matrix = |rows: &[[f64; 3]; 3]| -> PyResult<Matrix3<f64>> {
            let [x, y, z] = rows;
            let row = |v: &[f64; 3]| finite_vector("unit", *v).map(|v| v.transpose());
            Ok(Matrix3::from_rows(&[row(x)?, row(y)?, row(z)?]))
        };
        if self.4 > 2 {
            let message = format!("unit: expected a main axis of 0, 1 or 2, got {}", self.4);
            return Err(PyValueError::new_err(message));
        }
        Ok(InertialUnit {
            gyro: matrix(&self.0)?,
            g_sensitivity: matrix(&self.1)?,
            accel: matrix(&self.2)?,
            reference: finite_vector("unit", self.3)?,
            main_axis: self.4,
            ..InertialUnit::ideal()
        })
    }
}

#[pymethods]
impl Globals {
    /// Transforms are pairs of translation (3) and quaternion x, y, z, w.
    #[new]
    #[pyo3(signature = (
        T_imu_base, *, latency, gyro_bias, accel_bias, gravity, unit = None,
        motor_axis = None, encoder_zero = 0.0, T_motor_lidar = None,
        latency_rate = 0.0, latency_epoch = 0.0,
    ))]
    #[allow(clippy::too_many_arguments, reason = "the states by name")]
    fn new(
        T_imu_base: Transform,
        latency: f64,
        gyro_bias: [f64; 3],
        accel_bias: [f64; 3],
        gravity: [f64; 3],
        unit: Option<Unit>,
        motor_axis: Option<[f64; 3]>,
        encoder_zero: f64,
        T_motor_lidar: Option<Transform>,
        latency_rate: f64,
        latency_epoch: f64,
    ) -> PyResult<Self> {
        let motor = match (motor_axis, T_motor_lidar) {
            (None, None) => None,
            (Some(axis), Some(T)) => {
                let axis = finite_vector("motor_axis", axis)?.try_normalize(1e-9);
                let zero_axis = || PyValueError::new_err("motor_axis: expected a non-zero vector");
                Some(Motor {
                    axis: axis.ok_or_else(zero_axis)?,
                    zero: finite_number("encoder_zero", encoder_zero)?,
                    T_motor_lidar: T.isometry("T_motor_lidar")?,
                })
            }
            _ => {
                let message = "motor_axis and T_motor_lidar go together";
                return Err(PyValueError::new_err(message));
            }
        };
        let head = Head {
            T_imu_base: T_imu_base.isometry("T_imu_base")?,
            clock: LidarClock {
                latency: finite_number("latency", latency)?,
                rate: finite_number("latency_rate", latency_rate)?,
                epoch: finite_number("latency_epoch", latency_epoch)?,
            },
            motor,
        };
        let unit = unit.map_or_else(|| Ok(InertialUnit::ideal()), |unit| unit.checked())?;
        Ok(Self(RustGlobals {
            head,
            unit: InertialUnit {
                gyro_bias: finite_vector("gyro_bias", gyro_bias)?,
                accel_bias: finite_vector("accel_bias", accel_bias)?,
                ..unit
            },
            gravity: finite_vector("gravity", gravity)?,
        }))
    }

    /// For copies and pickles.
    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<((Transform,), Bound<'py, PyDict>)> {
        let named = PyDict::new(py);
        named.set_item("latency", self.latency())?;
        named.set_item("latency_rate", self.latency_rate())?;
        named.set_item("latency_epoch", self.latency_epoch())?;
        named.set_item("gyro_bias", self.gyro_bias(py))?;
        named.set_item("accel_bias", self.accel_bias(py))?;
        named.set_item("gravity", self.gravity(py))?;
        named.set_item("unit", self.unit())?;
        if let Some(motor) = &self.0.head.motor {
            named.set_item("motor_axis", vector(py, &motor.axis))?;
            named.set_item("encoder_zero", motor.zero)?;
            named.set_item("T_motor_lidar", Transform::of(&motor.T_motor_lidar))?;
        }
        Ok(((Transform::of(&self.0.head.T_imu_base),), named))
    }

    /// The correction (45,) that leads from `earlier` to these.
    fn moved_from(&self, earlier: &Self) -> [f64; N_GLOBALS] {
        self.0.moved_from(&earlier.0)
    }

    /// The same states with gravity straight up.
    fn levelled(&self) -> Self {
        let mut globals = self.0.clone();
        globals.gravity = Vector3::z() * globals.gravity.norm();
        Self(globals)
    }

    /// Lidar stamps minus IMU clock at `latency_epoch`, s.
    #[getter]
    fn latency(&self) -> f64 {
        self.0.head.clock.latency
    }

    /// How much faster than the IMU's clock the lidar's runs, s/s.
    #[getter]
    fn latency_rate(&self) -> f64 {
        self.0.head.clock.rate
    }

    /// The stamp at which the latency is `latency`, s.
    #[getter]
    fn latency_epoch(&self) -> f64 {
        self.0.head.clock.epoch
    }

    /// By how much a stamp of the lidar is late, s.
    fn latency_at(&self, stamp: f64) -> f64 {
        self.0.head.clock.latency_at(stamp)
    }

    /// Translation of the lidar (or motor) in the IMU frame, m.
    #[getter]
    fn base_translation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.0.head.T_imu_base.translation.vector)
    }

    /// Rotation of the lidar (or motor) in the IMU frame, x, y, z, w.
    #[getter]
    fn base_quat_xyzw<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        quaternion(py, &self.0.head.T_imu_base.rotation)
    }

    /// Gyro bias, rad/s.
    #[getter]
    fn gyro_bias<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.0.unit.gyro_bias)
    }

    /// Accelerometer bias, m/s².
    #[getter]
    fn accel_bias<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.0.unit.accel_bias)
    }

    /// How the IMU answers beside its biases: `gyro`, `g_sensitivity` and `accel` row by row,
    /// `reference` and `main_axis`.
    #[getter]
    fn unit(&self) -> Unit {
        Unit::of(&self.0.unit)
    }

    /// Gravity, m/s², map frame, pointing up.
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.0.gravity)
    }

    /// Added to every encoder angle, rad; zero without a motor.
    #[getter]
    fn encoder_zero(&self) -> f64 {
        self.0.head.motor.map_or(0.0, |m| m.zero)
    }

    /// Translation of the lidar in the rotating motor frame, m; none without a motor.
    #[getter]
    fn motor_lidar_translation<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0
            .head
            .motor
            .map(|m| vector(py, &m.T_motor_lidar.translation.vector))
    }

    /// Rotation of the lidar in the rotating motor frame, x, y, z, w; none without a motor.
    #[getter]
    fn motor_lidar_quat_xyzw<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0
            .head
            .motor
            .map(|m| quaternion(py, &m.T_motor_lidar.rotation))
    }
}

fn vector<'py>(py: Python<'py>, v: &Vector3<f64>) -> Bound<'py, PyArray1<f64>> {
    v.as_slice().to_pyarray(py)
}

fn quaternion<'py>(py: Python<'py>, q: &UnitQuaternion<f64>) -> Bound<'py, PyArray1<f64>> {
    xyzw(q).to_pyarray(py)
}
