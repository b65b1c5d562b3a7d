// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings of a registration; their defaults live in the Python package.

use crate::neighbors::Search;

/// Noise of one inertial sample of the trajectory's rate: density × √rate.
#[derive(Clone, Copy, Debug)]
pub struct ImuNoise {
    /// rad/s.
    pub gyro: f64,
    /// m/s².
    pub accel: f64,
}

/// Settings of a registration.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Interval of the correction spline's knots, s.
    pub knot_interval: f64,
    /// Standard deviation of a range, m (`σ_r` in Kaul 2015, eq. 6).
    pub range_sigma: f64,
    /// Neighbours kept for each surfel before the mutual test.
    pub n_neighbors: usize,
    /// Largest distance of matches in feature space.
    pub max_match_distance: f64,
    /// Least difference in time of matches, s.
    pub min_match_gap: f64,
    /// Scale of the Cauchy weight in the first outer iteration, in standard deviations.
    pub first_cauchy_scale: f64,
    /// Scale of the Cauchy weight afterwards.
    pub cauchy_scale: f64,
    /// Most outer iterations (placing, matching, linearizing).
    pub max_outer: usize,
    /// Inner iterations (weighing, solving) in each outer one.
    pub n_inner: usize,
    /// An outer iteration that moves no sample by more than this, m, is the last.
    pub min_translation: f64,
    /// An outer iteration that turns no sample by more than this, rad, is the last.
    pub min_rotation: f64,
    /// Deviation of the velocity from the prior's, m/s.
    pub velocity_sigma: f64,
    /// Deviation of the angular rate from the prior's, rad/s.
    pub rate_sigma: f64,
    /// Noise of the inertial samples; ignored without an IMU.
    pub imu_noise: ImuNoise,
    /// Density of the acceleration that is expected without an IMU, m/s²/√Hz.
    pub motion_accel_density: f64,
    /// Density of the angular acceleration that is expected without an IMU, rad/s²/√Hz.
    pub motion_angular_density: f64,
}

impl Settings {
    /// The search for matches.
    pub fn search(&self) -> Search {
        Search {
            k: self.n_neighbors,
            max_distance: self.max_match_distance as f32,
            min_time_gap: self.min_match_gap as f32,
        }
    }

    /// Scale of the Cauchy weight in an outer iteration.
    pub(crate) fn cauchy_scale_at(&self, n_outer: usize) -> f64 {
        if n_outer == 0 {
            self.first_cauchy_scale
        } else {
            self.cauchy_scale
        }
    }
}
