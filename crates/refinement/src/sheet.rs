// SPDX-License-Identifier: MIT OR Apache-2.0
//! One smooth piece of surface through noisy points: a plane, or a quadric where it curves.

use bentwing_trajectory::so3;
use bentwing_voxels::MIN_WIDTH;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use wide::f32x8;

use crate::spots::{LANES, NO_SPOT, Spot, add, total};

/// Passes are told apart by so many bins.
pub(crate) const N_PASSES: usize = 64;
/// Residuals of so many standard deviations count no more (Tukey).
const REJECTED: f32 = 4.685;
/// Mean square of normal residuals by these weights.
const TUKEY_VARIANCE: f64 = 0.829;
/// Standard deviation of a normal distribution over its median absolute value.
const MAD_TO_STD: f32 = 1.4826;
const ROUNDS: usize = 2;
/// Where no residual is larger, none needs less weight.
const CLEAN: f32 = 3.75;
/// Slope from which on the frame is turned to the plane that was found.
const STEEP: f64 = 0.1;
/// Slope at the edge from which on a surface bends otherwise than a quadric: a cylinder of which more is
/// taken looks too thin. Then less is taken, but not less than this share of the radius.
const STEEPEST: f64 = 0.8;
const NARROWEST: f64 = 0.75;
const PLANE: usize = 3;
/// A height, and half of the slopes that two planes share.
const LEVEL: usize = 2;
const QUADRIC: usize = 6;
/// A surface cannot be told from another one that a beam meets at less than this cosine.
pub(crate) const GRAZING: f32 = 0.05;
/// Price of a parameter.
const CURVES: f64 = 2.0;

/// A piece of surface; all relative to the middle of its points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sheet {
    /// Rows: two directions along the surface, and one across it.
    pub axes: Matrix3<f64>,
    /// Heights 1, u, v, u², uv, v² of the coordinates along the surface over the radius, m.
    pub heights: Vector6<f64>,
    pub radius: f64,
    /// At the middle; it faces the lidar.
    pub normal: Vector3<f64>,
    /// Variance of the true surface about this one, m².
    pub roughness: f64,
    /// Variance of this surface about its mean, were it found again, m².
    pub variance: f64,
    /// Effective numbers.
    pub n_points: f64,
    pub n_passes: f64,
    /// Weighted squares of the residuals over their variances, none above `REJECTED`.
    pub cost: f64,
    /// Of the spots.
    pub weight: f64,
    pub n_parameters: usize,
    /// Mean square of the residuals over their variances.
    pub scale: f64,
}

/// Spots in the axes of a sheet.
#[derive(Clone, Copy, Debug)]
struct Local {
    pass: [u8; LANES],
    /// Along the surface, over the radius.
    u: f32x8,
    v: f32x8,
    height: f32x8,
    beam: [f32x8; 3],
    sigma: f32x8,
    /// One, or zero where there is no spot.
    is: f32x8,
    /// By the distance.
    share: f32x8,
    /// Variance of the height.
    variance: f32x8,
    /// In the sums.
    weight: f32x8,
    /// Over the standard deviations.
    residual: f32x8,
}

/// Room for what a sheet computes of its spots.
#[derive(Clone, Debug, Default)]
pub(crate) struct Room {
    locals: Vec<Local>,
    sizes: Vec<f32>,
}

/// What a sheet may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Any,
    /// A quadric.
    Bent,
    /// A plane with this normal, one of two that share it.
    Level,
}

impl Sheet {
    /// The sheet through spots, if they have one; `normal` is a guess.
    pub(crate) fn fit(
        spots: &[Spot],
        radius: f64,
        normal: &Vector3<f64>,
        room: &mut Room,
    ) -> Option<Self> {
        Self::fit_as(spots, radius, normal, Kind::Any, room)
    }

    /// The plane with this normal through spots beside those of another one with it.
    pub(crate) fn level(
        spots: &[Spot],
        radius: f64,
        normal: &Vector3<f64>,
        room: &mut Room,
    ) -> Option<Self> {
        Self::fit_as(spots, radius, normal, Kind::Level, room)
    }

    /// The same within a radius that a quadric can follow, where this one bends more.
    pub(crate) fn narrower(&self, spots: &[Spot], room: &mut Room) -> Option<Self> {
        let h = &self.heights;
        let bend = 0.5 * (h[3] - h[5]).hypot(h[4]) + 0.5 * (h[3] + h[5]).abs();
        let slope = 2.0 * bend / self.radius;
        if slope <= STEEPEST {
            return None;
        }
        let radius = self.radius * (STEEPEST / slope).max(NARROWEST);
        Self::fit_as(spots, radius, &self.normal, Kind::Bent, room)
    }

