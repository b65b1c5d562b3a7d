// SPDX-License-Identifier: MIT OR Apache-2.0
//! How far the local map may have drifted from where it began.
//!
//! The map takes part in the update as if it were exact, so that the filter's covariance is that of
//! the pose in the map around it. But of each sweep a share α shows new surfaces, which come to lie
//! where the pose of the sweep is wrong by, and later poses follow: the error of the map walks by
//! `α e` a sweep, e being that of the pose in the map. Sweeps in a row err alike, so that over many
//! the variance grows by `κ α² P` each, κ counting the sweeps within the memory of e.

use bentwing_trajectory::so3;
use nalgebra::{Matrix6, Vector3};

/// Sweeps that err alike: κ.
const ALIKE: f64 = 10.0;

/// Covariance (6 × 6) of the map's place: rotation about the sensor, and translation.
#[derive(Clone, Debug, Default)]
pub(crate) struct Drift {
    covariance: Matrix6<f64>,
}

impl Drift {
    /// Follows a sweep that has moved the sensor by `moved`, m, with the pose's covariance `pose` in
    /// the map, a share `new` of which is new.
    pub(crate) fn add(&mut self, moved: &Vector3<f64>, pose: &Matrix6<f64>, new: f64) {
        // A map that is turned leads the sensor astray as it moves.
        let mut lever = Matrix6::identity();
        lever
            .fixed_view_mut::<3, 3>(3, 0)
            .copy_from(&-so3::hat(moved));
        self.covariance = lever * self.covariance * lever.transpose() + pose * (ALIKE * new * new);
    }

    /// The covariance.
    pub(crate) fn covariance(&self) -> &Matrix6<f64> {
        &self.covariance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_map_leads_astray_across_the_motion() {
        let mut drift = Drift::default();
        let mut pose = Matrix6::zeros();
        pose[(2, 2)] = 1e-6;
        drift.add(&Vector3::zeros(), &pose, 1.0);
        drift.add(&Vector3::new(10.0, 0.0, 0.0), &pose, 0.0);
        let c = drift.covariance();
        assert!((c[(2, 2)] - ALIKE * 1e-6).abs() < 1e-18);
        assert!((c[(4, 4)] - 100.0 * ALIKE * 1e-6).abs() < 1e-15);
        assert_eq!((c[(3, 3)], c[(5, 5)]), (0.0, 0.0));
    }

    #[test]
    fn what_is_known_already_adds_nothing() {
        let mut drift = Drift::default();
        drift.add(&Vector3::x(), &Matrix6::identity(), 0.0);
        assert_eq!(drift.covariance().norm(), 0.0);
    }
}
