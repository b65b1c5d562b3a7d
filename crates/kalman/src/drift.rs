// SPDX-License-Identifier: MIT OR Apache-2.0
//! How far the map around the sensor may have drifted from where it began.
//!
//! The map takes part in the update as if it were exact, so that the filter's covariance P is that of
//! the pose in the map around it. A plane that is seen for the first time comes to lie where the pose
//! is wrong by, with the covariance `D + P`, D being that of the map it was placed by. The map around
//! the sensor is as wrong as the planes that a sweep matches are on average. So D grows with each
//! generation of planes on the way, and is small again back where they were seen first.

use bentwing_trajectory::so3;
use nalgebra::{Matrix6, Vector3};

/// Sweeps whose new planes share an entry of the table.
const SHARING: u64 = 5;

/// Covariances (6 × 6, rotation first, about the map's origin) of planes by when they were first seen.
#[derive(Clone, Debug, Default)]
pub(crate) struct Drift {
    table: Vec<Matrix6<f64>>,
    n_sweeps: u64,
    now: Matrix6<f64>,
}

impl Drift {
    /// What planes that are seen for the first time now remember.
    pub(crate) fn birth(&self) -> u32 {
        (self.n_sweeps / SHARING) as u32
    }

    /// Follows a sweep: the births of the planes it matched, where the motor or the fixed lidar is, and
    /// the covariance of its pose in the map.
    pub(crate) fn add(&mut self, matched: &[u32], pose: &Matrix6<f64>, at: &Vector3<f64>) {
        if !matched.is_empty() {
            let known = |b: &u32| self.table.get(*b as usize).copied().unwrap_or_default();
            self.now = matched.iter().map(known).sum::<Matrix6<f64>>() / matched.len() as f64;
        }
        if self.birth() as usize >= self.table.len() {
            let to_origin = lever(at);
            self.table
                .push(self.now + to_origin * pose * to_origin.transpose());
        }
        self.n_sweeps += 1;
    }

    /// Covariance of the map around a sensor at `at`.
    pub(crate) fn covariance(&self, at: &Vector3<f64>) -> Matrix6<f64> {
        let from_origin = lever(&-at);
        from_origin * self.now * from_origin.transpose()
    }
}

/// What errors of attitude and position at `at` are at the origin: `δt − δr × at`.
fn lever(at: &Vector3<f64>) -> Matrix6<f64> {
    let mut lever = Matrix6::identity();
    lever.fixed_view_mut::<3, 3>(3, 0).copy_from(&so3::hat(at));
    lever
}

#[cfg(test)]
mod tests {
    use super::*;

    fn yaw() -> Matrix6<f64> {
        let mut pose = Matrix6::zeros();
        pose[(2, 2)] = 1e-6;
        pose
    }

    #[test]
    fn planes_on_the_way_are_as_wrong_as_all_before_them() {
        let mut drift = Drift::default();
        let here = Vector3::zeros();
        for generation in 0..4_u32 {
            let seen = if generation == 0 {
                vec![]
            } else {
                vec![generation - 1]
            };
            for _ in 0..SHARING {
                drift.add(&seen, &yaw(), &here);
            }
            assert!((drift.covariance(&here)[(2, 2)] - 1e-6 * f64::from(generation)).abs() < 1e-12);
        }
        drift.add(&[0, 0], &yaw(), &here);
        assert!((drift.covariance(&here)[(2, 2)] - 1e-6).abs() < 1e-12);
    }

    #[test]
    fn a_turned_map_is_shifted_away_from_where_it_was_turned() {
        let mut drift = Drift::default();
        let here = Vector3::new(3.0, 1.0, 0.0);
        drift.add(&[], &yaw(), &here);
        drift.add(&[0], &yaw(), &here);
        assert!(drift.covariance(&here)[(4, 4)] < 1e-15);
        let there = drift.covariance(&(here + Vector3::new(10.0, 0.0, 0.0)));
        assert!((there[(4, 4)] - 1e-4).abs() < 1e-10);
    }
}
