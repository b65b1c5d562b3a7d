// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shapes of which the truth is known, measured with noise along the beams.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::f64::consts::{PI, TAU};

use bentwing_refinement::{N_WORDS, Refined, Sample, Settings, words_of};

const SETTINGS: Settings = Settings {
    edge: 0.05,
    n_levels: 4,
    enough: 80,
    fewest_passes: 5.0,
    most_noise: 0.03,
};
const PASS: f64 = 0.25;
const NOISE: f64 = 0.01;
const DURATION: f64 = 30.0;

type Point = [f64; 3];

/// Numbers that are the same on every machine.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    fn normal(&mut self) -> f64 {
        let (a, b) = (1.0 - self.uniform(), self.uniform());
        (-2.0 * a.ln()).sqrt() * (TAU * b).cos()
    }
}

/// A map of points with their beams.
#[derive(Default)]
struct Map {
    points: Vec<Point>,
    beams: Vec<[f32; 3]>,
    ranges: Vec<f32>,
    times: Vec<f64>,
}

impl Map {
    /// Measures a point of a surface from a place; `bias` is that of the pass.
    fn measure(&mut self, random: &mut Random, truth: Point, from: Point, time: f64, bias: f64) {
        let gap = [0, 1, 2].map(|a| truth[a] - from[a]);
        let range = gap.iter().map(|g| g * g).sum::<f64>().sqrt();
        let beam = gap.map(|g| g / range);
        let found = range + NOISE * random.normal() + bias;
        self.points
            .push([0, 1, 2].map(|a| from[a] + beam[a] * found));
        self.beams.push(beam.map(|b| b as f32));
        self.ranges.push(found as f32);
        self.times.push(time);
    }

    fn words(&self) -> Vec<[u32; N_WORDS]> {
        let sizes = (SETTINGS.edge, PASS);
        words_of(&self.points, &self.beams, &self.ranges, &self.times, sizes)
    }

    fn refine(&self) -> Refined {
        let mut sample = Sample::new(SETTINGS);
        let own = vec![true; self.points.len()];
        sample.add(&self.words(), &own);
        sample.refine(None).unwrap()
    }

    fn moved(&self) -> Vec<Point> {
        let moves = self.refine().moves;
        let at = |i: usize| {
            [0, 1, 2].map(|a| self.points[i][a] + f64::from(self.beams[i][a]) * f64::from(moves[i]))
        };
        (0..self.points.len()).map(at).collect()
    }
}

/// `n` points of a surface that `surface` draws, each seen from a place that `place` draws.
fn map_of(
    n: usize,
    surface: impl Fn(&mut Random) -> Point,
    place: impl Fn(&mut Random, &Point) -> Point,
) -> Map {
    let (mut map, mut random) = (Map::default(), Random(1));
    add(&mut map, &mut random, n, surface, place);
    map
}

fn add(
    map: &mut Map,
    random: &mut Random,
    n: usize,
    surface: impl Fn(&mut Random) -> Point,
    place: impl Fn(&mut Random, &Point) -> Point,
) {
    for _ in 0..n {
        let truth = surface(random);
        let from = place(random, &truth);
        let time = random.within(0.0, DURATION);
        map.measure(random, truth, from, time, 0.0);
    }
}

/// Two to four metres away on the positive side of z.
fn above(random: &mut Random, _: &Point) -> Point {
    [
        random.within(-1.5, 1.5),
        random.within(-1.5, 1.5),
        random.within(2.0, 4.0),
    ]
}

