// SPDX-License-Identifier: MIT OR Apache-2.0
//! Random poses with large angles, graphs with a known truth, and the comparison of Jacobians with
//! central differences.

use bentwing_trajectory::so3;
use nalgebra::{Isometry3, Matrix6, SMatrix, SVector, Vector3, Vector6};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

use crate::dogleg::Stop;
use crate::graph::{Link, PoseGraph};
use crate::poses::correct;
use crate::robust::Robust;

/// How false links are told in tests.
pub const ROBUST: Robust = Robust {
    kernel_width: 3.0,
    max_ratio: 25.0,
    growth: 2.0,
};

/// How well minima are found in tests.
pub const FINELY: Stop = Stop {
    max_iterations: 50,
    min_relative_decrease: 1e-9,
};

pub fn vector(max: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-max..max).prop_map(Vector3::from)
}

/// Poses with any rotation, some metres apart.
pub fn isometries(n: usize) -> impl Strategy<Value = Vec<Isometry3<f64>>> {
    let one = (vector(1.8), vector(4.0))
        .prop_map(|(phi, t)| Isometry3::from_parts(t.into(), so3::exp(&phi)));
    prop::collection::vec(one, n)
}

/// A pose with a correction `[δr, δt]` composed in.
pub fn corrected(pose: &Isometry3<f64>, delta: &Vector6<f64>) -> Isometry3<f64> {
    let mut moved = *pose;
    correct(&mut moved, delta.as_slice());
    moved
}

/// Checks `JᵀJ` and `Jᵀr` against central differences of `residual`; gives their J.
pub fn assert_jacobian<const D: usize>(
    residual: impl Fn(&Vector6<f64>) -> SVector<f64, D>,
    information: &Matrix6<f64>,
    gradient: &Vector6<f64>,
) -> Result<SMatrix<f64, D, 6>, TestCaseError> {
    let h = 1e-4;
    let at = |unknown: usize, size: f64| {
        let mut delta = Vector6::zeros();
        delta[unknown] = size;
        residual(&delta)
    };
    // Fourth order, so that a step large enough against rounding has no error of its own.
    let columns: Vec<_> = (0..6)
        .map(|u| (at(u, -2.0 * h) - at(u, -h) * 8.0 + at(u, h) * 8.0 - at(u, 2.0 * h)) / (12.0 * h))
        .collect();
    let J = SMatrix::<f64, D, 6>::from_columns(&columns);
    let scale = information.amax().max(1.0);
    prop_assert!((J.tr_mul(&J) - information).amax() < 1e-6 * scale);
    let numeric = J.tr_mul(&residual(&Vector6::zeros()));
    prop_assert!((numeric - gradient).amax() < 1e-6 * gradient.amax().max(1.0));
    Ok(J)
}

/// Poses on `n_turns` of a helix with `per_turn` poses each, linked in time and from turn to turn;
/// the measurements are exact.
pub fn helix(n_turns: usize, per_turn: usize) -> PoseGraph {
    let pose = |n: usize| {
        let angle = std::f64::consts::TAU * n as f64 / per_turn as f64;
        let p = Vector3::new(5.0 * angle.cos(), 5.0 * angle.sin(), 0.2 * angle);
        let R = so3::exp(&Vector3::new(0.0, 0.0, angle)) * so3::exp(&Vector3::new(0.3, 0.1, 0.0));
        Isometry3::from_parts(p.into(), R)
    };
    let poses: Vec<_> = (0..n_turns * per_turn).map(pose).collect();
    let link = |from: usize, to: usize, trusted: bool| Link {
        from: Some(from),
        to,
        T_from_to: poses[from].inv_mul(&poses[to]),
        information: Matrix6::from_diagonal(&Vector6::new(1e4, 1e4, 1e4, 400.0, 400.0, 400.0)),
        trusted,
    };
    let odometry = (1..poses.len()).map(|n| link(n - 1, n, true));
    let loops = (per_turn..poses.len()).map(|n| link(n - per_turn, n, false));
    let links = odometry.chain(loops).collect();
    let mut fixed = vec![false; poses.len()];
    fixed[0] = true;
    PoseGraph {
        poses,
        fixed,
        links,
        gravity: Vec::new(),
    }
}

/// The helix with measurements that are off by some millimetres and milliradians.
pub fn noisy_helix(n_turns: usize, per_turn: usize) -> PoseGraph {
    let mut graph = helix(n_turns, per_turn);
    for (k, link) in graph.links.iter_mut().enumerate() {
        let wave = |i: usize| 0.005 * ((3 * k + i) as f64 * 1.7).sin();
        let turn = so3::exp(&Vector3::new(wave(0), wave(1), wave(2)));
        let shift = Vector3::new(wave(3), wave(4), wave(5)) * 4.0;
        link.T_from_to *= Isometry3::from_parts(shift.into(), turn);
    }
    graph
}

/// `n` links between nodes that are far apart, all with what one of the loop links has measured.
pub fn with_false_links(mut graph: PoseGraph, n: usize) -> PoseGraph {
    let n_nodes = graph.poses.len();
    let seen = graph.links[n_nodes].clone();
    for k in 0..n {
        let from = (37 * k) % n_nodes;
        let to = (from + 30 + 11 * k) % n_nodes;
        let ends = if from == to {
            (0, n_nodes - 1)
        } else {
            (from, to)
        };
        graph.links.push(Link {
            from: Some(ends.0),
            to: ends.1,
            ..seen.clone()
        });
    }
    graph
}

/// What a doubtful link between two nodes of a graph with true poses measures.
pub fn true_link(truth: &PoseGraph, from: usize, to: usize) -> Link {
    Link {
        from: Some(from),
        to,
        T_from_to: truth.poses[from].inv_mul(&truth.poses[to]),
        trusted: false,
        ..truth.links[0].clone()
    }
}

/// The poses that only the links in time give, with a drift of `turn` rad per link.
pub fn drifted(graph: &PoseGraph, turn: &Vector3<f64>) -> Vec<Isometry3<f64>> {
    let mut poses = vec![graph.poses[0]];
    for link in graph.links.iter().filter(|l| l.trusted) {
        let last = poses[poses.len() - 1];
        let drift = Isometry3::from_parts(Vector3::zeros().into(), so3::exp(turn));
        poses.push(last * link.T_from_to * drift);
    }
    poses
}

/// The largest distance between poses of the same number, m.
pub fn farthest(a: &[Isometry3<f64>], b: &[Isometry3<f64>]) -> f64 {
    let distances = a
        .iter()
        .zip(b)
        .map(|(a, b)| (a.translation.vector - b.translation.vector).norm());
    distances.fold(0.0, f64::max)
}
