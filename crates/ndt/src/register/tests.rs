// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scans of a room from known poses.

use nalgebra::Vector3;
use proptest::prelude::*;

use super::*;
use crate::score::tests::{pose, room, seen_from};
use crate::{Reference, Shape};

fn expected(pose: Isometry3<f64>) -> Expectation {
    Expectation {
        pose,
        rotation_sigma: 0.05,
        translation_sigma: 0.5,
        independence: 0.1,
    }
}

fn error(found: &Isometry3<f64>, truth: &Isometry3<f64>) -> (f64, f64) {
    let turn = so3::log(&(found.rotation * truth.rotation.inverse()));
    (
        turn.norm(),
        (found.translation.vector - truth.translation.vector).norm(),
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// From 0.3 m and 1.5° away, at any attitude of the sensor.
    #[test]
    fn a_scan_finds_its_place(
        r in prop::array::uniform3(-1.8..1.8_f64), t in prop::array::uniform3(2.0..8.0_f64),
        off in prop::array::uniform3(-0.015..0.015_f64), shift in prop::array::uniform3(-0.17..0.17_f64),
    ) {
        let (reference, points) = room();
        let truth = pose(r, t);
        let scan = seen_from(&points, &truth, 11);
        let turned = so3::exp(&Vector3::from(off)) * truth.rotation;
        let moved = truth.translation.vector + Vector3::from(shift);
        let start = Isometry3::from_parts(Translation3::from(moved), turned);
        let found = register(&reference, &scan, &expected(start), true);
        prop_assert!(found.is_ok(), "{found:?}");
        if let Ok(found) = found {
            let (angle, distance) = error(&found.pose, &truth);
            prop_assert!(angle < 1e-3 && distance < 5e-3, "{angle} rad, {distance} m");
            prop_assert!(found.converged);
            prop_assert!(found.inlier_share > 0.8);
        }
    }
}

#[test]
fn what_no_wall_shows_stays_as_expected() -> Result<(), NdtError> {
    let plane: Vec<[f64; 3]> = (0..10_000)
        .map(|i| [f64::from(i % 100) * 0.1, f64::from(i / 100) * 0.1, 0.5])
        .collect();
    let shape = Shape {
        sigma: 0.02,
        roughness: 0.03,
    };
    let mut reference = Reference::new(1.0, 3, shape);
    let lidar = Vector3::new(5.0, 5.0, 5.0);
    reference.insert(&plane, &Isometry3::identity(), &lidar);
    let start = pose([0.0; 3], [0.07, -0.05, 0.04]);
    let scan: Vec<[f64; 3]> = (plane.iter().step_by(3))
        .filter(|p| p[0] > 2.0 && p[0] < 7.0)
        .copied()
        .collect();
    let found = register(&reference, &scan, &expected(start), true)?;
    let t = found.pose.translation.vector;
    assert!(
        (t.x - 0.07).abs() < 1e-3 && (t.y + 0.05).abs() < 1e-3,
        "{t}"
    );
    assert!(t.z.abs() < 1e-3);
    let shown = found.translation.symmetric_eigenvalues();
    assert!(shown.min() < 1e-6 * shown.max());
    Ok(())
}

#[test]
fn a_scan_elsewhere_is_refused() {
    let (reference, points) = room();
    let start = pose([0.0; 3], [100.0, 0.0, 0.0]);
    let found = register(&reference, &points, &expected(start), true);
    assert_eq!(
        found.err(),
        Some(NdtError::TooFewMatches {
            matched: 0,
            points: points.len(),
            least: MIN_MATCHES
        })
    );
}

#[test]
fn a_pose_that_is_not_finite_is_an_error() {
    let (reference, points) = room();
    let mut start = expected(pose([0.0; 3], [0.0; 3]));
    start.rotation_sigma = 0.0;
    let found = register(&reference, &points, &start, false);
    assert_eq!(found.err(), Some(NdtError::NotFinite));
}

#[test]
fn what_is_far_away_is_forgotten() {
    let (mut reference, points) = room();
    let before = reference.n_surfaces();
    reference.keep_within(&Vector3::zeros(), 1e3);
    assert_eq!(reference.n_surfaces(), before);
    reference.keep_within(&Vector3::zeros(), 6.0);
    assert!(reference.n_surfaces() < before && reference.n_surfaces() > 0);
    let scan = seen_from(&points, &pose([0.0; 3], [0.0; 3]), 11);
    assert!(
        register(
            &reference,
            &scan,
            &expected(pose([0.0; 3], [0.0; 3])),
            false
        )
        .is_ok()
    );
}