fn statistics(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    (
        mean,
        (values.map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt(),
    )
}

fn floor(random: &mut Random, half: f64) -> Point {
    [random.within(-half, half), random.within(-half, half), 0.0]
}

#[test]
fn the_points_of_a_plane_come_much_nearer_to_it_without_a_bias() {
    let map = map_of(12_000, |r| floor(r, 1.0), above);
    let (_, raw) = statistics(map.points.iter().map(|p| p[2]));
    let (mean, std) = statistics(
        map.moved()
            .iter()
            .map(|p| p[2])
            .collect::<Vec<_>>()
            .into_iter(),
    );
    assert!(std < 0.3 * raw, "{std} of {raw}");
    assert!(mean.abs() < 2e-4, "{mean}");
}

#[test]
fn the_stated_deviation_is_that_of_the_points() {
    let map = map_of(12_000, |r| floor(r, 1.0), above);
    let refined = map.refine();
    let moved = map.moved();
    let off = (0..moved.len())
        .map(|i| moved[i][2] / f64::from(map.beams[i][2]).abs() / f64::from(refined.sigmas[i]));
    let (_, std) = statistics(off.collect::<Vec<_>>().into_iter());
    assert!((0.4..1.6).contains(&std), "{std}");
}

#[test]
fn every_point_stays_on_its_beam() {
    let map = map_of(5_000, |r| floor(r, 1.0), above);
    let refined = map.refine();
    assert!(refined.moves.iter().any(|m| *m != 0.0));
    assert!(
        refined.moves.iter().all(|m| m.abs() <= 0.034),
        "three standard deviations"
    );
}

#[test]
fn the_step_of_20_mm_stays_and_its_sides_are_flat() {
    for height in [0.02, 0.03] {
        let map = map_of(
            20_000,
            |r| {
                let p = floor(r, 1.0);
                [p[0], p[1], if p[0] > 0.013 { height } else { 0.0 }]
            },
            above,
        );
        let moved = map.moved();
        let beside = |low: f64, high: f64| {
            let inside = moved.iter().filter(|p| (low..high).contains(&p[0]));
            statistics(inside.map(|p| p[2]).collect::<Vec<_>>().into_iter())
        };
        let ((low, _), (high, _)) = (beside(-0.06, 0.0), beside(0.026, 0.086));
        assert!((high - low) > 0.85 * height, "{low} {high}");
        let ((low, a), (high, b)) = (beside(-0.3, -0.1), beside(0.13, 0.3));
        assert!(
            (high - low - height).abs() < 1e-3 && a.max(b) < 0.005,
            "{low} {high} {a} {b}"
        );
    }
}

#[test]
fn a_step_of_twice_the_noise_stays_sharp() {
    let (edge, height) = (0.013, 0.02);
    let step = |r: &mut Random| {
        let p = floor(r, 1.0);
        [p[0], p[1], if p[0] > edge { height } else { 0.0 }]
    };
    let moved = map_of(20_000, step, above).moved();
    let mean = |side: f64| {
        let off = |p: &&Point| (0.003..0.015).contains(&(side * (p[0] - edge)));
        statistics(moved.iter().filter(off).map(|p| p[2])).0
    };
    assert!(mean(1.0) - mean(-1.0) > 0.75 * height);
}

/// Root mean square distance of what is nearer to a corner of two planes than 5 cm.
fn at_corner(points: &[Point], distance: impl Fn(&Point) -> f64) -> f64 {
    let near = points.iter().filter(|p| p[0].hypot(p[2]) < 0.05);
    let squares: Vec<f64> = near.map(|p| distance(p).powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn a_crease_stays_sharp_on_both_of_its_sides() {
    // A floor and a wall that stands on it, seen from the room and from outside of a corner.
    for convex in [false, true] {
        let side = if convex { -1.0 } else { 1.0 };
        let map = map_of(
            24_000,
            |r| {
                let (along, y) = (r.within(0.0, 1.0), r.within(-1.0, 1.0));
                if r.uniform() < 0.5 {
                    [side * along, y, 0.0]
                } else {
                    [0.0, y, side * along]
                }
            },
            |r, _| [r.within(1.0, 3.0), r.within(-1.0, 1.0), r.within(1.0, 3.0)],
        );
        let distance = |p: &Point| {
            if convex == (p[0].max(p[2]) < 0.0) || !convex {
                if convex {
                    p[0].max(p[2])
                } else {
                    p[0].abs().min(p[2].abs())
                }
            } else {
                p[0].max(p[2]).abs()
            }
        };
        let (before, after) = (
            at_corner(&map.points, distance),
            at_corner(&map.moved(), distance),
        );
        assert!(after < 0.7 * before, "convex {convex}: {after} of {before}");
        let far: Vec<f64> = map
            .moved()
            .iter()
            .filter(|p| p[0].abs() > 0.1)
            .map(|p| p[2])
            .collect();
        let (mean, std) = statistics(far.into_iter());
        assert!(mean.abs() < 5e-4 && std < 0.004, "{mean} {std}");
    }
}

#[test]
fn the_two_sides_of_a_plate_of_40_mm_stay_apart() {
    let mut map = Map::default();
    let mut random = Random(3);
    for side in [0.02, -0.02_f64] {
        add(
            &mut map,
            &mut random,
            8_000,
            |r| [r.within(-0.5, 0.5), r.within(-0.5, 0.5), side],
            |r, _| {
                [
                    r.within(-1.5, 1.5),
                    r.within(-1.5, 1.5),
                    r.within(2.0, 4.0) * side.signum(),
                ]
            },
        );
    }
    let moved = map.moved();
    let (top, a) = statistics(moved[..8_000].iter().map(|p| p[2]));
    let (bottom, b) = statistics(moved[8_000..].iter().map(|p| p[2]));
    assert!((top - bottom - 0.04).abs() < 0.002, "{top} {bottom}");
    assert!(a.max(b) < 0.005, "{a} {b}");
}

#[test]
fn cylinders_keep_their_radius() {
    for (radius, n) in [(0.05, 6_000), (0.1, 8_000), (0.2, 10_000), (0.4, 15_000)] {
        let map = map_of(
            n,
            |r| {
                let angle = r.within(0.0, TAU);
                [
                    radius * angle.cos(),
                    radius * angle.sin(),
                    r.within(-0.7, 0.7),
                ]
            },
            |r, p| {
                let angle = p[1].atan2(p[0]) + r.within(-1.2, 1.2);
                let away = r.within(1.5, 3.5);
                [away * angle.cos(), away * angle.sin(), r.within(-1.0, 1.0)]
            },
        );
        let radii = |points: &[Point]| {
            let inner = points.iter().filter(|p| p[2].abs() < 0.5);
            statistics(
                inner
                    .map(|p| p[0].hypot(p[1]) - radius)
                    .collect::<Vec<_>>()
                    .into_iter(),
            )
        };
        let ((_, before), (mean, after)) = (radii(&map.points), radii(&map.moved()));
        assert!(mean.abs() < 1e-3, "{radius}: {mean}");
        assert!(after < 0.75 * before, "{radius}: {after} of {before}");
    }
}

#[test]
fn points_of_few_passes_and_lonely_ones_stay() {
    let mut map = map_of(6_000, |r| floor(r, 1.0), above);
    let mut random = Random(5);
    // As dense as the floor, but all of it seen within a second.
    let first = map.points.len();
    for _ in 0..6_000 {
        let truth = [random.within(4.0, 6.0), random.within(-1.0, 1.0), 0.0];
        let time = random.within(0.0, 0.9);
        map.measure(&mut random, truth, [5.0, 0.0, 3.0], time, 0.0);
    }
    let lonely = map.points.len();
    for k in 0..50 {
        let truth = [f64::from(k), 20.0 + f64::from(k % 5), 0.0];
        map.measure(&mut random, truth, [0.0, 0.0, 3.0], 0.3 * f64::from(k), 0.0);
    }
    let refined = map.refine();
    assert!(refined.moves[first..].iter().all(|m| *m == 0.0));
    assert!(refined.moves[..first].iter().filter(|m| **m != 0.0).count() > 5_500);
    assert!(
        refined.sigmas[lonely..]
            .iter()
            .all(|s| (f64::from(*s) - NOISE).abs() < 0.002)
    );
}

#[test]
fn leaves_without_a_surface_are_not_flattened() {
    let cloud = |r: &mut Random| {
        [
            r.within(-0.5, 0.5),
            r.within(-0.5, 0.5),
            r.within(-0.5, 0.5),
        ]
    };
    let mut map = map_of(12_000, cloud, above);
    let mut random = Random(7);
    add(
        &mut map,
        &mut random,
        12_000,
        |r| [r.within(3.0, 5.0), r.within(-1.0, 1.0), 0.0],
        above,
    );
    let moves = map.refine().moves;
    let (_, size) = statistics(moves[..12_000].iter().map(|m| f64::from(*m)));
    assert!(size < 0.003, "{size}");
}

#[test]
fn what_the_passes_share_stays_in_the_stated_deviation() {
    let (mut map, mut random) = (Map::default(), Random(9));
    let biases: Vec<f64> = (0..120).map(|_| 0.01 * random.normal()).collect();
    for _ in 0..12_000 {
        let truth = floor(&mut random, 1.0);
        let from = above(&mut random, &truth);
        let time = random.within(0.0, DURATION);
        map.measure(
            &mut random,
            truth,
            from,
            time,
            biases[(time / PASS) as usize],
        );
    }
    let sigmas = map.refine().sigmas;
    let (mean, _) = statistics(sigmas.iter().map(|s| f64::from(*s)));
    // So many passes of 10 mm each leave 0.9 mm that no averaging of points takes away.
    assert!(mean > 0.0009, "{mean}");
}

#[test]
fn points_around_help_as_much_as_if_they_were_refined_too() {
    let map = map_of(12_000, |r| floor(r, 1.0), above);
    let all = map.refine();
    let own: Vec<bool> = map.points.iter().map(|p| p[0] < 0.1).collect();
    let mut sample = Sample::new(SETTINGS);
    sample.add(&map.words(), &own);
    let found = sample.refine(Some(all.noise.clone())).unwrap();
    let expected: Vec<f32> = (0..own.len())
        .filter(|&i| own[i])
        .map(|i| all.moves[i])
        .collect();
    assert_eq!(found.moves, expected);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let map = map_of(20_000, |r| floor(r, PI), above);
    let with = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .build()
            .unwrap();
        pool.install(|| (map.refine().moves, map.refine().sigmas))
    };
    assert_eq!(with(1), with(3));
}
