// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings of a registration; their defaults live in the Python package.

use bentwing_trajectory::Trajectory;

use crate::SolveError;
use crate::neighbors::Search;

/// How far a finite difference may reach, in knot intervals: less than one by more than rounding.
const LONGEST_REACH: f64 = 0.999;

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

    /// Refuses samples whose second differences reach over more than one knot: a row has places for
    /// the control points of two neighbouring intervals only.
    pub(crate) fn require_dense(&self, trajectory: &Trajectory) -> Result<(), SolveError> {
        let (dt, knot_interval) = (trajectory.dt(), self.knot_interval);
        // Not the opposite of what fits, so that NaN is refused too.
        if 2.0 * dt < LONGEST_REACH * knot_interval {
            return Ok(());
        }
        Err(SolveError::Sparse { dt, knot_interval })
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

#[cfg(test)]
mod tests {
    use bentwing_trajectory::so3;
    use nalgebra::Vector3;

    use super::*;
    use crate::constraints::testing::settings;

    #[test]
    fn samples_that_a_row_cannot_hold_are_refused_with_both_intervals() {
        let every = |dt| {
            let rotations = vec![so3::exp(&Vector3::zeros()); 3];
            Trajectory::new(0.0, dt, vec![Vector3::zeros(); 3], rotations).unwrap()
        };
        let with = |knot_interval| Settings {
            knot_interval,
            ..settings()
        };
        assert_eq!(with(0.2).require_dense(&every(0.099)), Ok(()));
        for (dt, knot_interval) in [(0.1, 0.2), (0.25, 0.2), (1e4, 0.2), (0.01, 0.02)] {
            let refused = Err(SolveError::Sparse { dt, knot_interval });
            assert_eq!(with(knot_interval).require_dense(&every(dt)), refused);
        }
        assert!(with(f64::NAN).require_dense(&every(0.01)).is_err());
    }
}
