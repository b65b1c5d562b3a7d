// SPDX-License-Identifier: MIT OR Apache-2.0
use super::*;
use proptest::prelude::*;

/// First hit by testing every triangle (Möller and Trumbore 1997).
fn brute_force_cast(vertices: &[[f64; 3]], triangles: &[[u32; 3]], o: Vector, d: Vector) -> f64 {
    let corner = |i: u32| vector(vertices[i as usize]);
    let mut nearest = f64::INFINITY;
    for &[a, b, c] in triangles {
        let (e1, e2) = (corner(b) - corner(a), corner(c) - corner(a));
        let p = d.cross(e2);
        let s = o - corner(a);
        let q = s.cross(e1);
        let det = e1.dot(p);
        let (u, v, t) = (s.dot(p) / det, d.dot(q) / det, e2.dot(q) / det);
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0 {
            nearest = nearest.min(t);
        }
    }
    nearest
}

fn distance_to_segment(p: Vector, a: Vector, b: Vector) -> f64 {
    let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    (p - (a + (b - a) * t)).length()
}

/// Distance to a triangle: over its face if the foot of the perpendicular is inside it, else to
/// the nearest edge.
fn distance_to_triangle(p: Vector, [a, b, c]: [Vector; 3]) -> f64 {
    let n = (b - a).cross(c - a);
    let inside = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|&(from, to)| n.cross(to - from).dot(p - from) >= 0.0);
    if inside {
        return (p - a).dot(n).abs() / n.length();
    }
    distance_to_segment(p, a, b)
        .min(distance_to_segment(p, b, c))
        .min(distance_to_segment(p, c, a))
}

fn point() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-10.0..10.0)
}

/// Triangles that share no corner, none of them a sliver.
fn soup() -> impl Strategy<Value = (Vec<[f64; 3]>, Vec<[u32; 3]>)> {
    prop::collection::vec(prop::array::uniform3(point()), 1..60).prop_filter_map(
        "slivers",
        |corners| {
            let fat = corners.iter().all(|t| {
                let [a, b, c] = t.map(vector);
                (b - a).cross(c - a).length() > 0.1
            });
            let n = corners.len() as u32;
            let triangles = (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            fat.then(|| (corners.concat(), triangles))
        },
    )
}

proptest! {
    #[test]
    fn a_ray_hits_what_testing_every_triangle_hits(
        (vertices, triangles) in soup(), origin in point(), target in point(),
    ) {
        let direction = vector(target) - vector(origin);
        prop_assume!(direction.length() > 1e-3);
        let direction = direction / direction.length();
        let expected = brute_force_cast(&vertices, &triangles, vector(origin), direction);
        let scene = Scene::new(&vertices, triangles).unwrap();
        let (ranges, ids) = scene.cast(&[origin], &[direction.into()], 1e3);
        prop_assert_eq!(ranges[0].is_finite(), expected.is_finite());
        if expected.is_finite() {
            prop_assert!((ranges[0] - expected).abs() < 1e-9, "{} {}", ranges[0], expected);
            prop_assert!(ids[0] >= 0);
        }
    }

    #[test]
    fn the_nearest_surface_is_the_nearest_of_all_triangles(
        (vertices, triangles) in soup(), query in point(),
    ) {
        let expected = triangles
            .iter()
            .map(|t| distance_to_triangle(vector(query), t.map(|i| vector(vertices[i as usize]))))
            .fold(f64::INFINITY, f64::min);
        let scene = Scene::new(&vertices, triangles).unwrap();
        let (distances, _) = scene.distance(&[query]);
        prop_assert!((distances[0].abs() - expected).abs() < 1e-9);
    }
}

fn unit_floor() -> Scene {
    let vertices = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    Scene::new(&vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}

#[test]
fn the_side_of_the_surface_is_the_sign_of_the_distance() {
    let (distances, triangles) = unit_floor().distance(&[[0.7, 0.2, 0.5], [0.2, 0.7, -0.25]]);
    assert_eq!(distances, [0.5, -0.25]);
    assert_eq!(triangles, [0, 1]);
}

#[test]
fn a_surface_beyond_the_maximum_range_is_not_seen() {
    let scene = unit_floor();
    let down = [[0.0, 0.0, -1.0]];
    assert_eq!(scene.cast(&[[0.7, 0.2, 5.0]], &down, 5.5).0, [5.0]);
    let (ranges, triangles) = scene.cast(&[[0.7, 0.2, 5.0]], &down, 4.5);
    assert!(ranges[0].is_infinite());
    assert_eq!(triangles, [NO_TRIANGLE]);
}

#[test]
fn both_sides_of_a_surface_are_hit() {
    assert_eq!(
        unit_floor()
            .cast(&[[0.7, 0.2, -2.0]], &[[0.0, 0.0, 1.0]], 10.0)
            .0,
        [2.0]
    );
}

#[test]
fn a_range_of_a_hundred_metres_is_exact() {
    let scene = unit_floor();
    let (ranges, _) = scene.cast(&[[0.5, 0.4, 123.456]], &[[0.0, 0.0, -1.0]], 200.0);
    assert!((ranges[0] - 123.456).abs() < 1e-9);
}

#[test]
fn the_number_of_threads_does_not_change_a_bit() {
    let scene = unit_floor();
    let origins: Vec<_> = (0..5000)
        .map(|i| {
            [
                0.3 + 1e-4 * f64::from(i % 70),
                0.4,
                1.0 + 1e-3 * f64::from(i),
            ]
        })
        .collect();
    let directions = vec![[0.01, 0.02, -1.0]; origins.len()];
    let run = |n_threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build()
            .unwrap();
        pool.install(|| {
            (
                scene.cast(&origins, &directions, 50.0),
                scene.distance(&origins),
            )
        })
    };
    let alone = run(1);
    assert_eq!(alone, run(2));
    assert_eq!(alone, run(4));
}

#[test]
fn what_is_wrong_with_a_scene_is_named() {
    let missing = Scene::new(&[[0.0; 3]; 3], vec![[0, 1, 2], [0, 1, 3]]).err();
    let expected = SceneError::VertexOutOfRange {
        triangle: 1,
        vertex: 3,
        n_vertices: 3,
    };
    assert_eq!(missing, Some(expected));
    assert_eq!(
        Scene::new(&[[0.0; 3]; 3], vec![]).err(),
        Some(SceneError::Empty)
    );
}
