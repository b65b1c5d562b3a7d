// SPDX-License-Identifier: MIT OR Apache-2.0
//! The iterated update of the state by the features of a sweep.

use bentwing_trajectory::so3;
use bentwing_voxels::sym3;
use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::features::Feature;
use crate::gain;
use crate::map::LocalMap;
use crate::measure::{self, Moment, Mounts, Row, SEEN, Turning, column};
use crate::state::{Square, State, Tangent, at};

/// A residual counts if it is within so many standard deviations, the pose's included.
const GATE: f64 = 4.0;
/// Scale of the Cauchy weights, in standard deviations: of the first iteration, and of the others.
const CAUCHY: (f64, f64) = (4.0, 2.0);
/// A shorter step, rad and m, is the last one.
const LAST_STEP: (f64, f64) = (5e-5, 3e-4);
/// With fewer matches a sweep says nothing.
const MIN_MATCHES: usize = 40;

/// Features with the predicted poses at their times.
pub(crate) struct Seen<'a> {
    pub planar: &'a [(Feature, Moment)],
    pub edges: &'a [(Feature, Moment)],
    pub turning: Turning,
}

/// How the update goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rules {
    pub max_iterations: usize,
    /// Information of a feature relative to that of an independent one.
    pub independence: f64,
    /// Standard deviation of what the stamps of a sweep are wrong by in common, s; 0 for nothing.
    pub stamp_jitter: f64,
}

/// What an update found.
#[derive(Clone, Debug, Default)]
pub struct Fit {
    /// Features with a plane or a line.
    pub n_matches: usize,
    /// Of these, with a line.
    pub n_lines: usize,
    /// Share of the matches within two standard deviations.
    pub inlier_share: f64,
    /// Weighted root mean square of the residuals in standard deviations.
    pub residual_rms: f64,
    /// The same in m.
    pub rmse: f64,
    /// Solutions.
    pub iterations: usize,
    /// Whether the last step was short.
    pub converged: bool,
    /// Information about the translation, and about the rotation.
    pub translation: Matrix3<f64>,
    /// The same about the rotation.
    pub rotation: Matrix3<f64>,
    /// When the matched planes were seen first.
    pub(crate) births: Vec<u32>,
}

impl Fit {
    /// Eigenvalues of both as shares of their sum, increasing.
    pub fn shares(&self) -> [[f64; 3]; 2] {
        [self.translation, self.rotation]
            .map(|m| sym3::eigen(&(m / m.trace().max(f64::MIN_POSITIVE))).values)
    }
}

#[derive(Clone, Debug)]
struct Sums {
    information: SMatrix<f64, SEEN, SEEN>,
    gradient: Row,
    n: usize,
    n_lines: usize,
    n_inliers: usize,
    weight: f64,
    normalized: f64,
    squared: f64,
    births: Vec<u32>,
}

impl Sums {
    fn new() -> Self {
        Self {
            information: SMatrix::zeros(),
            gradient: Row::zeros(),
            n: 0,
            n_lines: 0,
            n_inliers: 0,
            weight: 0.0,
            normalized: 0.0,
            squared: 0.0,
            births: Vec::new(),
        }
    }

    /// Adds a residual `e` of variance `s2` with the derivative `h`.
    fn add(&mut self, h: &Row, e: f64, s2: f64, cauchy: f64) {
        let m2 = e * e / s2;
        let w = 1.0 / (1.0 + m2 / (cauchy * cauchy));
        let scaled = h * (w / s2);
        for j in 0..SEEN {
            let g = scaled[j];
            let mut column = self.information.column_mut(j);
            for i in j..SEEN {
                column[i] += h[i] * g;
            }
        }
        self.gradient += scaled * e;
        self.n_inliers += usize::from(m2 < 4.0);
        self.weight += w;
        self.normalized += w * m2;
        self.squared += w * e * e;
    }

    /// Information and gradient of the whole state.
    fn spread(&self) -> (Square, Tangent) {
        let (mut information, mut gradient) = (Square::zeros(), Tangent::zeros());
        for j in 0..SEEN {
            gradient[column(j)] = self.gradient[j];
            for i in j..SEEN {
                information[(column(i), column(j))] = self.information[(i, j)];
                information[(column(j), column(i))] = self.information[(i, j)];
            }
        }
        (information, gradient)
    }
}

/// Updates the state and its covariance; None where too little matches, and then they are as before.
pub(crate) fn update(
    state: &mut State,
    P: &mut Square,
    map: &LocalMap,
    seen: &Seen<'_>,
    rules: &Rules,
) -> Option<Fit> {
    let predicted = *state;
    let mut x = predicted;
    let mut error = Tangent::zeros();
    let doubt = doubt(P);
    let mut last: Option<(Square, Sums)> = None;
    let (mut iterations, mut converged) = (0, false);
    while iterations < rules.max_iterations && !converged {
        let cauchy = if iterations == 0 { CAUCHY.0 } else { CAUCHY.1 };
        let slack = if iterations == 0 { doubt } else { (0.0, 0.0) };
        let sums = sums(&x, &error, map, seen, cauchy, slack);
        if sums.n < MIN_MATCHES {
            return None;
        }
        let (information, gradient) = sums.spread();
        let (information, gradient) = without_jitter(
            &(information * rules.independence),
            &(gradient * rules.independence),
            rules.stamp_jitter,
        );
        // Where the prediction is, seen from here: P belongs to the tangent space there.
        let back = gain::transport(&error);
        let behind = back * error;
        let posterior = gain::posterior(&(back * *P * back.transpose()), &information)?;
        let step = posterior * (information * behind - gradient) - behind;
        x = x.plus(&step);
        error = x.minus(&predicted);
        iterations += 1;
        converged = step.fixed_rows::<3>(at::ROTATION).norm() < LAST_STEP.0
            && step.fixed_rows::<3>(at::POSITION).norm() < LAST_STEP.1;
        last = Some((posterior, sums));
    }
    let (posterior, sums) = last?;
    if !x.is_finite() {
        return None;
    }
    (*state, *P) = (x, posterior);
    Some(fit(sums, iterations, converged))
}

