// SPDX-License-Identifier: MIT OR Apache-2.0
//! How well the trajectory agrees with the IMU, in units of the noise that is stated for it.
//!
//! The trajectory begins as the integral of the samples and is corrected smoothly: residuals of single
//! samples are small and alike, whatever the noise. What the lidar can contradict are means over a
//! time that is long against the knots. Were the noise as stated and white, their residuals would
//! have the covariance `N − H`, N that of the means of such noise, H that of what the unknowns say
//! of them (studentized residuals).

use std::f64::consts::PI;

use bentwing_trajectory::{CorrectionSpline, Imu, Trajectory};
use faer::Mat;
use nalgebra::DMatrix;

use crate::constraints::imu::{self, SampleRows};
use crate::system::solve::Factorized;
use crate::{Globals, ImuNoise, N_GLOBALS, PoseResponse};

/// Time over which samples are averaged, s. With a smooth window nothing of the mean is faster than
/// the correction can follow, down to knots of 0.25 s; windows overlap by half.
const AVERAGED: f64 = 1.0;
/// Where less of the noise shows, the lidar does not say how large it is.
const LEAST_SHARE: f64 = 0.05;

/// How the residuals of a sensor compare with its stated noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Root mean square over what is expected: one where the noise is as stated.
    pub rms: f64,
    /// Correlation of neighbouring means beyond what is expected, averaged over the axes: zero where
    /// the noise is white, towards one where it is an error that lasts.
    pub correlation: f64,
}

/// Gyro and accelerometer apart; `None` where nothing can be said.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImuFit {
    /// Of the angular rate.
    pub gyro: Option<Fit>,
    /// Of the specific force.
    pub accel: Option<Fit>,
}

/// What the residuals are computed from: the result of a registration and its last equations.
pub(super) struct Solved<'a> {
    pub trajectory: &'a Trajectory,
    pub globals: &'a Globals,
    pub spline: &'a CorrectionSpline,
    pub factorized: &'a Factorized,
    pub ties: &'a [PoseResponse],
}

impl Solved<'_> {
    /// Compares the residuals with the noise.
    pub fn imu_fit(&self, samples: &Imu, noise: &ImuNoise) -> ImuFit {
        let (trajectory, globals, spline) = (self.trajectory, self.globals, self.spline);
        let gyro = |n| imu::gyro_rows(trajectory, samples, globals, spline, n);
        let accel = |n| imu::accel_rows(trajectory, samples, globals, spline, n);
        ImuFit {
            gyro: self.fit(gyro, noise.gyro),
            accel: self.fit(accel, noise.accel),
        }
    }

    fn fit(&self, rows: impl Fn(usize) -> Option<SampleRows>, sigma: f64) -> Option<Fit> {
        let weights = weights((AVERAGED / self.trajectory.dt()).round() as usize);
        let means = self.means(rows, &weights, sigma);
        let columns: Vec<&Vec<f64>> = means.iter().flat_map(|m| &m.rows).collect();
        let height = 6 * self.spline.n_controls() + N_GLOBALS;
        let rows = Mat::from_fn(height, columns.len(), |r, c| columns[c][r]);
        let known = self.factorized.covariance_of(&rows, self.ties);
        compare(&means, &weights, &known)
    }

    /// Means of the samples that are free to move, where the IMU knows all of them.
    fn means(
        &self,
        rows: impl Fn(usize) -> Option<SampleRows>,
        weights: &[f64],
        sigma: f64,
    ) -> Vec<Mean> {
        let first_control = |n: usize| self.spline.basis(self.trajectory.time(n)).first;
        let free = (1..self.trajectory.len() - 1).filter(|&n| first_control(n) >= self.ties.len());
        let said: Vec<Option<SampleRows>> = free.map(rows).collect();
        let mean = |(place, said): (usize, &[Option<SampleRows>])| {
            let mut mean = Mean::new(place, self.spline.n_controls());
            for (said, weight) in said.iter().zip(weights) {
                let said = said.as_ref().filter(|s| s.known == [true; 3])?;
                mean.add(said, weight / sigma);
            }
            Some(mean)
        };
        let stretches = said.windows(weights.len()).step_by(weights.len() / 2);
        stretches.enumerate().filter_map(mean).collect()
    }
}

/// A smooth window of `n` samples; the sum over white noise of unit size has unit size.
fn weights(n: usize) -> Vec<f64> {
    let sine = |k: usize| (PI * (k as f64 + 0.5) / n as f64).sin();
    let scale = (8.0 / (3.0 * n as f64)).sqrt();
    (0..n).map(|k| scale * sine(k).powi(2)).collect()
}

/// The mean over a stretch of time in units of its standard deviation: residual and rows by axis.
struct Mean {
    place: usize,
    residual: [f64; 3],
    rows: [Vec<f64>; 3],
}

impl Mean {
    fn new(place: usize, n_controls: usize) -> Self {
        Self {
            place,
            residual: [0.0; 3],
            rows: std::array::from_fn(|_| vec![0.0; 6 * n_controls + N_GLOBALS]),
        }
    }

    fn add(&mut self, said: &SampleRows, scale: f64) {
        for (axis, row) in self.rows.iter_mut().enumerate() {
            self.residual[axis] += scale * said.residual[axis];
            let n_knots = row.len() - N_GLOBALS;
            let (knots, globals) = row.split_at_mut(n_knots);
            let pairs = knots[6 * said.first..].iter_mut().zip(&said.knots[axis]);
            for (sum, entry) in pairs.chain(globals.iter_mut().zip(&said.globals[axis])) {
                *sum += scale * entry;
            }
        }
    }
}

/// Compares residuals with their covariance without what is `known` of them.
fn compare(means: &[Mean], weights: &[f64], known: &DMatrix<f64>) -> Option<Fit> {
    let overlap: f64 = weights
        .iter()
        .zip(&weights[weights.len() / 2..])
        .map(|(a, b)| a * b)
        .sum();
    let pairs: Vec<usize> = (1..means.len())
        .filter(|&b| means[b].place == means[b - 1].place + 1)
        .collect();
    let expected = |axis: usize, a: usize, b: usize| {
        let noise = if a == b { 1.0 } else { overlap };
        noise - known[(3 * a + axis, 3 * b + axis)]
    };
    let (mut squares, mut variances, mut correlation) = (0.0, 0.0, 0.0);
    for axis in 0..3 {
        let z = |b: usize| means[b].residual[axis];
        let square: f64 = (0..means.len()).map(|b| z(b) * z(b)).sum();
        let variance: f64 = (0..means.len())
            .map(|b| expected(axis, b, b).max(0.0))
            .sum();
        let product: f64 = pairs.iter().map(|&b| z(b) * z(b - 1)).sum();
        let covariance: f64 = pairs.iter().map(|&b| expected(axis, b, b - 1)).sum();
        squares += square;
        variances += variance;
        if square > 0.0 && variance > 0.0 {
            correlation += (product / square - covariance / variance) / 3.0;
        }
    }
    (variances > LEAST_SHARE * 3.0 * means.len() as f64).then(|| Fit {
        rms: (squares / variances).sqrt(),
        correlation,
    })
}

#[cfg(test)]
mod tests;
