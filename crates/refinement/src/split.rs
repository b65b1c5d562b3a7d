// SPDX-License-Identifier: MIT OR Apache-2.0
//! Two sheets that meet at a line: a crease, or a step.

use bentwing_trajectory::so3;
use nalgebra::Vector3;

use crate::sheet::{GRAZING, Sheet, Spot, normal_of};

const N_DIRECTIONS: usize = 6;
const N_BINS: usize = 10;
/// Each side has at least this share of the weights, and so many points.
const SMALLEST: f64 = 0.12;
const FEWEST: usize = 8;
/// Normals that differ by more are those of a crease, whose line both planes tell.
const CREASE: f64 = 0.15;
/// Parameters of the line.
const LINE: usize = 2;
/// Two planes are tried where they explain more than this, in logarithms of the number of spots.
const PROMISING: f64 = 1.0;
/// Share of the spread of spots along and across that shows a direction of its own.
const FLAT: f64 = 1e-6;
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
    pub(crate) fn holds(&self, at: &Vector3<f64>) -> bool {
        self.direction.dot(at) >= self.offset
    }

    fn other(&self) -> Self {
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
    spots: &[Spot],
    radius: f64,
    normal: &Vector3<f64>,
    one: Option<&Sheet>,
) -> Option<Pair> {
    let coarse = best_line(spots, radius, normal)?;
    let pair = fit_halves(spots, radius, coarse)?;
    let lines = [crease(&pair), step(spots, &pair, normal)];
    let others = lines
        .into_iter()
        .flatten()
        .filter_map(|line| fit_halves(spots, radius, line));
    let pair = others.fold(pair, |best, other| {
        if cost(&other) < cost(&best) {
            other
        } else {
            best
        }
    });
    is_better(&pair, one).then_some(pair)
}

fn cost(pair: &Pair) -> f64 {
    pair[0].0.cost + pair[1].0.cost
}

/// Bayesian information criterion.
fn is_better(pair: &Pair, one: Option<&Sheet>) -> bool {
    let Some(one) = one else { return true };
    let n = one.weight;
    let parameters = pair[0].0.n_parameters + pair[1].0.n_parameters + LINE;
    let left = (cost(pair) / n.max(1.0)).max(1.0);
    let price = (parameters as f64 - one.n_parameters as f64) * n.max(1.0).ln();
    (one.cost - cost(pair)) / left > price
}

fn fit_halves(spots: &[Spot], radius: f64, half: Half) -> Option<Pair> {
    let (a, b): (Vec<Spot>, Vec<Spot>) = spots.iter().partition(|s| half.holds(&s.at));
    if a.len() < FEWEST || b.len() < FEWEST {
        return None;
    }
    let fit = |part: &[Spot]| Sheet::fit(part, radius, &normal_of(part)?);
    Some([(fit(&a)?, half), (fit(&b)?, half.other())])
}

/// The line that leaves two planes with the least squares, unless even they explain the spots hardly better
/// than one does.
fn best_line(spots: &[Spot], radius: f64, normal: &Vector3<f64>) -> Option<Half> {
    let [u, v] = so3::orthogonal_pair(normal);
    // In small squares first, of which each side of a line has some.
    let mut squares = [Sums::default(); N_BINS * N_BINS];
    for s in spots {
        let (p, q) = (u.dot(&s.at) / radius, v.dot(&s.at) / radius);
        squares[bin_of(p) * N_BINS + bin_of(q)].add(p, q, s, normal);
    }
    let all = squares.iter().fold(Sums::default(), |sum, b| sum.plus(b));
    let mut best: Option<(f64, Half)> = None;
    for k in 0..N_DIRECTIONS {
        let (sin, cos) = (std::f64::consts::PI * k as f64 / N_DIRECTIONS as f64).sin_cos();
        let mut bins = [Sums::default(); N_BINS];
        for (i, sums) in squares.iter().enumerate().filter(|(_, s)| s.w > 0.0) {
            let [p, q] = [i / N_BINS, i % N_BINS].map(middle_of);
            let bin = &mut bins[bin_of(cos * p + sin * q)];
            *bin = bin.plus(sums);
        }
        let mut low = Sums::default();
        for (bin, sums) in bins.iter().enumerate().take(N_BINS - 1) {
            low = low.plus(sums);
            let high = all.minus(&low);
            if low.w.min(high.w) < SMALLEST * all.w {
                continue;
            }
            let left = low.misfit() + high.misfit();
            if best.is_none_or(|(least, _)| left < least) {
                let offset = (2.0 * (bin + 1) as f64 / N_BINS as f64 - 1.0) * radius;
                let direction = u * cos + v * sin;
                best = Some((left, Half { direction, offset }));
            }
        }
    }
    let (left, half) = best?;
    let scale = (left / all.n).max(1.0);
    (all.misfit() - left > PROMISING * scale * all.n.max(1.0).ln()).then_some(half)
}

