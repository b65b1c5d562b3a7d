// SPDX-License-Identifier: MIT OR Apache-2.0
//! `_core.register_globally` and what goes in and comes out.

use std::sync::Arc;

use bentwing_registration as core;
use bentwing_registration::{GlobalPrior, GlobalProblem, Health, N_GLOBALS};
use bentwing_surfels::SurfelSet;
use nalgebra::Matrix6;
use numpy::{PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, ToPyArray};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::to_array2;
use crate::errors::{detached, in_pool, solve_error};
use crate::globals::Globals;
use crate::registration::{RegistrationSettings, global_matrix};
use crate::surfels::Surfels;
use crate::trajectory::{Imu, Samples};

#[derive(FromPyObject)]
pub(crate) struct MatchingPlan {
    n_visits: usize,
    min_overlap: f64,
    n_held: usize,
    posterior_interval: f64,
}

/// A trajectory without a break, with the surfels of its stretches and what is known of its slow states.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct Piece {
    samples: Py<Samples>,
    chunks: Vec<Arc<SurfelSet>>,
    imu: Option<Py<Imu>>,
    globals: Py<Globals>,
    prior: GlobalPrior,
    optional: [bool; N_GLOBALS],
    doubted: [bool; N_GLOBALS],
    shown_noise: core::ShownNoise,
}

#[pymethods]
impl Piece {
    #[new]
    #[pyo3(signature = (samples, surfels, imu, globals, *, information, offset, frozen, optional, doubted, shown_noise))]
    #[allow(
        clippy::large_types_passed_by_value,
        reason = "taken from Python as a whole"
    )]
    #[allow(clippy::too_many_arguments, reason = "the parts of a piece")]
    fn new(
        samples: Py<Samples>,
        surfels: Vec<PyRef<'_, Surfels>>,
        imu: Option<Py<Imu>>,
        globals: Py<Globals>,
        information: PyReadonlyArray2<'_, f64>,
        offset: [f64; N_GLOBALS],
        frozen: [bool; N_GLOBALS],
        optional: [bool; N_GLOBALS],
        doubted: [bool; N_GLOBALS],
        shown_noise: (Vec<f64>, Vec<[f64; 2]>),
    ) -> PyResult<Self> {
        let (times, ratios) = shown_noise;
        if times.len() != ratios.len() || times.windows(2).any(|t| t[0] >= t[1]) {
            let message = "shown_noise: expected increasing times, and two ratios for each";
            return Err(PyValueError::new_err(message));
        }
        Ok(Self {
            samples,
            chunks: surfels.iter().map(|s| Arc::clone(&s.0)).collect(),
            imu,
            globals,
            prior: GlobalPrior {
                information: global_matrix("information", &information)?,
                offset,
                frozen,
            },
            optional,
            doubted,
            shown_noise: core::ShownNoise { times, ratios },
        })
    }
}

impl Piece {
    fn of_problem(&self) -> core::Piece<'_> {
        core::Piece {
            trajectory: self.samples.get().0.clone(),
            chunks: &self.chunks,
            imu: self.imu.as_ref().map(|imu| &imu.get().0),
            globals: self.globals.get().0.clone(),
            prior: &self.prior,
            optional: self.optional,
            doubted: self.doubted,
            shown_noise: self.shown_noise.clone(),
        }
    }
}

/// Result of a global registration.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct GlobalRegistration(core::GlobalRegistration);

#[pymethods]
impl GlobalRegistration {
    /// Corrected trajectories, in the order of the pieces.
    #[getter]
    fn samples(&self) -> Vec<Samples> {
        let pieces = self.0.pieces.iter();
        pieces
            .map(|p| Samples::unmoved(p.trajectory.clone()))
            .collect()
    }

    /// Corrected slow states, in the order of the pieces.
    #[getter]
    fn globals(&self) -> Vec<Globals> {
        let pieces = self.0.pieces.iter();
        pieces.map(|p| Globals(p.globals.clone())).collect()
    }

    /// Covariances (57, 57) of the slow states, in the order of the pieces; zero where frozen.
    #[getter]
    fn covariances<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyArray2<f64>>>> {
        let rows = |m: &core::GlobalMatrix| -> Vec<[f64; N_GLOBALS]> {
            m.row_iter()
                .map(|r| std::array::from_fn(|c| r[c]))
                .collect()
        };
        let pieces = self.0.pieces.iter();
        pieces
            .map(|p| to_array2(py, &rows(&p.covariance)))
            .collect()
    }

