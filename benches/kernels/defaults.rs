// SPDX-License-Identifier: MIT OR Apache-2.0
//! The settings that ship, as `defaults.json` has them; a test of the Python package compares the file
//! with its models.

use bentwing_registration::{ImuNoise, Settings as Registration};
use bentwing_surfels::Settings as Surfels;
use serde_json::Value;

/// A group of settings by their names.
struct Section(Value);

impl Section {
    fn of(name: &str) -> Self {
        let mut all: Value = serde_json::from_str(include_str!("defaults.json")).expect("JSON");
        Self(all[name].take())
    }

    fn number(&self, name: &str) -> f64 {
        self.0[name].as_f64().expect(name)
    }

    fn count(&self, name: &str) -> usize {
        self.0[name].as_u64().expect(name) as usize
    }
}

/// Of the registration, for ranges with this standard deviation, m.
///
/// # Panics
/// When `defaults.json` lacks one.
pub fn registration(range_sigma: f64) -> Registration {
    let s = Section::of("registration");
    Registration {
        knot_interval: s.number("knot_interval"),
        range_sigma,
        n_neighbors: s.count("n_neighbors"),
        max_match_distance: s.number("max_match_distance"),
        min_match_gap: s.number("min_match_gap"),
        first_cauchy_scale: s.number("first_cauchy_scale"),
        cauchy_scale: s.number("cauchy_scale"),
        max_outer: s.count("max_outer"),
        n_inner: s.count("n_inner"),
        min_translation: s.number("min_translation"),
        min_rotation: s.number("min_rotation"),
        velocity_sigma: s.number("velocity_sigma"),
        rate_sigma: s.number("rate_sigma"),
        imu_noise: ImuNoise {
            gyro: s.number("gyro_sigma"),
            accel: s.number("accel_sigma"),
        },
        motion_accel_density: s.number("motion_accel_density"),
        motion_angular_density: s.number("motion_angular_density"),
    }
}

/// Of the surfels, for ranges with this standard deviation, m.
///
/// # Panics
/// When `defaults.json` lacks one.
pub fn surfels(range_sigma: f64) -> Surfels {
    let s = Section::of("surfels");
    Surfels {
        voxel_size: s.number("voxel_size"),
        n_levels: s.count("n_levels"),
        max_gap: s.number("max_gap"),
        max_span: s.number("max_span"),
        min_points: s.count("min_points") as u32,
        min_planarity: s.number("min_planarity"),
        min_width_ratio: s.number("min_width_ratio"),
        min_width: s.number("min_width"),
        min_incidence_cosine: s.number("min_incidence_cosine"),
        max_rate: s.number("max_rate"),
        range_sigma,
    }
}