    fn fit_as(
        spots: &[Spot],
        radius: f64,
        normal: &Vector3<f64>,
        kind: Kind,
        room: &mut Room,
    ) -> Option<Self> {
        let mut sheet = Self {
            axes: frame(normal),
            heights: Vector6::zeros(),
            radius,
            normal: *normal,
            roughness: 0.0,
            variance: 0.0,
            n_points: 0.0,
            n_passes: 0.0,
            cost: 0.0,
            weight: f64::MIN_POSITIVE,
            n_parameters: PLANE,
            scale: 1.0,
        };
        let Room { locals, sizes } = room;
        sheet.put(spots, locals);
        let mut sums = Sums::of(locals);
        let first = sums.plane()?;
        if kind != Kind::Level && first.fixed_rows::<2>(1).norm() > STEEP * radius {
            sheet.turn(&first);
            sheet.put(spots, locals);
            sums = Sums::of(locals);
        }
        let mut robust = false;
        for round in 0.. {
            if kind != Kind::Level && !sums.is_wide() {
                return None;
            }
            sheet.choose(&sums, kind)?;
            let largest = sheet.normalize(locals);
            if round == ROUNDS || !robust && largest < CLEAN {
                break;
            }
            reweight(locals, spots.len(), sizes);
            robust = true;
            sums = Sums::of(locals);
        }
        sheet.face();
        let variance = if robust { TUKEY_VARIANCE } else { 1.0 };
        sheet.describe(locals, variance);
        Some(sheet)
    }

    /// Takes spots in the axes of the sheet.
    fn put(&self, spots: &[Spot], locals: &mut Vec<Local>) {
        let per_metre = 1.0 / self.radius as f32;
        let axes = [0, 1, 2].map(|k| [0, 1, 2].map(|a| f32x8::splat(self.axes[(k, a)] as f32)));
        let along = |c: &[f32x8; 3]| axes.map(|row| row[0] * c[0] + row[1] * c[1] + row[2] * c[2]);
        let local = |some: &[Spot]| {
            let mut eight = [NO_SPOT; LANES];
            eight[..some.len()].copy_from_slice(some);
            let at = [0, 1, 2].map(|a| f32x8::new(eight.map(|s| s.at[a])));
            let beam = [0, 1, 2].map(|a| f32x8::new(eight.map(|s| s.beam[a])));
            let is = f32x8::new(std::array::from_fn(|k| f32::from(u8::from(k < some.len()))));
            let ([u, v, height], beam) = (along(&at), along(&beam));
            let (u, v, sigma) = (
                u * per_metre,
                v * per_metre,
                f32x8::new(eight.map(|s| s.sigma)),
            );
            // By the distance along the surface alone: by that across it, what the noise brings nearer to
            // the middle would count more, and draw the surface there.
            let near = (1.0 - u * u - v * v).fast_max(f32x8::ZERO);
            let share = near * near * is;
            let across = beam[2].abs().fast_max(f32x8::splat(GRAZING)) * sigma;
            let variance = across * across;
            Local {
                pass: eight.map(|s| s.pass),
                u,
                v,
                height,
                beam,
                sigma,
                is,
                share,
                variance,
                weight: share / variance,
                residual: f32x8::ZERO,
            }
        };
        locals.clear();
        locals.extend(spots.chunks(LANES).map(local));
    }

    /// Turns the axes to a plane.
    fn turn(&mut self, plane: &Vector6<f64>) {
        let up = Vector3::new(-plane[1] / self.radius, -plane[2] / self.radius, 1.0);
        self.normal = (self.axes.transpose() * up).normalize();
        self.axes = frame(&self.normal);
    }

    fn face(&mut self) {
        let up = Vector3::new(
            -self.heights[1] / self.radius,
            -self.heights[2] / self.radius,
            1.0,
        );
        self.normal = (self.axes.transpose() * up).normalize();
    }

    /// Plane or quadric, by Akaike's information criterion: a curve that is too weak for the Bayesian one
    /// would still shift a cylinder by a millimetre. A quadric where the points are known to bend.
    fn choose(&mut self, sums: &Sums, kind: Kind) -> Option<()> {
        if kind == Kind::Level {
            self.heights[0] = sums.height()?;
            self.n_parameters = LEVEL;
            return Some(());
        }
        let plane = sums.plane()?;
        (self.heights, self.n_parameters) = (plane, PLANE);
        let freedom = sums.n - QUADRIC as f64;
        if freedom < QUADRIC as f64 {
            return Some(());
        }
        if let Some(quadric) = sums.quadric() {
            let (flat, curved) = (sums.misfit(&plane), sums.misfit(&quadric));
            let left = (curved / freedom).max(1.0);
            if kind == Kind::Bent || (flat - curved) / left > CURVES * (QUADRIC - PLANE) as f64 {
                (self.heights, self.n_parameters) = (quadric, QUADRIC);
            }
        }
        Some(())
    }

