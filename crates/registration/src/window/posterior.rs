// SPDX-License-Identifier: MIT OR Apache-2.0
//! How certain the correction of a trajectory is, sample by sample.

use bentwing_trajectory::{Basis, CorrectionSpline, Trajectory};
use nalgebra::{DMatrix, Matrix6};

use crate::PoseResponse;
use crate::system::solve::Factorized;

/// Knot intervals whose control points are solved for together: their borders are solved for twice.
const INTERVALS: usize = 8;

/// The last equations of a registration; whoever asks pays for the covariances.
#[derive(Clone, Debug)]
pub struct Posterior {
    pub(crate) factorized: Factorized,
    /// How the clamped control points follow the global states.
    pub(crate) ties: Vec<PoseResponse>,
    pub(crate) spline: CorrectionSpline,
}

impl Posterior {
    /// Marginal covariance of the correction `[δr, δt]` of each sample of `trajectory`, rad and m,
    /// perturbed on the left in the map frame: that of the sample's control points, weighted by the
    /// spline. Rows count as independent, those of matches too.
    pub fn at_samples(&self, trajectory: &Trajectory) -> Vec<Matrix6<f64>> {
        let times = (0..trajectory.len()).map(|n| trajectory.time(n));
        let bases: Vec<Basis> = times.map(|t| self.spline.basis(t)).collect();
        let groups = bases.chunk_by(|a, b| a.first / INTERVALS == b.first / INTERVALS);
        groups.flat_map(|group| self.of_group(group)).collect()
    }

    /// Of the correction at one time.
    pub fn at(&self, time: f64) -> Matrix6<f64> {
        self.of_group(&[self.spline.basis(time)])[0]
    }

    /// Of samples in the order of their control points.
    fn of_group(&self, bases: &[Basis]) -> Vec<Matrix6<f64>> {
        let (first, last) = (bases[0].first, bases[bases.len() - 1].first);
        let joint = self.factorized.covariance(first..last + 4, &self.ties);
        let one = |basis: &Basis| weighted(&joint, basis.first - first, &basis.weights);
        bases.iter().map(one).collect()
    }
}

/// `Σ_kl w_k w_l Σ_kl` over four control points from `first` on.
fn weighted(joint: &DMatrix<f64>, first: usize, weights: &[f64; 4]) -> Matrix6<f64> {
    let mut sum = Matrix6::zeros();
    for (k, w) in weights.iter().enumerate() {
        for (l, v) in weights.iter().enumerate() {
            sum += joint.fixed_view::<6, 6>(6 * (first + k), 6 * (first + l)) * (w * v);
        }
    }
    0.5 * (sum + sum.transpose())
}

#[cfg(test)]
mod tests;
