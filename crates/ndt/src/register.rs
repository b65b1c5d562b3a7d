// SPDX-License-Identifier: MIT OR Apache-2.0
//! Registration of a scan: from coarse to fine, Gauss-Newton with Levenberg's damping.

use bentwing_trajectory::so3;
use nalgebra::{Isometry3, Matrix3, Matrix6, Translation3, Vector6};
use thiserror::Error;

use crate::reference::Reference;
use crate::score::{Scale, Sums, score};

/// How much wider the weights reach on the coarsest level; half as wide on each finer one, down to 1.
const FIRST_REACH: f64 = 4.0;
/// Most evaluations of the score on one level.
const MAX_EVALUATIONS: usize = 12;
/// A step shorter than this, rad and m, is the last one: of the finest level, and of the others.
const LAST_STEP: (f64, f64) = (2e-5, 1e-3);
const COARSE_STEP: (f64, f64) = (2e-4, 1e-2);
/// Damping of the first step that fails, its growth with each further one, and its largest value.
const DAMPING: (f64, f64, f64) = (1e-3, 10.0, 1e3);

/// Why a scan has no pose.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum NdtError {
    /// The reference and the scan have too little in common.
    #[error(
        "{matched} of {points} points lie where the keyframes saw a surface, fewer than {least}"
    )]
    TooFewMatches {
        /// Points in voxels with a distribution.
        matched: usize,
        /// Points of the scan.
        points: usize,
        /// How many are needed.
        least: usize,
    },
    /// The normal equations have no unique solution.
    #[error("the normal equations of a scan with {matched} matched points are singular")]
    Singular {
        /// Points in voxels with a distribution.
        matched: usize,
    },
    /// A value is not finite.
    #[error("the registration of a scan left the range of finite numbers")]
    NotFinite,
}

/// Fewest matched points, so that a handful of chance hits is no pose.
const MIN_MATCHES: usize = 30;

/// Where a scan is expected, and how well.
#[derive(Clone, Copy, Debug)]
pub struct Expectation {
    /// `T_map_scan` to begin with.
    pub pose: Isometry3<f64>,
    /// Standard deviation of its rotation, rad.
    pub rotation_sigma: f64,
    /// Standard deviation of its translation, m.
    pub translation_sigma: f64,
    /// Information that a matched point adds relative to that of an independent one: what is wrong
    /// with a scan is common to many of its points.
    pub independence: f64,
}

/// Result of a registration.
#[derive(Clone, Debug)]
pub struct Registration {
    /// `T_map_scan`.
    pub pose: Isometry3<f64>,
    /// Points in voxels with a distribution.
    pub n_matched: usize,
    /// Share of these within two standard deviations.
    pub inlier_share: f64,
    /// Weighted root mean square of their distances in standard deviations.
    pub residual_rms: f64,
    /// Weighted root mean square of their distances, m.
    pub rmse: f64,
    /// Information of the scan about its translation, 1/m², map frame.
    pub translation: Matrix3<f64>,
    /// Information about its rotation about its own origin, 1/rad².
    pub rotation: Matrix3<f64>,
    /// Evaluations of the score.
    pub iterations: usize,
    /// Whether the last step on the finest level was short enough.
    pub converged: bool,
}

/// Finds the pose at which `points` of a scan fit the reference, from the expected one.
///
/// `coarse` tells whether to begin on the coarsest level; otherwise only the finest is used.
///
/// # Errors
/// When scan and reference have too little in common, or the equations cannot be solved.
pub fn register(
    reference: &Reference,
    points: &[[f64; 3]],
    expected: &Expectation,
    coarse: bool,
) -> Result<Registration, NdtError> {
    let mut search = Search {
        reference,
        points,
        expected,
        iterations: 0,
    };
    let first = if coarse { reference.n_levels() } else { 1 };
    let mut pose = expected.pose;
    for level in (1..first).rev() {
        let reach = (FIRST_REACH / f64::from(1 << (first - 1 - level))).max(1.0);
        let scale = Scale::new(reference, level, reach);
        pose = search.descend(&pose, &scale, COARSE_STEP)?.pose;
    }
    let found = search.descend(&pose, &Scale::new(reference, 0, 1.0), LAST_STEP)?;
    search.finish(&found)
}

struct Search<'a> {
    reference: &'a Reference,
    points: &'a [[f64; 3]],
    expected: &'a Expectation,
    iterations: usize,
}

/// Where a descent has come to.
struct Found {
    pose: Isometry3<f64>,
    sums: Sums,
    converged: bool,
}

