// SPDX-License-Identifier: MIT OR Apache-2.0
//! Planar and edge points of the rings of a sweep, by curvature (Fu 2023, section 2.3.2; LOAM).
//!
//! A ring is cut into short runs of points. The curvature of a run is
//! `c = ‖Σ_j (x_i − x_j)‖ / (|S| ‖x_i‖)` about its middle point `x_i`: small on a plane, and then the
//! mean of the run stands for all of its points with a fraction of their noise.

use nalgebra::Vector3;

/// A run is no longer than this, m, or this share of the range, whichever is more, so that a
/// sparse ring makes runs, too.
const LONGEST: (f64, f64) = (0.15, 0.025);
/// Points of a run: fewer have no curvature, more would weigh too much.
const RUN: (usize, usize) = (3, 16);
/// Points farther apart in time than so many of the ring's firings are not neighbours.
const MAX_MISSED: f64 = 4.5;
/// Neighbours that differ in range by more, m and as a share of it, are not on one surface.
const JUMP: (f64, f64) = (0.15, 0.04);
/// A planar run is as straight and as level as its noise allows, in standard deviations.
const STRAIGHT: f64 = 1.7;
const LEVEL: f64 = 3.0;
/// Points of one surface beside a depth edge; fewer are clutter.
const BESIDE: usize = 4;
/// A depth edge is nearer than what is behind it by this much, m.
const EDGE: f64 = 0.5;
/// What of the noise of a range does not average out within a run, as a share of it.
const COMMON: f64 = 0.1;

/// Returns of one sweep; all slices have the same length.
#[derive(Clone, Copy, Debug)]
pub struct Sweep<'a> {
    /// m, lidar frame.
    pub points: &'a [[f64; 3]],
    /// s, lidar clock, non-decreasing.
    pub times: &'a [f64],
    /// Beam numbers; empty where the sensor has none.
    pub rings: &'a [u16],
    /// Encoder angle at each point, rad; empty without a motor.
    pub angles: &'a [f64],
}

/// A point of the sweep that stands for its neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feature {
    /// m, lidar frame.
    pub p: Vector3<f64>,
    /// s, lidar clock.
    pub time: f64,
    /// Encoder angle, rad.
    pub angle: f64,
    /// Of its position, m².
    pub variance: f64,
}

/// What a sweep shows.
#[derive(Clone, Debug, Default)]
pub struct Features {
    /// Means of runs of low curvature.
    pub planar: Vec<Feature>,
    /// Near sides of depth edges.
    pub edges: Vec<Feature>,
}

/// Finds the features of a sweep of a lidar whose ranges have the standard deviation `sigma`, m.
///
/// Without rings each point is a planar feature.
pub fn features(sweep: &Sweep<'_>, sigma: f64) -> Features {
    let mut found = Features::default();
    if sweep.rings.is_empty() {
        found.planar = (0..sweep.points.len())
            .map(|i| single(sweep, i, sigma * sigma))
            .collect();
        return found;
    }
    for ring in by_ring(sweep.rings) {
        walk(sweep, &ring, sigma, &mut found);
    }
    found
}

/// Indices of each ring, in time order.
fn by_ring(rings: &[u16]) -> Vec<Vec<u32>> {
    let n = rings.iter().max().map_or(0, |&r| usize::from(r) + 1);
    let mut groups = vec![Vec::with_capacity(rings.len() / n.max(1) + 8); n];
    for (i, &r) in rings.iter().enumerate() {
        groups[usize::from(r)].push(i as u32);
    }
    groups
}

fn single(sweep: &Sweep<'_>, i: usize, variance: f64) -> Feature {
    Feature {
        p: Vector3::from(sweep.points[i]),
        time: sweep.times[i],
        angle: sweep.angles.get(i).copied().unwrap_or(0.0),
        variance,
    }
}

/// Goes along one ring, surface by surface.
fn walk(sweep: &Sweep<'_>, ring: &[u32], sigma: f64, found: &mut Features) {
    if ring.len() < RUN.0 {
        return;
    }
    let time = |k: usize| sweep.times[ring[k] as usize];
    let mut steps: Vec<f64> = (1..ring.len()).map(|k| time(k) - time(k - 1)).collect();
    let middle = (steps.len() - 1) / 2;
    let firing = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let points: Vec<Vector3<f64>> = ring
        .iter()
        .map(|&i| sweep.points[i as usize].into())
        .collect();
    let ranges: Vec<f64> = points.iter().map(Vector3::norm).collect();
    let mut begin = 0;
    for k in 1..=ring.len() {
        let near_in_time = k < ring.len() && time(k) - time(k - 1) <= MAX_MISSED * firing;
        if near_in_time && !jumps(ranges[k - 1], ranges[k]) {
            continue;
        }
        cut_into_runs(
            sweep,
            &ring[begin..k],
            &points[begin..k],
            sigma,
            &mut found.planar,
        );
        if near_in_time {
            let next = (k + 1..ring.len()).find(|&j| jumps(ranges[j - 1], ranges[j]));
            let beside = [k - begin, next.unwrap_or(ring.len()) - k];
            edge(
                sweep,
                &ring[k - 1..=k],
                [ranges[k - 1], ranges[k]],
                beside,
                sigma,
                &mut found.edges,
            );
        }
        begin = k;
    }
}

