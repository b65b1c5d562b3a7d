// SPDX-License-Identifier: MIT OR Apache-2.0
//! `_core.solve_pose_graph`.

use bentwing_pose_graph as core;
use bentwing_pose_graph::{GravityTerm, Link, PoseGraph, Robust};
use nalgebra::{Isometry3, Matrix6};
use numpy::{
    PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
    PyUntypedArrayMethods, ToPyArray,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{finite, finite_rows, rows, to_array2, unit_quaternion, xyzw};
use crate::errors::{detached, graph_error};

/// Node that stands for the map: a link from there is a prior.
const MAP: i64 = -1;

#[derive(FromPyObject)]
pub(crate) struct SolveSettings {
    max_iterations: usize,
    min_relative_decrease: f64,
    robust: Option<RobustSettings>,
}

#[derive(FromPyObject)]
pub(crate) struct RobustSettings {
    kernel_width: f64,
    max_ratio: f64,
    growth: f64,
}

impl From<SolveSettings> for core::Settings {
    fn from(s: SolveSettings) -> Self {
        Self {
            max_iterations: s.max_iterations,
            min_relative_decrease: s.min_relative_decrease,
            robust: s.robust.map(|r| Robust {
                kernel_width: r.kernel_width,
                max_ratio: r.max_ratio,
                growth: r.growth,
            }),
        }
    }
}

/// The best poses of a graph.
#[pyclass(frozen, module = "bentwing._core")]
pub(crate) struct PoseGraphSolution(core::Solution);

#[pymethods]
impl PoseGraphSolution {
    /// Positions (N, 3), m, map frame.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let poses = self.0.poses.iter();
        let rows: Vec<[f64; 3]> = poses.map(|T| T.translation.vector.into()).collect();
        to_array2(py, &rows)
    }

    /// Rotations (N, 4) as unit quaternions x, y, z, w.
    #[getter]
    fn quats_xyzw<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let poses = self.0.poses.iter().map(|T| &T.rotation);
        let rows: Vec<[f64; 4]> = poses.map(xyzw).collect();
        to_array2(py, &rows)
    }

    /// Weight of each link (L,): 1 believed, 0 rejected.
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.weights.to_pyarray(py)
    }

    /// Squared residual of each link (L,) in units of its variance.
    #[getter]
    fn chi2<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.chi2.to_pyarray(py)
    }

    /// Cost of the poses.
    #[getter]
    fn cost(&self) -> f64 {
        self.0.cost
    }

    /// Cost of the given poses, with all links.
    #[getter]
    fn initial_cost(&self) -> f64 {
        self.0.initial_cost
    }

    /// Linearizations.
    #[getter]
    fn n_iterations(&self) -> usize {
        self.0.n_iterations
    }

    /// Whether another step would have gained next to nothing.
    #[getter]
    fn converged(&self) -> bool {
        self.0.converged
    }
}

/// Links between nodes, row by row.
#[derive(FromPyObject)]
pub(crate) struct LinkArrays<'py> {
    nodes: PyReadonlyArray2<'py, i64>,
    positions: PyReadonlyArray2<'py, f64>,
    quats_xyzw: PyReadonlyArray2<'py, f64>,
    information: PyReadonlyArray3<'py, f64>,
    trusted: PyReadonlyArray1<'py, bool>,
}

/// Directions of gravity, row by row.
#[derive(FromPyObject)]
pub(crate) struct GravityArrays<'py> {
    nodes: PyReadonlyArray1<'py, i64>,
    ups: PyReadonlyArray2<'py, f64>,
    weights: PyReadonlyArray1<'py, f64>,
}

/// Finds the poses that agree best with links and gravity.
#[pyfunction]
#[pyo3(signature = (positions, quats_xyzw, fixed, *, links, gravity, settings))]
pub(crate) fn solve_pose_graph(
    py: Python<'_>,
    positions: PyReadonlyArray2<'_, f64>,
    quats_xyzw: PyReadonlyArray2<'_, f64>,
    fixed: PyReadonlyArray1<'_, bool>,
    links: LinkArrays<'_>,
    gravity: GravityArrays<'_>,
    settings: SolveSettings,
) -> PyResult<PoseGraphSolution> {
    let graph = PoseGraph {
        poses: poses("", &positions, &quats_xyzw)?,
        fixed: flags("fixed", &fixed)?.to_vec(),
        links: links_of(&links)?,
        gravity: gravity_of(&gravity)?,
    };
    let settings = settings.into();
    detached(py, || core::solve(&graph, &settings))
        .map(PoseGraphSolution)
        .map_err(|e| graph_error(py, &e))
}

