// SPDX-License-Identifier: MIT OR Apache-2.0
//! The error-state iterated Kalman filter.

use bentwing_kalman as core;
use bentwing_kalman::{DIM, Memory, Mounted, Sample, Sweep};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{
    angles as checked_angles, finite_number, finite_rows, finite_vector, reachable,
    times as checked_times, to_array2, unit_quaternion, vectors, xyzw,
};
use crate::errors::{detached, kalman_error};

type Transform = ([f64; 3], [f64; 4]);
type Poses<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
);

/// Fields as in `bentwing.odometry.kalman.core.FilterSettings`.
#[derive(FromPyObject)]
pub(crate) struct KalmanSettings {
    sigma: f64,
    gyro_noise: f64,
    accel_noise: f64,
    gyro_bias_walk: f64,
    accel_bias_walk: f64,
    rotation_walk: f64,
    translation_walk: f64,
    delay_walk: f64,
    voxel_size: f64,
    n_levels: usize,
    cell_points: u32,
    renew: bool,
    reach: f64,
    max_features: usize,
    spacing: f64,
    max_iterations: usize,
    independence: f64,
    stamp_jitter: f64,
    edges: bool,
    axis: [f64; 3],
    pose_interval: f64,
    odometry_interval: f64,
    smoothing: f64,
}

impl From<KalmanSettings> for core::Settings {
    fn from(s: KalmanSettings) -> Self {
        let memory = if s.renew {
            Memory::Last(s.cell_points)
        } else {
            Memory::First(s.cell_points)
        };
        Self {
            sigma: s.sigma,
            noise: core::Noise {
                gyro: s.gyro_noise,
                accel: s.accel_noise,
                gyro_bias_walk: s.gyro_bias_walk,
                accel_bias_walk: s.accel_bias_walk,
                rotation_walk: s.rotation_walk,
                translation_walk: s.translation_walk,
                delay_walk: s.delay_walk,
            },
            map: core::MapSettings {
                voxel_size: s.voxel_size,
                n_levels: s.n_levels,
                memory,
                reach: s.reach,
            },
            max_features: s.max_features,
            spacing: s.spacing,
            max_iterations: s.max_iterations,
            independence: s.independence,
            stamp_jitter: s.stamp_jitter,
            edges: s.edges,
            axis: s.axis.into(),
            pose_interval: s.pose_interval,
            odometry_interval: s.odometry_interval,
            smoothing: s.smoothing,
        }
    }
}

/// Fields as in `bentwing.odometry.kalman.core.FilterState`.
#[derive(FromPyObject)]
pub(crate) struct KalmanState {
    pose: Transform,
    velocity: [f64; 3],
    gyro_bias: [f64; 3],
    accel_bias: [f64; 3],
    gravity: [f64; 3],
    base: Transform,
    lidar: Transform,
    latency: f64,
    encoder_delay: f64,
}

impl KalmanState {
    fn checked(&self) -> PyResult<core::State> {
        Ok(core::State {
            pose: mounted("pose", &self.pose)?,
            v: finite_vector("velocity", self.velocity)?,
            gyro_bias: finite_vector("gyro_bias", self.gyro_bias)?,
            accel_bias: finite_vector("accel_bias", self.accel_bias)?,
            gravity: finite_vector("gravity", self.gravity)?,
            base: mounted("base", &self.base)?,
            lidar: mounted("lidar", &self.lidar)?,
            latency: finite_number("latency", self.latency)?,
            encoder_delay: finite_number("encoder_delay", self.encoder_delay)?,
        })
    }
}

fn mounted(name: &str, (t, q): &Transform) -> PyResult<Mounted> {
    Ok(Mounted {
        R: unit_quaternion(name, q)?,
        t: finite_vector(name, *t)?,
    })
}

fn transform(m: &Mounted) -> Transform {
    (m.t.into(), xyzw(&m.R))
}

/// The filter.
#[pyclass(module = "bentwing._core")]
pub(crate) struct KalmanFilter(core::Filter);