fn jumps(a: f64, b: f64) -> bool {
    (a - b).abs() > JUMP.0.max(JUMP.1 * a.min(b))
}

/// The near one of two neighbours across a depth edge, if its surface goes on behind it.
fn edge(
    sweep: &Sweep<'_>,
    pair: &[u32],
    ranges: [f64; 2],
    beside: [usize; 2],
    sigma: f64,
    found: &mut Vec<Feature>,
) {
    let near = usize::from(ranges[1] < ranges[0]);
    if ranges[1 - near] - ranges[near] < EDGE || beside[near] < BESIDE {
        return;
    }
    let (a, b) = (pair[0] as usize, pair[1] as usize);
    // The edge is somewhere between the two beams.
    let (u, v) = (
        Vector3::from(sweep.points[a]),
        Vector3::from(sweep.points[b]),
    );
    let spacing = (u / ranges[0] - v / ranges[1]).norm() * ranges[near];
    found.push(single(
        sweep,
        if near == 0 { a } else { b },
        sigma * sigma + spacing * spacing,
    ));
}

/// Cuts the points of one surface on one ring into runs and keeps the planar ones.
fn cut_into_runs(
    sweep: &Sweep<'_>,
    ring: &[u32],
    points: &[Vector3<f64>],
    sigma: f64,
    found: &mut Vec<Feature>,
) {
    let mut first = 0;
    while first + RUN.0 <= points.len() {
        let longest = LONGEST.0.max(LONGEST.1 * points[first].norm());
        let limit = points.len().min(first + RUN.1);
        let end = (first + 1..limit)
            .find(|&k| (points[k] - points[first]).norm_squared() > longest * longest)
            .unwrap_or(limit);
        if end - first >= RUN.0
            && let Some(feature) = planar(sweep, &ring[first..end], &points[first..end], sigma)
        {
            found.push(feature);
        }
        first = end;
    }
}

/// The mean of a run if its curvature is low and it is straight.
fn planar(sweep: &Sweep<'_>, ring: &[u32], points: &[Vector3<f64>], sigma: f64) -> Option<Feature> {
    let n = points.len() as f64;
    let mean = points.iter().sum::<Vector3<f64>>() / n;
    let range = mean.norm();
    let middle = &points[points.len() / 2];
    let curvature = (mean - middle).norm() / range;
    let spread = (points[points.len() - 1] - points[0]).norm();
    // The middle of an even number of points is beside their mean.
    let beside = 0.5 * spread / n;
    if curvature * range > LEVEL * sigma + beside {
        return None;
    }
    // Least squares of the range by the place in the run, which is even: its residuals show
    // whether the run is straight.
    let centre = 0.5 * (n - 1.0);
    let (mut slope, mut total) = (Vector3::zeros(), 0.0);
    for (k, p) in points.iter().enumerate() {
        let x = k as f64 - centre;
        slope += (p - mean) * x;
        total += x * x;
    }
    slope /= total;
    let beam = mean / range;
    let squares = points.iter().enumerate().map(|(k, p)| {
        let along = (p - mean - slope * (k as f64 - centre)).dot(&beam);
        along * along
    });
    let excess: f64 = squares.sum::<f64>() / (n - 2.0).max(1.0);
    if excess > (STRAIGHT * sigma).powi(2) {
        return None;
    }
    let mean_of = |values: &[f64]| {
        let first = values[ring[0] as usize];
        first
            + ring
                .iter()
                .map(|&i| values[i as usize] - first)
                .sum::<f64>()
                / n
    };
    Some(Feature {
        p: mean,
        time: mean_of(sweep.times),
        angle: if sweep.angles.is_empty() {
            0.0
        } else {
            mean_of(sweep.angles)
        },
        variance: sigma * sigma * (1.0 / n + COMMON * COMMON),
    })
}

#[cfg(test)]
mod tests;