    /// Of each iteration what its matches said before its step, and the largest correction: matches,
    /// those between stretches that do not follow each other, share of inliers, weighted root mean
    /// square in standard deviations, rad, m.
    #[getter]
    fn iterations(&self) -> Vec<(usize, usize, f64, f64, f64, f64)> {
        let record = |i: &core::Iteration| {
            let (share, rms) = fit(&i.health);
            let n = i.health.n_moving;
            (n, i.n_far, share, rms, i.step.turn, i.step.shift)
        };
        self.0.iterations.iter().map(record).collect()
    }

    /// Share of inliers and weighted root mean square of the matches of the final trajectories.
    #[getter]
    fn fit(&self) -> (f64, f64) {
        fit(&self.0.health)
    }

    /// How much matches scatter beside what their weights say: their variance over the stated one.
    #[getter]
    fn dispersion(&self) -> f64 {
        self.0.dispersion
    }

    /// Covariances (K, 6, 6) of the corrections of a piece at `times`, computed when asked for.
    ///
    /// Rotation first, rad and m, perturbed on the left in the map frame.
    fn pose_covariances<'py>(
        &self,
        py: Python<'py>,
        piece: usize,
        times: Vec<f64>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        self.piece(piece)?;
        to_array3(py, &detached(py, || self.0.posterior.at(piece, &times)))
    }

    /// Covariances (K, 6, 6) of the corrections of a piece at the second of two times each, as seen from
    /// the pose at the first one; as of `pose_covariances`.
    fn relative_covariances<'py>(
        &self,
        py: Python<'py>,
        piece: usize,
        pairs: Vec<[f64; 2]>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let trajectory = &self.piece(piece)?.trajectory;
        let found = detached(py, || self.0.posterior.since(piece, trajectory, &pairs));
        to_array3(py, &found)
    }

    /// Unknowns, pairs of stretches, those that do not follow each other, surfels.
    #[getter]
    fn counts(&self) -> (usize, usize, usize, usize) {
        let c = self.0.counts;
        (c.n_unknowns, c.n_links, c.n_far_links, c.n_surfels)
    }

    /// Whether the last step was below the thresholds.
    #[getter]
    fn converged(&self) -> bool {
        self.0.converged
    }

    /// Samples without inertial data.
    #[getter]
    fn n_blind(&self) -> usize {
        self.0.pieces.iter().map(|p| p.n_blind).sum()
    }
}

impl GlobalRegistration {
    fn piece(&self, piece: usize) -> PyResult<&core::PieceResult> {
        let n = self.0.pieces.len();
        let message = || format!("piece: expected less than {n}, got {piece}");
        let found = self.0.pieces.get(piece);
        found.ok_or_else(|| PyValueError::new_err(message()))
    }
}

fn to_array3<'py>(
    py: Python<'py>,
    matrices: &[Matrix6<f64>],
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let flat: Vec<f64> = matrices.iter().flat_map(|c| c.iter().copied()).collect();
    flat.to_pyarray(py).reshape([matrices.len(), 6, 6])
}

fn fit(health: &Health) -> (f64, f64) {
    let share = health.n_inliers as f64 / health.n_moving.max(1) as f64;
    let mean_square = health.squared_residual / health.weight.max(f64::MIN_POSITIVE);
    (share, mean_square.sqrt())
}

/// Corrects whole trajectories and their slow states by everything that was seen more than once.
#[pyfunction]
#[pyo3(signature = (pieces, *, settings, plan, threads = 0))]
pub(crate) fn register_globally(
    py: Python<'_>,
    pieces: Vec<Py<Piece>>,
    settings: RegistrationSettings,
    plan: MatchingPlan,
    threads: usize,
) -> PyResult<GlobalRegistration> {
    let problem = GlobalProblem {
        pieces: pieces.iter().map(|p| p.get().of_problem()).collect(),
        plan: core::Plan {
            n_visits: plan.n_visits,
            min_overlap: plan.min_overlap,
            n_held: plan.n_held,
            posterior_interval: plan.posterior_interval,
        },
    };
    let settings = settings.into();
    in_pool(py, threads, || core::register_globally(&problem, &settings))?
        .map(GlobalRegistration)
        .map_err(|e| solve_error(py, &e))
}