    fn describe(&mut self, locals: &[Local], normal: f64) {
        let mut sums = [f32x8::ZERO; 6];
        let mut passes = [(0.0, 0.0); N_PASSES];
        for l in locals {
            let squared = l.residual * l.residual;
            let share = l.weight * l.variance;
            let terms = [
                l.share * squared.fast_min(f32x8::splat(REJECTED * REJECTED)),
                l.share,
                share,
                share * share,
                share * squared,
                share * l.variance,
            ];
            add(&mut sums, terms);
            let off = share * l.residual * l.variance.sqrt();
            for (pass, (share, off)) in l
                .pass
                .iter()
                .zip(share.to_array().iter().zip(off.to_array()))
            {
                let (of_pass, of_residuals) = &mut passes[usize::from(*pass) % N_PASSES];
                *of_pass += f64::from(*share);
                *of_residuals += f64::from(off);
            }
        }
        let [cost, weight, sum, squares, weighted, variances] = sums.map(total);
        (self.cost, self.weight) = (cost, weight.max(f64::MIN_POSITIVE));
        if sum <= 0.0 {
            return;
        }
        let parameters = self.n_parameters as f64;
        self.n_points = sum * sum / squares;
        let freedom = (1.0 - parameters / self.n_points).max(0.1);
        self.scale = weighted / sum / normal / freedom;
        let mean = variances / sum;
        let doubt = (2.0 / self.n_points).sqrt();
        self.roughness = (self.scale - 1.0 - doubt).max(0.0) * mean;
        let seen = || passes.iter().filter(|(w, _)| *w > 0.0);
        self.n_passes = sum * sum / seen().map(|(w, _)| w * w).sum::<f64>();
        let spread = self.scale.max(1.0) * mean;
        // What the mean of a pass is off beyond the noise of its points is the trajectory's.
        let between: f64 = seen().map(|(w, r)| r * r / w).sum();
        let shared = ((between - seen().count() as f64 * spread) / sum).max(0.0);
        self.variance = parameters * spread / self.n_points + shared / self.n_passes;
    }

    pub(crate) fn is_bent(&self) -> bool {
        self.n_parameters == QUADRIC
    }

    /// By how many standard deviations the residuals are larger than noise makes them.
    pub(crate) fn excess(&self) -> f64 {
        (self.cost / self.weight - 1.0) / (2.0 / self.n_points.max(1.0)).sqrt()
    }

    /// Finds the residuals over their standard deviations, and the largest one.
    fn normalize(&self, locals: &mut [Local]) -> f32 {
        let h: [f32x8; QUADRIC] = std::array::from_fn(|k| f32x8::splat(self.heights[k] as f32));
        let per_metre = 1.0 / self.radius as f32;
        let mut largest = f32x8::ZERO;
        for l in locals {
            let (u, v) = (l.u, l.v);
            let (bend_u, bend_v, twist) = (h[3] * u, h[5] * v, h[4] * v);
            let height = l.height - (h[0] + u * (h[1] + bend_u + twist) + v * (h[2] + bend_v));
            let du = (h[1] + bend_u + bend_u + twist) * per_metre;
            let dv = (h[2] + h[4] * u + bend_v + bend_v) * per_metre;
            let norm = (1.0 + du * du + dv * dv).sqrt();
            let along = (l.beam[2] - du * l.beam[0] - dv * l.beam[1]).abs();
            l.residual = height / (along.fast_max(GRAZING * norm) * l.sigma);
            largest = largest.fast_max(l.residual.abs() * l.is);
        }
        largest.to_array().into_iter().fold(0.0, f32::max)
    }

    /// What each spot costs: its residual squared, at most that of one that counts no more.
    pub(crate) fn costs(&self, spots: &[Spot], room: &mut Room) -> Vec<f32> {
        self.put(spots, &mut room.locals);
        self.normalize(&mut room.locals);
        let cost = |r: f32| (r * r).min(REJECTED * REJECTED);
        let locals = room.locals.iter();
        let mut costs: Vec<f32> = locals
            .flat_map(|l| l.residual.to_array().map(cost))
            .collect();
        costs.truncate(spots.len());
        costs
    }

    /// Height of the middle over the plane that touches the sheet beside it, m.
    pub(crate) fn height_of_middle(&self) -> f64 {
        -self.heights[0] * self.axes.row(2).transpose().dot(&self.normal)
    }
}

