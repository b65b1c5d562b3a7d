// SPDX-License-Identifier: MIT OR Apache-2.0
//! How certain the poses of a global registration are.

use bentwing_trajectory::CorrectionSpline;
use faer::Mat;
use nalgebra::Matrix6;

use crate::N_GLOBALS;
use crate::system::solve::Factorized;

/// Poses that are solved for together: of all pairs among them only the diagonal is used.
const TOGETHER: usize = 8;

/// The last equations; whoever asks pays for the covariances.
#[derive(Clone, Debug)]
pub struct GlobalPosterior {
    pub(super) factorized: Factorized,
    /// Spline and first control point of each piece.
    pub(super) splines: Vec<(CorrectionSpline, usize)>,
    pub(super) n_controls: usize,
}

impl GlobalPosterior {
    /// Marginal covariances of the correction `[δr, δt]` of a piece at `times`, rad and m, perturbed
    /// on the left in the map frame. Rows count as independent.
    pub fn at(&self, piece: usize, times: &[f64]) -> Vec<Matrix6<f64>> {
        let groups = times.chunks(TOGETHER);
        groups
            .flat_map(|times| self.of_group(piece, times))
            .collect()
    }

    fn of_group(&self, piece: usize, times: &[f64]) -> Vec<Matrix6<f64>> {
        let (spline, first) = &self.splines[piece];
        let mut rows = Mat::<f64>::zeros(6 * self.n_controls + N_GLOBALS, 6 * times.len());
        for (pose, &t) in times.iter().enumerate() {
            let basis = spline.basis(t);
            for (k, w) in basis.weights.iter().enumerate() {
                for i in 0..6 {
                    rows[(6 * (first + basis.first + k) + i, 6 * pose + i)] = *w;
                }
            }
        }
        let joint = self.factorized.covariance_of(&rows, &[]);
        let of_pose = |pose| joint.fixed_view::<6, 6>(6 * pose, 6 * pose).into_owned();
        (0..times.len()).map(of_pose).collect()
    }
}
