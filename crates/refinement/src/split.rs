// SPDX-License-Identifier: MIT OR Apache-2.0
//! Two sheets that meet at a line: a crease, or a step.

use bentwing_trajectory::so3;
use nalgebra::{Matrix3, Vector3};

use crate::sheet::{Sheet, Spot, normal_of};

const N_DIRECTIONS: usize = 6;
const N_BINS: usize = 10;
/// Each side has at least this share of the weights, and so many points.
const SMALLEST: f64 = 0.12;
const FEWEST: usize = 8;
/// Normals that differ by more are those of a crease, whose line both planes tell.
const CREASE: f64 = 0.15;
/// Parameters of the line.
const LINE: usize = 2;
/// Steps of Newton's method.
const NEWTON: usize = 5;
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
    let coarse = best_line(spots, normal)?;
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

/// The line that leaves two planes with the least squares.
fn best_line(spots: &[Spot], normal: &Vector3<f64>) -> Option<Half> {
    let [u, v] = so3::orthogonal_pair(normal);
    let reach = spots
        .iter()
        .map(|s| s.at.norm())
        .fold(0.0, f64::max)
        .max(1e-6);
    let mut best: Option<(f64, Half)> = None;
    for k in 0..N_DIRECTIONS {
        let (sin, cos) = (std::f64::consts::PI * k as f64 / N_DIRECTIONS as f64).sin_cos();
        let direction = u * cos + v * sin;
        let mut bins = [Sums::default(); N_BINS];
        for s in spots {
            let place = (direction.dot(&s.at) / reach + 1.0) * 0.5 * N_BINS as f64;
            bins[(place as usize).min(N_BINS - 1)].add(s);
        }
        let all = bins.iter().fold(Sums::default(), |sum, b| sum.plus(b));
        let mut low = Sums::default();
        for (bin, sums) in bins.iter().enumerate().take(N_BINS - 1) {
            low = low.plus(sums);
            let high = all.minus(&low);
            if low.w.min(high.w) < SMALLEST * all.w {
                continue;
            }
            let left = low.squares() + high.squares();
            if best.is_none_or(|(least, _)| left < least) {
                let offset = ((bin + 1) as f64 / N_BINS as f64 * 2.0 - 1.0) * reach;
                best = Some((left, Half { direction, offset }));
            }
        }
    }
    best.map(|(_, half)| half)
}

/// The line of a step between two sheets, which leaves each spot on the one that it fits.
fn step(spots: &[Spot], pair: &Pair, normal: &Vector3<f64>) -> Option<Half> {
    let (a, b) = (&pair[0].0, &pair[1].0);
    let across = normal.cross(&pair[0].1.direction);
    let mut best: Option<(f64, Half)> = None;
    for turn in TURNS {
        let direction = (pair[0].1.direction + across * turn).normalize();
        let mut order: Vec<(f64, f64)> = spots
            .iter()
            .map(|s| (direction.dot(&s.at), a.cost_of(s) - b.cost_of(s)))
            .collect();
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

/// Moments of spots.
#[derive(Clone, Copy, Default)]
struct Sums {
    w: f64,
    first: Vector3<f64>,
    second: Matrix3<f64>,
}

impl Sums {
    fn add(&mut self, s: &Spot) {
        let w = 1.0 / (s.sigma * s.sigma);
        self.w += w;
        self.first += s.at * w;
        self.second += s.at * s.at.transpose() * w;
    }

    fn plus(&self, o: &Self) -> Self {
        Self {
            w: self.w + o.w,
            first: self.first + o.first,
            second: self.second + o.second,
        }
    }

    fn minus(&self, o: &Self) -> Self {
        Self {
            w: self.w - o.w,
            first: self.first - o.first,
            second: self.second - o.second,
        }
    }

    /// Squares across the best plane.
    fn squares(&self) -> f64 {
        let mean = self.first / self.w;
        let covariance = self.second / self.w - mean * mean.transpose();
        smallest_eigenvalue(&covariance) * self.w
    }
}

/// Of a covariance, by Newton's method: below its smallest root the characteristic polynomial is steep and
/// bends away, so that the steps from 0 never pass the root. Several times as fast as the trigonometric
/// formula.
fn smallest_eigenvalue(a: &Matrix3<f64>) -> f64 {
    let trace = a.trace();
    let minors = a[(0, 0)] * a[(1, 1)] - a[(0, 1)] * a[(0, 1)] + a[(0, 0)] * a[(2, 2)]
        - a[(0, 2)] * a[(0, 2)]
        + a[(1, 1)] * a[(2, 2)]
        - a[(1, 2)] * a[(1, 2)];
    let determinant = a.determinant();
    let mut root = 0.0;
    for _ in 0..NEWTON {
        let value = ((root - trace) * root + minors) * root - determinant;
        let slope = (3.0 * root - 2.0 * trace) * root + minors;
        if slope <= 0.0 {
            break;
        }
        root -= value / slope;
    }
    root.max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bentwing_voxels::sym3;
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_smallest_eigenvalue_is_that_of_the_formula(
            small in 1e-6..1e-3_f64, f2 in 1.5..100.0_f64, f3 in 1.0..10.0_f64,
            a in -3.0..3.0_f64, b in -3.0..3.0_f64, c in -3.0..3.0_f64,
        ) {
            let values = Vector3::new(small, small * f2, small * f2 * f3);
            let R = UnitQuaternion::from_euler_angles(a, b, c).to_rotation_matrix().into_inner();
            let m = R * Matrix3::from_diagonal(&values) * R.transpose();
            prop_assert!((smallest_eigenvalue(&m) - sym3::eigen(&m).values[0]).abs() < 1e-2 * small);
        }
    }
}
