// SPDX-License-Identifier: MIT OR Apache-2.0
//! The score of a pose with its derivatives (Magnusson 2009, section 6.2).

use bentwing_trajectory::so3;
use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3, Vector6};
use rayon::prelude::*;

use crate::reference::Reference;

/// Points per parallel task; fixed, so that results do not depend on the number of threads.
const CHUNK: usize = 512;
/// Share of points expected off every surface that the reference knows (Magnusson 2009, eq. 6.7).
const OUTLIERS: f64 = 0.55;

/// How fast the weight of a point falls with its distance: `d2` of Magnusson 2009, eq. 6.8.
///
/// The negative logarithm of a mixture of the normal and a uniform distribution over the voxel is
/// approximated by a Gaussian of the same values at zero, one standard deviation and infinity.
fn decay(voxel_size: f64) -> f64 {
    let (normal, uniform) = (10.0 * (1.0 - OUTLIERS), OUTLIERS / voxel_size.powi(3));
    let d3 = -uniform.ln();
    let d1 = -(normal + uniform).ln() - d3;
    let at_one = -(normal * (-0.5_f64).exp() + uniform).ln() - d3;
    -2.0 * (at_one / d1).ln()
}

/// How a pose is judged: from which level on, and how far the score reaches.
#[derive(Clone, Debug)]
pub(crate) struct Scale {
    finest: usize,
    /// `d2` per level, over the squared reach.
    decays: Vec<f64>,
}

impl Scale {
    /// With the levels from `finest` on, standard deviations `reach` times as wide in the weights.
    pub(crate) fn new(reference: &Reference, finest: usize, reach: f64) -> Self {
        let decays = (0..reference.n_levels()).map(|l| decay(reference.size(l)) / (reach * reach));
        Self {
            finest,
            decays: decays.collect(),
        }
    }
}

/// Sums over the points of a scan.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sums {
    /// Σ (1 − w)/d2 over the matched points and 1/d2 for every other: what is to be minimal.
    pub cost: f64,
    /// Its derivative by the left perturbation `[δr, δt]`.
    pub gradient: Vector6<f64>,
    /// Its second derivative with the weights held (Gauss-Newton): never negative.
    pub hessian: Matrix6<f64>,
    /// Points in a voxel that has a distribution.
    pub n_matched: usize,
    /// Matched points within two standard deviations.
    pub n_inliers: usize,
    /// Σ w, Σ w·m² and Σ w·d² (m² Mahalanobis, d metric distance along the surface's normal).
    pub weight: f64,
    pub mahalanobis: f64,
    pub squared: f64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.cost += other.cost;
        self.gradient += other.gradient;
        self.hessian += other.hessian;
        self.n_matched += other.n_matched;
        self.n_inliers += other.n_inliers;
        self.weight += other.weight;
        self.mahalanobis += other.mahalanobis;
        self.squared += other.squared;
    }
}

/// The sums for `points` of a scan at the pose `T_map_scan`.
pub(crate) fn score(
    reference: &Reference,
    points: &[[f64; 3]],
    T_map_scan: &Isometry3<f64>,
    scale: &Scale,
) -> Sums {
    let R = so3::matrix(&T_map_scan.rotation);
    let t = T_map_scan.translation.vector;
    let chunks = points.par_chunks(CHUNK);
    let parts: Vec<Sums> = chunks
        .map(|chunk| score_chunk(reference, chunk, (&R, &t), scale))
        .collect();
    let mut sums = Sums::default();
    for part in &parts {
        sums.add(part);
    }
    sums
}

fn score_chunk(
    reference: &Reference,
    points: &[[f64; 3]],
    (R, t): (&Matrix3<f64>, &Vector3<f64>),
    scale: &Scale,
) -> Sums {
    let mut sums = Sums::default();
    let (mut g_r, mut g_t) = (Vector3::zeros(), Vector3::zeros());
    let (mut h_rr, mut h_rt, mut h_tt) = (Matrix3::zeros(), Matrix3::zeros(), Matrix3::zeros());
    let unmatched = 1.0 / scale.decays[scale.finest];
    for p in points {
        let lever = R * Vector3::from(*p);
        let x = lever + t;
        let Some((level, surface)) = reference.at(&x.into(), scale.finest) else {
            sums.cost += unmatched;
            continue;
        };
        let (q, B, d2) = (x - surface.mean, &surface.information, scale.decays[level]);
        let pull = B * q;
        let m2 = q.dot(&pull);
        let w = (-0.5 * d2 * m2).exp();
        sums.cost += (1.0 - w) / d2;
        sums.n_matched += 1;
        sums.n_inliers += usize::from(m2 < 4.0);
        sums.weight += w;
        sums.mahalanobis += w * m2;
        sums.squared += w * m2 / surface.sharpest;
        // x moves by δr × lever + δt.
        g_t += pull * w;
        g_r += lever.cross(&pull) * w;
        let L = so3::hat(&lever);
        let wB = B * w;
        let LB = L * wB;
        h_tt += wB;
        h_rt += LB;
        h_rr += LB * L.transpose();
    }
    sums.gradient.fixed_rows_mut::<3>(0).copy_from(&g_r);
    sums.gradient.fixed_rows_mut::<3>(3).copy_from(&g_t);
    sums.hessian.fixed_view_mut::<3, 3>(0, 0).copy_from(&h_rr);
    sums.hessian.fixed_view_mut::<3, 3>(0, 3).copy_from(&h_rt);
    let h_tr = h_rt.transpose();
    sums.hessian.fixed_view_mut::<3, 3>(3, 0).copy_from(&h_tr);
    sums.hessian.fixed_view_mut::<3, 3>(3, 3).copy_from(&h_tt);
    sums
}

#[cfg(test)]
pub(crate) mod tests;