impl Search<'_> {
    /// Steps down from `pose` until the steps are short.
    fn descend(
        &mut self,
        pose: &Isometry3<f64>,
        scale: &Scale,
        last_step: (f64, f64),
    ) -> Result<Found, NdtError> {
        let mut here = Found {
            pose: *pose,
            sums: self.evaluate(pose, scale)?,
            converged: false,
        };
        let mut damping = 0.0;
        for _ in 1..MAX_EVALUATIONS {
            let step = damped_step(&here.sums, damping)?;
            if is_short(&step, last_step) {
                here.converged = true;
                break;
            }
            let pose = moved(&here.pose, &step);
            let sums = self.evaluate(&pose, scale)?;
            if sums.cost < here.sums.cost {
                (here.pose, here.sums) = (pose, sums);
                damping /= DAMPING.1;
            } else {
                damping = (damping * DAMPING.1).max(DAMPING.0);
                if damping > DAMPING.2 {
                    // The score jumps where points change voxels; no step improves on this pose.
                    here.converged = true;
                    break;
                }
            }
        }
        Ok(here)
    }

    /// The score of the points and of the expectation.
    fn evaluate(&mut self, pose: &Isometry3<f64>, scale: &Scale) -> Result<Sums, NdtError> {
        self.iterations += 1;
        let mut sums = score(self.reference, self.points, pose, scale);
        if sums.n_matched < MIN_MATCHES {
            return Err(NdtError::TooFewMatches {
                matched: sums.n_matched,
                points: self.points.len(),
                least: MIN_MATCHES,
            });
        }
        let e = self.deviation(pose);
        let information = self.information();
        let pull = information.component_mul(&e);
        sums.cost = sums.cost * self.expected.independence + 0.5 * e.dot(&pull);
        sums.gradient = sums.gradient * self.expected.independence + pull;
        sums.hessian *= self.expected.independence;
        for i in 0..6 {
            sums.hessian[(i, i)] += information[i];
        }
        Ok(sums)
    }

    /// `[Log(R R₀ᵀ), p − p₀]` of a pose from the expected one.
    fn deviation(&self, pose: &Isometry3<f64>) -> Vector6<f64> {
        let before = &self.expected.pose;
        let r = so3::log(&(pose.rotation * before.rotation.inverse()));
        let t = pose.translation.vector - before.translation.vector;
        Vector6::new(r.x, r.y, r.z, t.x, t.y, t.z)
    }

    fn information(&self) -> Vector6<f64> {
        let r = self.expected.rotation_sigma.powi(-2);
        let t = self.expected.translation_sigma.powi(-2);
        Vector6::new(r, r, r, t, t, t)
    }

    fn finish(self, found: &Found) -> Result<Registration, NdtError> {
        let sums = &found.sums;
        let information = Matrix6::from_diagonal(&self.information());
        let own = (sums.hessian - information) / self.expected.independence;
        let weight = sums.weight.max(f64::MIN_POSITIVE);
        let result = Registration {
            pose: found.pose,
            n_matched: sums.n_matched,
            inlier_share: sums.n_inliers as f64 / sums.n_matched as f64,
            residual_rms: (sums.mahalanobis / weight).sqrt(),
            rmse: (sums.squared / weight).sqrt(),
            rotation: own.fixed_view::<3, 3>(0, 0).into_owned(),
            translation: own.fixed_view::<3, 3>(3, 3).into_owned(),
            iterations: self.iterations,
            converged: found.converged,
        };
        let finite = result.rmse.is_finite() && result.pose.translation.vector.norm().is_finite();
        if finite {
            Ok(result)
        } else {
            Err(NdtError::NotFinite)
        }
    }
}

fn is_short(step: &Vector6<f64>, (angle, length): (f64, f64)) -> bool {
    step.fixed_rows::<3>(0).norm() < angle && step.fixed_rows::<3>(3).norm() < length
}

/// `R ← Exp(δr) R`, `p ← p + δt`.
pub(crate) fn moved(pose: &Isometry3<f64>, step: &Vector6<f64>) -> Isometry3<f64> {
    let turned = so3::turned(&step.fixed_rows::<3>(0).into_owned(), &pose.rotation);
    let shifted = pose.translation.vector + step.fixed_rows::<3>(3);
    Isometry3::from_parts(Translation3::from(shifted), turned)
}

/// The damped Gauss-Newton step.
fn damped_step(sums: &Sums, damping: f64) -> Result<Vector6<f64>, NdtError> {
    let mut h = sums.hessian;
    for i in 0..6 {
        h[(i, i)] *= 1.0 + damping;
    }
    if !(sums.cost.is_finite() && h.iter().all(|v| v.is_finite())) {
        return Err(NdtError::NotFinite);
    }
    let singular = NdtError::Singular {
        matched: sums.n_matched,
    };
    let step = h.cholesky().ok_or(singular)?.solve(&-sums.gradient);
    if step.iter().all(|v| v.is_finite()) {
        Ok(step)
    } else {
        Err(NdtError::NotFinite)
    }
}

#[cfg(test)]
mod tests;
