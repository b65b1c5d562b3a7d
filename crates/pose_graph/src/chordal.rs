// SPDX-License-Identifier: MIT OR Apache-2.0
//! A start near the best poses that needs none: chordal relaxation (Martinec and Pajdla 2007;
//! Carlone, Tron, Daniilidis and Dellaert 2015, section III).
//!
//! Rotations first: `Σ κ ‖R_to − R_from R̂‖²` over matrices that need not be rotations is linear, and
//! its minimum, brought back to rotations, is near the best. Then positions, given the rotations.
//! Both systems have a block of three for each node: the rows of a rotation obey the same equations,
//! and so are three right sides.

use bentwing_trajectory::so3;
use faer::Mat;
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};

use crate::GraphError;
use crate::blocks::{BlockMatrix, Structure};
use crate::cholesky::Cholesky;
use crate::graph::{Link, PoseGraph};

/// Finds poses from links alone, for graphs of one structure.
pub struct Relaxation<'a> {
    graph: &'a PoseGraph,
    numbers: &'a [Option<usize>],
    matrix: BlockMatrix<'a, 3>,
    right: Mat<f64>,
    cholesky: Cholesky<3>,
}

impl<'a> Relaxation<'a> {
    /// Analyses the structure of `graph`.
    ///
    /// # Errors
    /// When memory or the range of the indices is exceeded.
    pub fn new(
        graph: &'a PoseGraph,
        numbers: &'a [Option<usize>],
        structure: &'a Structure,
    ) -> Result<Self, GraphError> {
        Ok(Self {
            graph,
            numbers,
            matrix: BlockMatrix::new(structure),
            right: Mat::zeros(0, 0),
            cholesky: Cholesky::new(structure)?,
        })
    }

    /// The poses for these weights of the links; the fixed ones are as in the graph.
    ///
    /// # Errors
    /// When the links do not determine all poses.
    pub fn poses(&mut self, weights: &[f64]) -> Result<Vec<Isometry3<f64>>, GraphError> {
        let rotations = self.rotations(weights)?;
        let positions = self.positions(&rotations, weights)?;
        let poses = rotations.into_iter().zip(positions);
        Ok(poses
            .map(|(R, p)| Isometry3::from_parts(p.into(), R))
            .collect())
    }

    /// Unknown of a node are the three rows of its matrix, one per right side: with `R_to = R_from R̂`
    /// a row obeys `x_to = R̂ᵀ x_from`, and with gravity `ûᵀ x = 0, 0, 1`.
    fn rotations(&mut self, weights: &[f64]) -> Result<Vec<UnitQuaternion<f64>>, GraphError> {
        self.begin(3);
        for (link, &weight) in self.graph.links.iter().zip(weights) {
            let kappa = weight * link.information.fixed_view::<3, 3>(0, 0).trace() / 3.0;
            let turn = so3::matrix(&link.T_from_to.rotation);
            let from = link.from.map(|from| self.graph.poses[from].rotation);
            let known = [from.unwrap_or_default(), self.graph.poses[link.to].rotation]
                .map(|R| so3::matrix(&R).transpose());
            self.join(
                link,
                &(Matrix3::identity() * kappa),
                &turn.transpose(),
                known,
            );
        }
        for term in &self.graph.gravity {
            if let Some(number) = self.numbers[term.node] {
                let outer = term.up * term.up.transpose() * term.weight;
                self.matrix.add(number, number, &outer);
                for c in 0..3 {
                    self.right[(3 * number + c, 2)] += term.weight * term.up[c];
                }
            }
        }
        let relaxed = self.solve()?;
        let rotation = |node: usize| match self.numbers[node] {
            None => self.graph.poses[node].rotation,
            Some(number) => {
                nearest_rotation(&Matrix3::from_fn(|r, c| relaxed[(3 * number + c, r)]))
            }
        };
        Ok((0..self.numbers.len()).map(rotation).collect())
    }

    /// `Σ (p_to − p_from − R_from t̂)ᵀ M (…)` with the information M turned into the map.
    fn positions(
        &mut self,
        rotations: &[UnitQuaternion<f64>],
        weights: &[f64],
    ) -> Result<Vec<Vector3<f64>>, GraphError> {
        self.begin(1);
        for (link, &weight) in self.graph.links.iter().zip(weights) {
            let R_from = link
                .from
                .map_or_else(UnitQuaternion::identity, |from| rotations[from]);
            let R = so3::matrix(&(R_from * link.T_from_to.rotation));
            let measured = link.information.fixed_view::<3, 3>(3, 3) * weight;
            let information = R * measured * R.transpose();
            let way = R_from * link.T_from_to.translation.vector;
            self.pull(link, &(information * way));
            let from = link
                .from
                .map(|from| self.graph.poses[from].translation.vector);
            let known = [
                from.unwrap_or_default(),
                self.graph.poses[link.to].translation.vector,
            ];
            self.join(link, &information, &Matrix3::identity(), known);
        }
        let solved = self.solve()?;
        let position = |node: usize| match self.numbers[node] {
            None => self.graph.poses[node].translation.vector,
            Some(number) => Vector3::from_fn(|c, _| solved[(3 * number + c, 0)]),
        };
        Ok((0..self.numbers.len()).map(position).collect())
    }