#[pymethods]
impl KalmanFilter {
    #[new]
    #[pyo3(signature = (settings, *, time, state, covariance))]
    fn new(
        settings: KalmanSettings,
        time: f64,
        state: KalmanState,
        covariance: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Self> {
        let rows: &[[f64; DIM]] = finite_rows("covariance", &covariance)?;
        if rows.len() != DIM {
            let message = format!(
                "covariance: expected shape ({DIM}, {DIM}), got ({}, {DIM})",
                rows.len()
            );
            return Err(PyValueError::new_err(message));
        }
        let start = core::Start {
            time: finite_number("time", time)?,
            state: state.checked()?,
            covariance: core::Square::from_fn(|i, j| rows[i][j]),
        };
        Ok(Self(core::Filter::new(settings.into(), &start)))
    }

    /// Carries the state on to `until` by the inertial samples, those after it included.
    #[pyo3(signature = (times, gyro, accel, *, until))]
    fn propagate(
        &mut self,
        py: Python<'_>,
        times: PyReadonlyArray1<'_, f64>,
        gyro: PyReadonlyArray2<'_, f64>,
        accel: PyReadonlyArray2<'_, f64>,
        until: f64,
    ) -> PyResult<()> {
        let times = checked_times("times", &times, times.len())?;
        let gyro = vectors(finite_rows("gyro", &gyro)?);
        let accel = vectors(finite_rows("accel", &accel)?);
        let until = reachable("until", self.0.time(), until)?;
        if gyro.len() != times.len() || accel.len() != times.len() {
            let message = format!(
                "gyro, accel: expected {} rows as times has, got {} and {}",
                times.len(),
                gyro.len(),
                accel.len()
            );
            return Err(PyValueError::new_err(message));
        }
        let sample = |i: usize| Sample {
            time: times[i],
            gyro: gyro[i],
            accel: accel[i],
        };
        let samples: Vec<Sample> = (0..times.len()).map(sample).collect();
        let filter = &mut self.0;
        detached(py, || filter.propagate(&samples, until));
        Ok(())
    }

    /// Corrects the state by a sweep that ends about now.
    #[pyo3(signature = (points, times, *, rings = None, angles = None))]
    fn update(
        &mut self,
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        times: PyReadonlyArray1<'_, f64>,
        rings: Option<PyReadonlyArray1<'_, u16>>,
        angles: Option<PyReadonlyArray1<'_, f64>>,
    ) -> PyResult<KalmanSweep> {
        let points = finite_rows("points", &points)?;
        let n = points.len();
        let times = checked_times("times", &times, n)?;
        let angles = checked_angles(angles.as_ref(), n, false)?;
        let rings = match &rings {
            None => &[][..],
            Some(array) => array
                .as_slice()
                .ok()
                .filter(|r| r.len() == n)
                .ok_or_else(|| {
                    PyValueError::new_err(format!(
                        "rings: expected a contiguous array of shape ({n},)"
                    ))
                })?,
        };
        let filter = &mut self.0;
        let sweep = Sweep {
            points,
            times,
            rings,
            angles,
        };
        detached(py, || filter.update(&sweep))
            .map(KalmanSweep)
            .map_err(|e| kalman_error(py, &e))
    }

    /// Hands out the poses predicted since the last update as they are.
    fn release(&mut self) {
        self.0.release();
    }

    /// Corrects the state by a velocity of zero; returns whether the carrier can be at rest.
    fn rest(&mut self, sigma: f64) -> PyResult<bool> {
        if !(sigma > 0.0 && sigma.is_finite()) {
            let message = format!("sigma: expected a finite number above zero, got {sigma}");
            return Err(PyValueError::new_err(message));
        }
        Ok(self.0.rest(sigma))
    }

    /// Corrected poses since this was asked last: times, positions, quaternions.
    fn take_poses<'py>(&mut self, py: Python<'py>) -> PyResult<Poses<'py>> {
        let poses = self.0.take_poses();
        arrays(py, poses.iter().map(|p| (p.time, p.pose)))
    }

    /// Poses of the high-rate odometry since this was asked last, raw and smoothed.
    fn take_odometry<'py>(&mut self, py: Python<'py>) -> PyResult<(Poses<'py>, Poses<'py>)> {
        let poses = self.0.take_odometry();
        Ok((
            arrays(py, poses.iter().map(|p| (p.time, p.pose)))?,
            arrays(py, poses.iter().map(|p| (p.time, p.smoothed)))?,
        ))
    }

    /// Time of the state, s.
    #[getter]
    fn time(&self) -> f64 {
        self.0.time()
    }

    /// Pose of the IMU in the map: translation and quaternion.
    #[getter]
    fn pose(&self) -> Transform {
        transform(&self.0.state().pose)
    }

    /// Velocity, m/s, map frame.
    #[getter]
    fn velocity(&self) -> [f64; 3] {
        self.0.state().v.into()
    }

    /// Bias of the gyro, rad/s.
    #[getter]
    fn gyro_bias(&self) -> [f64; 3] {
        self.0.state().gyro_bias.into()
    }

    /// Bias of the accelerometer, m/s².
    #[getter]
    fn accel_bias(&self) -> [f64; 3] {
        self.0.state().accel_bias.into()
    }

    /// Gravity, m/s², map frame.
    #[getter]
    fn gravity(&self) -> [f64; 3] {
        self.0.state().gravity.into()
    }

    /// The motor, or the lidar that is fixed, in the IMU frame.
    #[getter]
    fn base(&self) -> Transform {
        transform(&self.0.state().base)
    }

    /// The lidar in the frame that the motor turns.
    #[getter]
    fn lidar(&self) -> Transform {
        transform(&self.0.state().lidar)
    }

    /// Lidar stamps minus IMU clock, s.
    #[getter]
    fn latency(&self) -> f64 {
        self.0.state().latency
    }

    /// The encoder's angle at a stamp of the lidar is that of this much earlier, s.
    #[getter]
    fn encoder_delay(&self) -> f64 {
        self.0.state().encoder_delay
    }

    /// Covariance (6, 6) of attitude and position, with that of the map they are in.
    #[getter]
    fn pose_covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let P = self.0.pose_covariance();
        let rows: Vec<[f64; 6]> = (0..6).map(|i| std::array::from_fn(|j| P[(i, j)])).collect();
        to_array2(py, &rows)
    }

    /// Covariance (31, 31) of the state's tangent.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let P = self.0.covariance();
        let rows: Vec<[f64; DIM]> = (0..DIM)
            .map(|i| std::array::from_fn(|j| P[(i, j)]))
            .collect();
        to_array2(py, &rows)
    }
}