/// Of a coordinate over the radius.
fn bin_of(c: f64) -> usize {
    (((c + 1.0) * 0.5 * N_BINS as f64) as usize).min(N_BINS - 1)
}

fn middle_of(bin: usize) -> f64 {
    (2 * bin + 1) as f64 / N_BINS as f64 - 1.0
}

/// The line of a step between two sheets, which leaves each spot on the one that it fits.
fn step(spots: &[Spot], pair: &Pair, normal: &Vector3<f64>) -> Option<Half> {
    let (a, b) = (&pair[0].0, &pair[1].0);
    let nearer: Vec<f64> = spots.iter().map(|s| a.cost_of(s) - b.cost_of(s)).collect();
    let across = normal.cross(&pair[0].1.direction);
    let mut best: Option<(f64, Half)> = None;
    for turn in TURNS {
        let direction = (pair[0].1.direction + across * turn).normalize();
        let places = spots.iter().map(|s| direction.dot(&s.at));
        let mut order: Vec<(f64, f64)> = places.zip(nearer.iter().copied()).collect();
        order.sort_unstable_by(|x, y| x.0.total_cmp(&y.0));
        // Beginning with all spots in the half of the first sheet, those below the line leave it.
        let mut gained = 0.0;
        for k in 1..order.len() {
            gained -= order[k - 1].1;
            if best.is_none_or(|(least, _)| gained < least) {
                let offset = 0.5 * (order[k - 1].0 + order[k].0);
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
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Of the weights by the distance.
    n: f64,
    /// These over the variances.
    w: f64,
    /// u, v, h.
    first: [f64; 3],
    /// uu, uv, vv, uh, vh, hh.
    second: [f64; 6],
}

impl Sums {
    fn add(&mut self, u: f64, v: f64, s: &Spot, normal: &Vector3<f64>) {
        let h = normal.dot(&s.at);
        let across = normal.dot(&s.beam).abs().max(GRAZING) * s.sigma;
        let share = (1.0 - u * u - v * v).max(0.0);
        let w = share * share / (across * across);
        self.n += share * share;
        self.w += w;
        for (sum, value) in self.first.iter_mut().zip([u, v, h]) {
            *sum += w * value;
        }
        let products = [u * u, u * v, v * v, u * h, v * h, h * h];
        for (sum, value) in self.second.iter_mut().zip(products) {
            *sum += w * value;
        }
    }

    fn plus(&self, o: &Self) -> Self {
        Self {
            n: self.n + o.n,
            w: self.w + o.w,
            first: std::array::from_fn(|k| self.first[k] + o.first[k]),
            second: std::array::from_fn(|k| self.second[k] + o.second[k]),
        }
    }

    fn minus(&self, o: &Self) -> Self {
        Self {
            n: self.n - o.n,
            w: self.w - o.w,
            first: std::array::from_fn(|k| self.first[k] - o.first[k]),
            second: std::array::from_fn(|k| self.second[k] - o.second[k]),
        }
    }

    /// Squares of the heights over the best plane, over their variances.
    fn misfit(&self) -> f64 {
        let [u, v, h] = self.first.map(|s| s / self.w);
        let [uu, uv, vv, uh, vh, hh] = self.second.map(|s| s / self.w);
        let (uu, uv, vv) = (uu - u * u, uv - u * v, vv - v * v);
        let (uh, vh, hh) = (uh - u * h, vh - v * h, hh - h * h);
        let determinant = uu * vv - uv * uv;
        // What lies on a line leaves one slope free.
        let explained = if determinant > FLAT * uu * vv {
            (uh * (vv * uh - uv * vh) + vh * (uu * vh - uv * uh)) / determinant
        } else {
            0.0
        };
        (hh - explained).max(0.0) * self.w
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_misfit_is_what_two_slopes_and_a_height_cannot_explain(
            slopes in prop::array::uniform3(-1.0..1.0_f64),
            off in prop::collection::vec(-0.1..0.1_f64, 20),
        ) {
            let spot = |i: usize, off: f64| {
                let (u, v) = ((i % 5) as f64 * 0.2 - 0.4, (i / 5) as f64 * 0.2 - 0.3);
                let height = slopes[0] + slopes[1] * u + slopes[2] * v + off;
                Spot { at: Vector3::new(u, v, height), beam: -Vector3::z(), sigma: 0.5, pass: 0 }
            };
            let of = |scale: f64| {
                let mut sums = Sums::default();
                for (i, &off) in off.iter().enumerate() {
                    let s = spot(i, scale * off);
                    sums.add(s.at[0], s.at[1], &s, &Vector3::z());
                }
                sums
            };
            prop_assert!(of(0.0).misfit() < 1e-9);
            // Squares grow as squares do, and none is more than the heights themselves.
            prop_assert!((of(2.0).misfit() - 4.0 * of(1.0).misfit()).abs() < 1e-9);
            let squares: f64 = off.iter().map(|o| o * o / 0.25).sum();
            prop_assert!(of(1.0).misfit() <= squares + 1e-9);
        }
    }
}