/// Tukey's weights by the residuals of the first `n` spots.
fn reweight(locals: &mut [Local], n: usize, sizes: &mut Vec<f32>) {
    sizes.clear();
    for l in &*locals {
        sizes.extend(l.residual.abs().to_array());
    }
    sizes.truncate(n);
    let median = *sizes.select_nth_unstable_by(n / 2, f32::total_cmp).1;
    let per_scale = 1.0 / (REJECTED * (MAD_TO_STD * median).max(1.0));
    for l in locals {
        let x = l.residual * per_scale;
        let kept = (1.0 - x * x).fast_max(f32x8::ZERO);
        l.weight = l.share / l.variance * kept * kept;
    }
}

/// Axes whose third one is the normal.
fn frame(normal: &Vector3<f64>) -> Matrix3<f64> {
    let [u, v] = so3::orthogonal_pair(normal);
    Matrix3::from_rows(&[u.transpose(), v.transpose(), normal.transpose()])
}

/// Where the product of two of the terms 1, u, v, u², uv, v² is among the sums.
const PLACES: [[usize; 6]; 6] = [
    [0, 1, 2, 3, 4, 5],
    [1, 3, 4, 6, 7, 8],
    [2, 4, 5, 7, 8, 9],
    [3, 6, 7, 10, 11, 12],
    [4, 7, 8, 11, 12, 13],
    [5, 8, 9, 12, 13, 14],
];

/// Normal equations of heights.
struct Sums {
    /// Of the weights.
    n: f64,
    matrix: Matrix6<f64>,
    right: Vector6<f64>,
    squares: f64,
}

impl Sums {
    fn of(locals: &[Local]) -> Self {
        let (mut a, mut b) = ([f32x8::ZERO; 15], [f32x8::ZERO; 6]);
        let mut others = [f32x8::ZERO; 2];
        for l in locals {
            let (p, q, h, w) = (l.u, l.v, l.height, l.weight);
            let (wp, wq, pp, qq) = (w * p, w * q, p * p, q * q);
            let (wpp, wpq, wqq) = (wp * p, wp * q, wq * q);
            let cubes = [wpp * p, wpp * q, wpq * q, wqq * q];
            let fourths = [wpp * pp, wpq * pp, wpp * qq, wpq * qq, wqq * qq];
            let [c0, c1, c2, c3] = cubes;
            let [f0, f1, f2, f3, f4] = fourths;
            add(
                &mut a,
                [w, wp, wq, wpp, wpq, wqq, c0, c1, c2, c3, f0, f1, f2, f3, f4],
            );
            let wh = w * h;
            add(&mut b, [wh, wp * h, wq * h, wpp * h, wpq * h, wqq * h]);
            add(&mut others, [wh * h, l.share]);
        }
        let (a, [squares, n]) = (a.map(total), others.map(total));
        Self {
            n,
            matrix: Matrix6::from_fn(|i, j| a[PLACES[i][j]]),
            right: Vector6::from(b.map(total)),
            squares,
        }
    }

    /// Whether the points fix the directions of a plane.
    fn is_wide(&self) -> bool {
        let w = self.matrix[(0, 0)];
        if w <= 0.0 {
            return false;
        }
        let m = &self.matrix;
        let (mu, mv) = (m[(0, 1)] / w, m[(0, 2)] / w);
        let (uu, uv, vv) = (
            m[(1, 1)] / w - mu * mu,
            m[(1, 2)] / w - mu * mv,
            m[(2, 2)] / w - mv * mv,
        );
        let half = 0.5 * (uu + vv);
        let smaller = half - (0.25 * (uu - vv) * (uu - vv) + uv * uv).sqrt();
        smaller > (2.0 * MIN_WIDTH) * (2.0 * MIN_WIDTH)
    }

    fn height(&self) -> Option<f64> {
        let weight = self.matrix[(0, 0)];
        (weight > 0.0).then(|| self.right[0] / weight)
    }

    fn plane(&self) -> Option<Vector6<f64>> {
        let a: Matrix3<f64> = self.matrix.fixed_view::<3, 3>(0, 0).into_owned();
        let b = self.right.fixed_rows::<3>(0).into_owned();
        let found = a.cholesky()?.solve(&b);
        Some(Vector6::new(found[0], found[1], found[2], 0.0, 0.0, 0.0))
    }

    fn quadric(&self) -> Option<Vector6<f64>> {
        Some(self.matrix.cholesky()?.solve(&self.right))
    }

    fn misfit(&self, h: &Vector6<f64>) -> f64 {
        (self.squares - h.dot(&self.right)).max(0.0)
    }
}