fn arrays(py: Python<'_>, poses: impl Iterator<Item = (f64, Mounted)>) -> PyResult<Poses<'_>> {
    let (mut times, mut positions, mut quats) = (Vec::new(), Vec::new(), Vec::new());
    for (time, pose) in poses {
        let (t, q) = transform(&pose);
        times.push(time);
        positions.push(t);
        quats.push(q);
    }
    Ok((
        times.into_pyarray(py),
        to_array2(py, &positions)?,
        to_array2(py, &quats)?,
    ))
}

/// What became of a sweep.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct KalmanSweep(core::Outcome);

#[pymethods]
impl KalmanSweep {
    /// Whether enough of the sweep matched the map to correct the state.
    #[getter]
    fn matched(&self) -> bool {
        self.0.fit.is_some()
    }

    /// Planar and edge features found.
    #[getter]
    fn n_features(&self) -> [usize; 2] {
        self.0.n_features
    }

    /// Planes in the map.
    #[getter]
    fn n_planes(&self) -> usize {
        self.0.n_planes
    }

    /// Share of the features that saw something new.
    #[getter]
    fn new_share(&self) -> f64 {
        self.0.new_share
    }

    /// Seconds since the last sweep without inertial samples.
    #[getter]
    fn blind(&self) -> f64 {
        self.0.blind
    }

    /// Features with a plane or a line, and of these with a line.
    #[getter]
    fn n_matches(&self) -> [usize; 2] {
        self.0
            .fit
            .as_ref()
            .map_or([0; 2], |f| [f.n_matches, f.n_lines])
    }

    /// Share of the matches within two standard deviations.
    #[getter]
    fn inlier_share(&self) -> f64 {
        self.0.fit.as_ref().map_or(0.0, |f| f.inlier_share)
    }

    /// Weighted root mean square of the residuals in standard deviations.
    #[getter]
    fn residual_rms(&self) -> f64 {
        self.0.fit.as_ref().map_or(0.0, |f| f.residual_rms)
    }

    /// The same, m.
    #[getter]
    fn rmse(&self) -> f64 {
        self.0.fit.as_ref().map_or(0.0, |f| f.rmse)
    }

    /// Solutions.
    #[getter]
    fn n_iterations(&self) -> usize {
        self.0.fit.as_ref().map_or(0, |f| f.iterations)
    }

    /// Whether the last step was short.
    #[getter]
    fn converged(&self) -> bool {
        self.0.fit.as_ref().is_some_and(|f| f.converged)
    }

    /// Eigenvalues (3) of the information about translation and rotation, shares of their sum.
    #[getter]
    fn eigenvalues(&self) -> [[f64; 3]; 2] {
        self.0.fit.as_ref().map_or([[0.0; 3]; 2], core::Fit::shares)
    }
}
