// SPDX-License-Identifier: MIT OR Apache-2.0
//! Two sheets that meet at a line: a crease, or a step.

use std::f64::consts::PI;

use bentwing_trajectory::so3;
use nalgebra::Vector3;
use wide::f32x4;

use crate::sheet::{GRAZING, Room, Sheet};
use crate::spots::{Spot, dot, normal_of, partition, single};

const N_DIRECTIONS: usize = 6;
const N_BINS: usize = 10;
/// Places of the line of a step.
const N_STRIPS: usize = 64;
/// Each side has at least this share of the weights, and so many points.
const SMALLEST: f64 = 0.12;
pub(crate) const FEWEST: usize = 8;
/// Normals that differ by more are those of a crease, whose line both planes tell.
const CREASE: f64 = 0.15;
/// Parameters of the line.
const LINE: usize = 2;
/// Two planes are tried where they explain more than this, in logarithms of the number of spots.
const PROMISING: f64 = 2.0;
/// Share of the spread of spots along and across that shows a direction of its own.
pub(crate) const FLAT: f64 = 1e-6;
/// Turns of the line of a step that are tried once more, rad.
const TURNS: [f64; 5] = [-0.2, -0.1, 0.0, 0.1, 0.2];

/// A half of space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Half {
    pub direction: Vector3<f64>,
    pub offset: f64,
}

impl Half {
    #[inline]
    pub(crate) fn holds(&self, at: &[f32; 3]) -> bool {
        dot(&single(&self.direction), at) >= self.offset as f32
    }

    /// As it is from another middle than the one it is told from (units of the map, each of them in m).
    pub(crate) fn seen_from(&self, own: &[i32; 3], other: &[i32; 3], unit: f32) -> Self {
        let apart = [0, 1, 2].map(|a| f64::from(unit) * f64::from(own[a].wrapping_sub(other[a])));
        let offset = self.offset + self.direction.dot(&Vector3::from(apart));
        Self { offset, ..*self }
    }

    pub(crate) fn other(&self) -> Self {
        Self {
            direction: -self.direction,
            offset: -self.offset,
        }
    }
}

/// Two sheets, each with the half of space in which it is.
pub(crate) type Pair = [(Sheet, Half); 2];

/// The two sheets that explain the spots better than `one` does, if any do.
pub(crate) fn split(
    spots: &mut [Spot],
    radius: f64,
    normal: &Vector3<f64>,
    one: Option<&Sheet>,
    room: &mut Room,
) -> Option<Pair> {
    let coarse = best_line(spots, radius, normal)?;
    let pair = fit_halves(spots, radius, coarse, room)?;
    let lines = [
        crease(&pair),
        line_between(spots, radius, &pair, normal, room),
    ];
    let others = lines
        .into_iter()
        .flatten()
        .filter_map(|line| fit_halves(spots, radius, line, room));
    let pair = others.fold(pair, |best, other| {
        if cost(&other) < cost(&best) {
            other
        } else {
            best
        }
    });
    one.is_none_or(|one| gain(&pair, one) > 0.0).then_some(pair)
}

pub(crate) fn cost(pair: &Pair) -> f64 {
    pair[0].0.cost + pair[1].0.cost
}

/// By how much two sheets are likelier than one, by the Bayesian information criterion: as so many parameters.
pub(crate) fn gain(pair: &Pair, one: &Sheet) -> f64 {
    let n = one.weight.max(1.0);
    let left = (cost(pair) / n).max(1.0);
    let parameters = pair[0].0.n_parameters + pair[1].0.n_parameters + LINE;
    let explained = (one.cost - cost(pair)) / left;
    explained / n.ln().max(f64::MIN_POSITIVE) + one.n_parameters as f64 - parameters as f64
}

fn fit_halves(spots: &mut [Spot], radius: f64, half: Half, room: &mut Room) -> Option<Pair> {
    let [a, b] = partition(spots, |s| half.holds(&s.at));
    if a.len() < FEWEST || b.len() < FEWEST {
        return None;
    }
    let mut fit = |part: &[Spot]| Sheet::fit(part, radius, &normal_of(part)?, room);
    Some([(fit(a)?, half), (fit(b)?, half.other())])
}