    fn begin(&mut self, n_sides: usize) {
        self.matrix.clear();
        self.right = Mat::zeros(3 * self.numbers.iter().flatten().count(), n_sides);
    }

    /// Adds `‖x_to − G x_from‖²`, weighted by `information`; ends that are no unknowns have the
    /// values `known`.
    fn join<const K: usize>(
        &mut self,
        link: &Link,
        information: &Matrix3<f64>,
        G: &Matrix3<f64>,
        known: [nalgebra::SMatrix<f64, 3, K>; 2],
    ) {
        let ends = [
            link.from.and_then(|from| self.numbers[from]),
            self.numbers[link.to],
        ];
        let crossed = information * G;
        if let Some(to) = ends[1] {
            self.matrix.add(to, to, information);
        }
        if let Some(from) = ends[0] {
            self.matrix.add(from, from, &G.tr_mul(&crossed));
        }
        match ends {
            [Some(from), Some(to)] => self.matrix.add(to, from, &-crossed),
            [None, Some(to)] => self.add_right(to, &(crossed * known[0])),
            [Some(from), None] => self.add_right(from, &crossed.tr_mul(&known[1])),
            [None, None] => {}
        }
    }

    /// Adds `±v` to the right sides of a link's ends.
    fn pull(&mut self, link: &Link, v: &Vector3<f64>) {
        if let Some(to) = self.numbers[link.to] {
            self.add_right(to, v);
        }
        if let Some(from) = link.from.and_then(|from| self.numbers[from]) {
            self.add_right(from, &-v);
        }
    }

    fn add_right<const K: usize>(&mut self, number: usize, v: &nalgebra::SMatrix<f64, 3, K>) {
        for side in 0..K {
            for c in 0..3 {
                self.right[(3 * number + c, side)] += v[(c, side)];
            }
        }
    }

    fn solve(&mut self) -> Result<Mat<f64>, GraphError> {
        self.cholesky.factorize(&self.matrix)?;
        let mut solution = std::mem::replace(&mut self.right, Mat::zeros(0, 0));
        self.cholesky.solve(solution.as_mut());
        Ok(solution)
    }
}

/// The rotation nearest to a matrix: `U diag(1, 1, ±1) Vᵀ`.
fn nearest_rotation(matrix: &Matrix3<f64>) -> UnitQuaternion<f64> {
    let svd = matrix.svd(true, true);
    let (Some(U), Some(V_t)) = (svd.u, svd.v_t) else {
        return UnitQuaternion::identity();
    };
    let sign = (U.determinant() * V_t.determinant()).signum();
    let R = U * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * V_t;
    so3::of_matrix(R)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equations::structure;
    use crate::graph::GravityTerm;
    use crate::poses::numbered;
    use crate::testing::{farthest, helix};

    fn started(graph: &PoseGraph) -> Result<Vec<Isometry3<f64>>, GraphError> {
        let numbers = numbered(graph);
        let weights = vec![1.0; graph.links.len()];
        let structure = structure(graph, &numbers, &weights);
        Relaxation::new(graph, &numbers, &structure)?.poses(&weights)
    }

    #[test]
    fn exact_links_give_the_true_poses_whatever_the_given_ones() -> Result<(), GraphError> {
        let truth = helix(4, 12);
        let mut graph = truth.clone();
        graph.poses[1..].fill(Isometry3::identity());
        graph.gravity = (5..9)
            .map(|node| GravityTerm {
                node,
                up: truth.poses[node].rotation.inverse() * Vector3::z(),
                weight: 100.0,
            })
            .collect();
        let poses = started(&graph)?;
        assert!(farthest(&poses, &truth.poses) < 1e-9);
        let turns = poses
            .iter()
            .zip(&truth.poses)
            .map(|(a, b)| a.rotation.angle_to(&b.rotation));
        assert!(turns.fold(0.0, f64::max) < 1e-7);
        Ok(())
    }

    #[test]
    fn a_prior_holds_the_graph_as_a_fixed_node_does() -> Result<(), GraphError> {
        let truth = helix(3, 8);
        let mut graph = truth.clone();
        graph.fixed[0] = false;
        graph.links.push(Link {
            from: None,
            to: 7,
            T_from_to: truth.poses[7],
            information: nalgebra::Matrix6::identity(),
            trusted: true,
        });
        graph.poses.fill(Isometry3::identity());
        assert!(farthest(&started(&graph)?, &truth.poses) < 1e-9);
        Ok(())
    }
}
