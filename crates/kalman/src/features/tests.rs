// SPDX-License-Identifier: MIT OR Apache-2.0
use super::*;

/// A ring of a level lidar in a square room of half width 5 m, with a pillar of 1 m before a wall.
fn room_ring(n: usize) -> Vec<[f64; 3]> {
    (0..n)
        .map(|k| {
            let azimuth = std::f64::consts::TAU * k as f64 / n as f64;
            let (s, c) = azimuth.sin_cos();
            let wall = 5.0 / s.abs().max(c.abs());
            let range = if (azimuth - 0.3).abs() < 0.2 {
                2.5 / c
            } else {
                wall
            };
            [range * c, range * s, 0.0]
        })
        .collect()
}

fn sweep<'a>(points: &'a [[f64; 3]], times: &'a [f64], rings: &'a [u16]) -> Sweep<'a> {
    Sweep {
        points,
        times,
        rings,
        angles: &[],
    }
}

#[test]
fn planar_features_lie_on_the_walls_and_edges_at_the_pillar() {
    let points = room_ring(1800);
    let times: Vec<f64> = (0..1800).map(|k| f64::from(k) * 55e-6).collect();
    let found = features(&sweep(&points, &times, &[0; 1800]), 0.02);
    assert!(found.planar.len() > 150);
    for f in &found.planar {
        let off_wall = (f.p.x.abs().max(f.p.y.abs()) - 5.0).abs();
        let off_pillar = (f.p.x - 2.5).abs();
        assert!(off_wall.min(off_pillar) < 0.03, "{}", f.p);
        assert!(f.variance < 0.02_f64.powi(2) / 2.0);
    }
    assert_eq!(found.edges.len(), 2);
    for f in &found.edges {
        assert!((f.p.x - 2.5).abs() < 1e-9 && ((f.p.y / f.p.x).atan() - 0.3).abs() > 0.19);
    }
}

#[test]
fn clutter_has_no_planar_features() {
    let points: Vec<[f64; 3]> = (0..600)
        .map(|k| {
            let (s, c) = (f64::from(k) * 0.0035).sin_cos();
            let range = 5.0 + 0.1 * f64::from(k * k * 5 % 29 - 14) / 14.0;
            [range * c, range * s, 0.0]
        })
        .collect();
    let times: Vec<f64> = (0..600).map(|k| f64::from(k) * 55e-6).collect();
    let found = features(&sweep(&points, &times, &[3; 600]), 0.02);
    assert!(found.planar.len() < 5, "{}", found.planar.len());
}

#[test]
fn a_pause_and_a_ring_of_two_points_are_no_run() {
    let points = [
        [5.0, 0.0, 0.0],
        [5.0, 0.02, 0.0],
        [5.0, 0.04, 0.0],
        [5.0, 0.0, 1.0],
        [5.0, 0.02, 1.0],
    ];
    let times = [0.0, 1e-4, 0.05, 0.05, 0.0501];
    let found = features(&sweep(&points, &times, &[0, 0, 0, 1, 1]), 0.02);
    assert!(found.planar.is_empty() && found.edges.is_empty());
}

#[test]
fn without_rings_every_point_counts() {
    let points = room_ring(100);
    let times = vec![0.0; 100];
    let found = features(&sweep(&points, &times, &[]), 0.02);
    assert_eq!(found.planar.len(), 100);
    assert!((found.planar[7].variance - 4e-4).abs() < 1e-15);
}