/// The line that leaves two planes with the least squares, unless even they explain the spots hardly better
/// than one does.
pub(crate) fn best_line(spots: &[Spot], radius: f64, normal: &Vector3<f64>) -> Option<Half> {
    let [u, v] = so3::orthogonal_pair(normal);
    let [along, beside, up] = [u / radius, v / radius, *normal].map(|axis| single(&axis));
    // In small squares first, of which each side of a line has some.
    let mut squares = [Sums::default(); N_BINS * N_BINS];
    for s in spots {
        let (p, q) = (dot(&along, &s.at), dot(&beside, &s.at));
        squares[bin_of::<N_BINS>(p) * N_BINS + bin_of::<N_BINS>(q)].add(p, q, s, &up);
    }
    let filled = squares.iter().enumerate().filter(|(_, s)| s.w() > 0.0);
    let filled: Vec<([f32; 2], Sums)> = filled
        .map(|(i, sums)| ([i / N_BINS, i % N_BINS].map(middle_of), *sums))
        .collect();
    let all = filled.iter().fold(Sums::default(), |sum, s| sum.plus(&s.1));
    let mut best: Option<(f64, Half)> = None;
    for k in 0..N_DIRECTIONS {
        let (sin, cos) = (PI * k as f64 / N_DIRECTIONS as f64).sin_cos();
        let mut bins = [Sums::default(); N_BINS];
        for ([p, q], sums) in &filled {
            let bin = &mut bins[bin_of::<N_BINS>(cos as f32 * p + sin as f32 * q)];
            *bin = bin.plus(sums);
        }
        let mut low = Sums::default();
        for (bin, sums) in bins.iter().enumerate().take(N_BINS - 1) {
            low = low.plus(sums);
            let high = all.minus(&low);
            if low.w().min(high.w()) < SMALLEST * all.w() {
                continue;
            }
            let left = low.misfit() + high.misfit();
            if best.is_none_or(|(least, _)| left < least) {
                let offset = end_of::<N_BINS>(bin) * radius;
                let direction = u * cos + v * sin;
                best = Some((left, Half { direction, offset }));
            }
        }
    }
    let (left, half) = best?;
    let (n, scale) = (all.n(), (left / all.n()).max(1.0));
    (all.misfit() - left > PROMISING * scale * n.max(1.0).ln()).then_some(half)
}

/// Of a coordinate over the radius.
#[inline]
fn bin_of<const N: usize>(c: f32) -> usize {
    (((c + 1.0) * 0.5 * N as f32) as usize).min(N - 1)
}

fn end_of<const N: usize>(bin: usize) -> f64 {
    2.0 * (bin + 1) as f64 / N as f64 - 1.0
}

fn middle_of(bin: usize) -> f32 {
    (2 * bin + 1) as f32 / N_BINS as f32 - 1.0
}

/// The line between two sheets that leaves each spot on the one that it fits.
pub(crate) fn line_between(
    spots: &[Spot],
    radius: f64,
    pair: &Pair,
    normal: &Vector3<f64>,
    room: &mut Room,
) -> Option<Half> {
    let (a, b) = (&pair[0].0, &pair[1].0);
    let (of_a, of_b) = (a.costs(spots, room), b.costs(spots, room));
    let nearer: Vec<f32> = of_a.iter().zip(of_b).map(|(x, y)| x - y).collect();
    let across = normal.cross(&pair[0].1.direction);
    let mut best: Option<(f32, Half)> = None;
    for turn in TURNS {
        let direction = (pair[0].1.direction + across * turn).normalize();
        let row = single(&(direction / radius));
        let mut strips = [0.0; N_STRIPS];
        for (s, nearer) in spots.iter().zip(&nearer) {
            strips[bin_of::<N_STRIPS>(dot(&row, &s.at))] += nearer;
        }
        // Beginning with all spots in the half of the first sheet, those below the line leave it.
        let mut gained = 0.0;
        for (strip, nearer) in strips.iter().enumerate().take(N_STRIPS - 1) {
            gained -= nearer;
            if best.is_none_or(|(least, _)| gained < least) {
                let offset = end_of::<N_STRIPS>(strip) * radius;
                best = Some((gained, Half { direction, offset }));
            }
        }
    }
    best.map(|(_, half)| half)
}

