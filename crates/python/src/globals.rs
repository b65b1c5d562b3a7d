// SPDX-License-Identifier: MIT OR Apache-2.0
//! The slow states for Python.

use bentwing_registration::{Globals as RustGlobals, N_GLOBALS};
use bentwing_trajectory::{Head, InertialUnit, LidarClock, Motor, MotorErrors, RangeBias};
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use numpy::{PyArray1, ToPyArray};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{finite_number, finite_vector, unit_quaternion, vector, xyzw};

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

/// Errors of a motor: `eccentricity` (2) and `wobble` (2, 4), rad.
#[derive(FromPyObject, IntoPyObject)]
struct Errors([f64; 2], [[f64; 4]; 2]);

impl Errors {
    fn of(errors: &MotorErrors) -> Self {
        Self(errors.eccentricity, errors.wobble)
    }

    fn checked(&self) -> PyResult<MotorErrors> {
        for &v in self.0.iter().chain(self.1.as_flattened()) {
            finite_number("motor_errors", v)?;
        }
        Ok(MotorErrors {
            eccentricity: self.0,
            wobble: self.1,
        })
    }
}

#[pymethods]
impl Globals {
    /// Transforms are pairs of translation (3) and quaternion x, y, z, w.
    #[new]
    #[pyo3(signature = (
        T_imu_base, *, latency, gyro_bias, accel_bias, gravity, unit = None,
        motor_axis = None, encoder_zero = 0.0, T_motor_lidar = None, motor_errors = None,
        latency_rate = 0.0, latency_epoch = 0.0, ranges = [0.0; 2],
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
        motor_errors: Option<Errors>,
        latency_rate: f64,
        latency_epoch: f64,
        ranges: [f64; 2],
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
                    errors: motor_errors
                        .map_or_else(|| Ok(MotorErrors::default()), |e| e.checked())?,
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
            ranges: RangeBias {
                offset: finite_number("ranges", ranges[0])?,
                grazing: finite_number("ranges", ranges[1])?,
            },
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
        named.set_item("ranges", self.ranges())?;
        if let Some(motor) = &self.0.head.motor {
            named.set_item("motor_axis", vector(py, &motor.axis))?;
            named.set_item("encoder_zero", motor.zero)?;
            named.set_item("T_motor_lidar", Transform::of(&motor.T_motor_lidar))?;
            named.set_item("motor_errors", Errors::of(&motor.errors))?;
        }
        Ok(((Transform::of(&self.0.head.T_imu_base),), named))
    }

    /// The correction (57,) that leads from `earlier` to these.
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

    /// By how much ranges are too long: m, and per `r tan θ`, rad.
    #[getter]
    fn ranges(&self) -> [f64; 2] {
        let bias = self.0.head.ranges;
        [bias.offset, bias.grazing]
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

    /// How the motor turns otherwise than its encoder reads, rad: `eccentricity` (2) and `wobble` (2, 4);
    /// none without a motor.
    #[getter]
    fn motor_errors(&self) -> Option<Errors> {
        self.0.head.motor.map(|m| Errors::of(&m.errors))
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

fn quaternion<'py>(py: Python<'py>, q: &UnitQuaternion<f64>) -> Bound<'py, PyArray1<f64>> {
    xyzw(q).to_pyarray(py)
}