/// Takes out of a sweep's information what its stamps alone can explain.
///
/// Stamps that are late by j let the latency and the encoder's delay of this one sweep seem j longer:
/// with `c = Λ (u_latency + u_delay)` and the prior `1/σ²` of j, what is left when j is eliminated is
/// `Λ − c cᵀ / (uᵀ c + 1/σ²)`. Without it the jitter of each sweep turns the heading for good.
fn without_jitter(information: &Square, gradient: &Tangent, sigma: f64) -> (Square, Tangent) {
    if sigma <= 0.0 {
        return (*information, *gradient);
    }
    let both = [at::LATENCY, at::ENCODER_DELAY];
    let c: Tangent = information.column(at::LATENCY) + information.column(at::ENCODER_DELAY);
    let pull: f64 = both.iter().map(|&i| gradient[i]).sum();
    let total = both.iter().map(|&i| c[i]).sum::<f64>() + 1.0 / (sigma * sigma);
    (
        information - c * c.transpose() / total,
        gradient - c * (pull / total),
    )
}

fn fit(sums: Sums, iterations: usize, converged: bool) -> Fit {
    let even = |m: Matrix3<f64>| {
        let lower = m.lower_triangle();
        lower + lower.transpose() - Matrix3::from_diagonal(&m.diagonal())
    };
    let weight = sums.weight.max(f64::MIN_POSITIVE);
    Fit {
        n_matches: sums.n,
        n_lines: sums.n_lines,
        inlier_share: sums.n_inliers as f64 / sums.n.max(1) as f64,
        residual_rms: (sums.normalized / weight).sqrt(),
        rmse: (sums.squared / weight).sqrt(),
        iterations,
        converged,
        rotation: even(sums.information.fixed_view::<3, 3>(0, 0).into_owned()),
        translation: even(sums.information.fixed_view::<3, 3>(3, 3).into_owned()),
        births: sums.births,
    }
}

/// Standard deviations of the predicted attitude and position, largest axis.
fn doubt(P: &Square) -> (f64, f64) {
    let largest = |i: usize| (i..i + 3).map(|k| P[(k, k)]).fold(0.0, f64::max).sqrt();
    (largest(at::ROTATION), largest(at::POSITION))
}

fn sums(
    state: &State,
    error: &Tangent,
    map: &LocalMap,
    seen: &Seen<'_>,
    cauchy: f64,
    (turn, shift): (f64, f64),
) -> Sums {
    let mounts = Mounts::of(state);
    let mut sums = Sums::new();
    for (feature, moment) in seen.planar {
        let placed = measure::place(feature, moment, &seen.turning, (state, &mounts), error);
        let Some((plane, birth)) = map.plane(&placed.x) else {
            continue;
        };
        let e = plane.normal.dot(&(placed.x - plane.mean));
        let s2 = feature.variance.max(plane.across) + plane.height_variance(&placed.x);
        let gate = GATE * (s2.sqrt() + shift + turn * feature.p.norm());
        if e.abs() > gate {
            continue;
        }
        sums.n += 1;
        sums.births.push(*birth);
        sums.add(&placed.row(&plane.normal), e, s2, cauchy);
    }
    for (feature, moment) in seen.edges {
        let placed = measure::place(feature, moment, &seen.turning, (state, &mounts), error);
        let Some(line) = map.line(&placed.x) else {
            continue;
        };
        let off: Vector3<f64> = placed.x - line.mean;
        let s2 = feature.variance + line.across;
        let across = so3::orthogonal_pair(&line.direction);
        let gate = GATE * (s2.sqrt() + shift + turn * feature.p.norm());
        if across.iter().any(|n| n.dot(&off).abs() > gate) {
            continue;
        }
        sums.n += 1;
        sums.n_lines += 1;
        for n in across {
            // Both directions are of one feature: it is one inlier at most.
            sums.add(&placed.row(&n), n.dot(&off), s2, cauchy);
        }
        sums.n_inliers -= usize::from(across.iter().all(|n| n.dot(&off).powi(2) < 4.0 * s2));
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::DIM;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn jitter_is_eliminated_like_a_state_of_its_own(
            rows in prop::collection::vec(-1.0..1.0_f64, DIM * 40),
            errors in prop::collection::vec(-1.0..1.0_f64, 40),
        ) {
            let sigma = 0.3;
            let H = nalgebra::SMatrix::<f64, 40, DIM>::from_column_slice(&rows);
            let e = nalgebra::SVector::<f64, 40>::from_column_slice(&errors);
            let h = H.column(at::LATENCY) + H.column(at::ENCODER_DELAY);
            // The residuals' covariance with the jitter in it.
            let S = nalgebra::SMatrix::<f64, 40, 40>::identity() + h * h.transpose() * (sigma * sigma);
            let Some(W) = S.try_inverse() else { return Err(TestCaseError::reject("singular")) };
            let (information, gradient) =
                without_jitter(&(H.transpose() * H), &(H.transpose() * e), sigma);
            prop_assert!((information - H.transpose() * W * H).norm() < 1e-8);
            prop_assert!((gradient - H.transpose() * W * e).norm() < 1e-8);
        }
    }

    #[test]
    fn stamps_that_are_exact_leave_all_information() {
        let information = Square::identity();
        let gradient = Tangent::repeat(1.0);
        assert_eq!(
            without_jitter(&information, &gradient, 0.0),
            (information, gradient)
        );
    }
}