/// The plane between two sheets that meet.
fn crease(pair: &Pair) -> Option<Half> {
    let turned = pair[0].0.normal - pair[1].0.normal;
    if turned.norm() < CREASE {
        return None;
    }
    let direction = turned.normalize();
    // The signed distances from both are the same on it.
    let offset = (pair[1].0.height_of_middle() - pair[0].0.height_of_middle()) / turned.norm();
    let half = Half { direction, offset };
    // Of its two sides the one that holds what is nearer to the first sheet.
    let inside = pair[0].1.direction.dot(&direction);
    if inside.abs() < 0.3 {
        return None;
    }
    Some(if inside > 0.0 { half } else { half.other() })
}

/// Moments of spots beside a plane: of their places along it over the radius, and of their heights.
///
/// The weights by the distance; these over the variances, alone and times u, v, h, uu, uv, vv, uh, vh, hh.
#[derive(Clone, Copy, Default)]
pub(crate) struct Sums([f32x4; 3]);

impl Sums {
    pub(crate) fn add(&mut self, u: f32, v: f32, s: &Spot, normal: &[f32; 3]) {
        let h = dot(normal, &s.at);
        let across = dot(normal, &s.beam).abs().max(GRAZING) * s.sigma;
        let near = (1.0 - u * u - v * v).max(0.0);
        let share = near * near;
        let w = share / (across * across);
        let (wu, wv, wh) = (w * u, w * v, w * h);
        *self = self.plus(&Self([
            f32x4::new([share, w, wu, wv]),
            f32x4::new([wh, wu * u, wu * v, wv * v]),
            f32x4::new([wu * h, wv * h, wh * h, 0.0]),
        ]));
    }

    fn n(&self) -> f64 {
        f64::from(self.0[0].to_array()[0])
    }

    pub(crate) fn w(&self) -> f64 {
        f64::from(self.0[0].to_array()[1])
    }

    #[inline]
    fn plus(&self, o: &Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + o.0[k]))
    }

    #[inline]
    fn minus(&self, o: &Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] - o.0[k]))
    }

    /// Squares of the heights over the best plane, over their variances.
    fn misfit(&self) -> f64 {
        let [uu, uv, vv, uh, vh, hh] = self.variances();
        let determinant = uu * vv - uv * uv;
        // What lies on a line leaves one slope free.
        let explained = if determinant > FLAT * uu * vv {
            (uh * (vv * uh - uv * vh) + vh * (uu * vh - uv * uh)) / determinant
        } else {
            0.0
        };
        (hh - explained).max(0.0) * self.w()
    }

    /// Means of uu, uv, vv, uh, vh and hh, all from their own means.
    pub(crate) fn variances(&self) -> [f64; 6] {
        let per = 1.0 / self.w();
        let mean = |k: usize| self.0[k].to_array().map(|s| f64::from(s) * per);
        let ([_, _, u, v], [h, uu, uv, vv], [uh, vh, hh, _]) = (mean(0), mean(1), mean(2));
        let (uu, uv, vv) = (uu - u * u, uv - u * v, vv - v * v);
        [uu, uv, vv, uh - u * h, vh - v * h, hh - h * h]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_misfit_is_what_two_slopes_and_a_height_cannot_explain(
            slopes in prop::array::uniform3(-1.0..1.0_f32),
            off in prop::collection::vec(-0.1..0.1_f32, 20),
        ) {
            let spot = |i: usize, off: f32| {
                let (u, v) = ((i % 5) as f32 * 0.2 - 0.4, (i / 5) as f32 * 0.2 - 0.3);
                let height = slopes[0] + slopes[1] * u + slopes[2] * v + off;
                Spot { at: [u, v, height], beam: [0.0, 0.0, -1.0], sigma: 0.5, pass: 0 }
            };
            let of = |scale: f32| {
                let mut sums = Sums::default();
                for (i, &off) in off.iter().enumerate() {
                    let s = spot(i, scale * off);
                    sums.add(s.at[0], s.at[1], &s, &[0.0, 0.0, 1.0]);
                }
                sums
            };
            prop_assert!(of(0.0).misfit() < 1e-3);
            // Squares grow as squares do, and none is more than the heights themselves.
            prop_assert!((of(2.0).misfit() - 4.0 * of(1.0).misfit()).abs() < 1e-3);
            let squares: f64 = off.iter().map(|o| f64::from(o * o) / 0.25).sum();
            prop_assert!(of(1.0).misfit() <= squares + 1e-3);
        }
    }
}
