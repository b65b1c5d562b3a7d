// SPDX-License-Identifier: MIT OR Apache-2.0
//! Poses as unknowns: the numbering of those that are free, and their correction.

use bentwing_trajectory::so3;
use nalgebra::{Isometry3, Vector3};

use crate::graph::PoseGraph;

/// Numbers of the free nodes among the unknowns, `None` for the fixed.
pub fn numbered(graph: &PoseGraph) -> Vec<Option<usize>> {
    let mut n_free = 0;
    let number = |&fixed: &bool| {
        (!fixed).then(|| {
            n_free += 1;
            n_free - 1
        })
    };
    graph.fixed.iter().map(number).collect()
}

/// `R ← Exp(δr) R`, `p ← p + δt` with `delta = [δr, δt]`.
pub fn correct(pose: &mut Isometry3<f64>, delta: &[f64]) {
    pose.rotation = so3::turned(&Vector3::from_column_slice(&delta[..3]), &pose.rotation);
    pose.translation.vector += Vector3::from_column_slice(&delta[3..6]);
}

/// `poses` with the free ones corrected by `step`, six numbers each.
pub fn corrected(
    poses: &[Isometry3<f64>],
    numbers: &[Option<usize>],
    step: &[f64],
) -> Vec<Isometry3<f64>> {
    let mut moved = poses.to_vec();
    for (pose, number) in moved.iter_mut().zip(numbers) {
        if let Some(number) = number {
            correct(pose, &step[6 * number..][..6]);
        }
    }
    moved
}