fn links_of(links: &LinkArrays<'_>) -> PyResult<Vec<Link>> {
    let ends: &[[i64; 2]] = rows("links.nodes", &links.nodes)?;
    let measured = poses("links.", &links.positions, &links.quats_xyzw)?;
    let omegas = matrices("links.information", &links.information)?;
    let trusted = flags("links.trusted", &links.trusted)?;
    same_length("links.nodes", ends.len(), measured.len())?;
    same_length("links.information", omegas.len(), measured.len())?;
    same_length("links.trusted", trusted.len(), measured.len())?;
    let link = |row: usize| {
        Ok(Link {
            from: match ends[row][0] {
                MAP => None,
                node => Some(index("links.nodes", row, node)?),
            },
            to: index("links.nodes", row, ends[row][1])?,
            T_from_to: measured[row],
            information: Matrix6::from_row_slice(&omegas[row]),
            trusted: trusted[row],
        })
    };
    (0..measured.len()).map(link).collect()
}

fn gravity_of(gravity: &GravityArrays<'_>) -> PyResult<Vec<GravityTerm>> {
    let ups: &[[f64; 3]] = finite_rows("gravity.ups", &gravity.ups)?;
    let weights = finite("gravity.weights", &gravity.weights, ups.len())?;
    let nodes = contiguous("gravity.nodes", &gravity.nodes)?;
    same_length("gravity.nodes", nodes.len(), ups.len())?;
    let term = |row: usize| {
        Ok(GravityTerm {
            node: index("gravity.nodes", row, nodes[row])?,
            up: ups[row].into(),
            weight: weights[row],
        })
    };
    (0..ups.len()).map(term).collect()
}

fn poses(
    prefix: &str,
    positions: &PyReadonlyArray2<'_, f64>,
    quats_xyzw: &PyReadonlyArray2<'_, f64>,
) -> PyResult<Vec<Isometry3<f64>>> {
    let positions: &[[f64; 3]] = finite_rows(&format!("{prefix}positions"), positions)?;
    let name = format!("{prefix}quats_xyzw");
    let quats = finite_rows(&name, quats_xyzw)?;
    same_length(&name, quats.len(), positions.len())?;
    let pose = |(p, q): (&[f64; 3], &[f64; 4])| {
        Ok(Isometry3::from_parts(
            (*p).into(),
            unit_quaternion(&name, q)?,
        ))
    };
    positions.iter().zip(quats).map(pose).collect()
}

/// The rows of an (N, 6, 6) array.
fn matrices<'a>(name: &str, array: &'a PyReadonlyArray3<'_, f64>) -> PyResult<&'a [[f64; 36]]> {
    let refused = |what: &str| Err(PyValueError::new_err(format!("{name}: {what}")));
    let [n, 6, 6] = *array.shape() else {
        return refused(&format!(
            "expected shape (N, 6, 6), got {:?}",
            array.shape()
        ));
    };
    let Some(flat) = array.as_slice().ok().filter(|_| array.is_c_contiguous()) else {
        return refused("expected a C-contiguous array");
    };
    let rows = &flat.as_chunks().0[..n];
    match rows
        .iter()
        .position(|m: &[f64; 36]| !m.iter().all(|v| v.is_finite()))
    {
        None => Ok(rows),
        Some(row) => refused(&format!("matrix {row} is not finite")),
    }
}

fn flags<'a>(name: &str, array: &'a PyReadonlyArray1<'_, bool>) -> PyResult<&'a [bool]> {
    contiguous(name, array)
}

fn contiguous<'a, T: numpy::Element>(
    name: &str,
    array: &'a PyReadonlyArray1<'_, T>,
) -> PyResult<&'a [T]> {
    let values = array.as_slice().ok().filter(|_| array.is_contiguous());
    values.ok_or_else(|| PyValueError::new_err(format!("{name}: expected a contiguous array")))
}

fn same_length(name: &str, n: usize, expected: usize) -> PyResult<()> {
    if n == expected {
        return Ok(());
    }
    let message = format!("{name}: expected {expected} rows, got {n}");
    Err(PyValueError::new_err(message))
}

fn index(name: &str, row: usize, node: i64) -> PyResult<usize> {
    usize::try_from(node).ok().ok_or_else(|| {
        PyValueError::new_err(format!("{name}: row {row} names node {node}, below zero"))
    })
}
