// SPDX-License-Identifier: MIT OR Apache-2.0
//! One smooth piece of surface through noisy points: a plane, or a quadric where it curves.

use bentwing_trajectory::so3;
use bentwing_voxels::{MIN_WIDTH, Moments};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// Passes are told apart by so many bins.
pub(crate) const N_PASSES: usize = 64;
/// Residuals of so many standard deviations count no more (Tukey).
const REJECTED: f64 = 4.685;
/// Mean square of normal residuals by these weights.
const TUKEY_VARIANCE: f64 = 0.829;
/// Standard deviation of a normal distribution over its median absolute value.
const MAD_TO_STD: f64 = 1.4826;
const ROUNDS: usize = 2;
/// Where no residual is larger, none needs less weight.
const CLEAN: f64 = 3.75;
/// Slope from which on the frame is turned to the plane that was found.
const STEEP: f64 = 0.1;
/// Slope at the edge from which on a surface bends otherwise than a quadric: a cylinder of which more is
/// taken looks too thin. Then less is taken, but not less than this share of the radius.
const STEEPEST: f64 = 0.8;
const NARROWEST: f64 = 0.5;
const PLANE: usize = 3;
const QUADRIC: usize = 6;
/// A surface cannot be told from another one that a beam meets at less than this cosine.
pub(crate) const GRAZING: f64 = 0.05;
/// Price of a parameter.
const CURVES: f64 = 2.0;

/// A point near the middle of a piece.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spot {
    /// From the middle, m.
    pub at: Vector3<f64>,
    /// Unit direction of the beam.
    pub beam: Vector3<f64>,
    /// Of the range, m.
    pub sigma: f64,
    pub pass: u8,
}

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

/// A spot in the axes of a sheet.
#[derive(Clone, Copy, Debug)]
struct Local {
    u: f64,
    v: f64,
    height: f64,
    beam: Vector3<f64>,
    sigma: f64,
    /// By its distance, and this over the variance across.
    weight: f64,
    inverse: f64,
}

impl Sheet {
    /// The sheet through spots, if they have one; `normal` is a guess.
    pub(crate) fn fit(spots: &[Spot], radius: f64, normal: &Vector3<f64>) -> Option<Self> {
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
        let mut locals = sheet.locals(spots);
        let mut weights: Vec<f64> = locals.iter().map(|l| l.inverse).collect();
        let mut sums = Sums::of(&locals, &weights);
        let first = sums.plane()?;
        if first.fixed_rows::<2>(1).norm() > STEEP * radius {
            sheet.turn(&first);
            locals = sheet.locals(spots);
            weights.clear();
            weights.extend(locals.iter().map(|l| l.inverse));
            sums = Sums::of(&locals, &weights);
        }
        let narrower = sheet.narrower(&sums);
        if let Some(radius) = narrower {
            sheet.radius = radius;
            locals = sheet.locals(spots);
            weights.clear();
            weights.extend(locals.iter().map(|l| l.inverse));
            sums = Sums::of(&locals, &weights);
        }
        let mut residuals = vec![0.0; locals.len()];
        let mut robust = false;
        for round in 0.. {
            if !sums.is_wide() {
                return None;
            }
            sheet.choose(&sums, narrower.is_some())?;
            for (r, l) in residuals.iter_mut().zip(&locals) {
                *r = sheet.normalized(l);
            }
            if round == ROUNDS || !robust && residuals.iter().all(|r| r.abs() < CLEAN) {
                break;
            }
            reweight(&locals, &residuals, &mut weights);
            robust = true;
            sums = Sums::of(&locals, &weights);
        }
        sheet.face();
        let variance = if robust { TUKEY_VARIANCE } else { 1.0 };
        sheet.describe(spots, &locals, &weights, &residuals, variance);
        Some(sheet)
    }

    fn locals(&self, spots: &[Spot]) -> Vec<Local> {
        let (axes, per_metre) = (&self.axes, 1.0 / self.radius);
        let local = |s: &Spot| {
            let (at, beam) = (axes * s.at, axes * s.beam);
            let across = beam[2].abs().max(GRAZING) * s.sigma;
            let (u, v) = (at[0] * per_metre, at[1] * per_metre);
            // By the distance along the surface alone: by that across it, what the noise brings nearer to
            // the middle would count more, and draw the surface there.
            let share = (1.0 - u * u - v * v).max(0.0);
            let weight = share * share;
            Local {
                u,
                v,
                height: at[2],
                beam,
                sigma: s.sigma,
                weight,
                inverse: weight / (across * across),
            }
        };
        spots.iter().map(local).collect()
    }

    /// Turns the axes to a plane.
    fn turn(&mut self, plane: &Vector6<f64>) {
        let up = Vector3::new(-plane[1] / self.radius, -plane[2] / self.radius, 1.0);
        self.normal = (self.axes.transpose() * up).normalize();
        self.axes = frame(&self.normal);
    }

    /// The radius within which a quadric is no steeper than its kind can follow, if that is smaller.
    fn narrower(&mut self, sums: &Sums) -> Option<f64> {
        self.choose(sums, false)?;
        let h = &self.heights;
        let bend = 0.5 * (h[3] - h[5]).hypot(h[4]) + 0.5 * (h[3] + h[5]).abs();
        let slope = 2.0 * bend / self.radius;
        (slope > STEEPEST).then(|| self.radius * (STEEPEST / slope).max(NARROWEST))
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
    fn choose(&mut self, sums: &Sums, bends: bool) -> Option<()> {
        let plane = sums.plane()?;
        (self.heights, self.n_parameters) = (plane, PLANE);
        let freedom = sums.n - QUADRIC as f64;
        if freedom < QUADRIC as f64 {
            return Some(());
        }
        if let Some(quadric) = sums.quadric() {
            let (flat, curved) = (sums.misfit(&plane), sums.misfit(&quadric));
            let left = (curved / freedom).max(1.0);
            if bends || (flat - curved) / left > CURVES * (QUADRIC - PLANE) as f64 {
                (self.heights, self.n_parameters) = (quadric, QUADRIC);
            }
        }
        Some(())
    }

    fn describe(
        &mut self,
        spots: &[Spot],
        locals: &[Local],
        weights: &[f64],
        residuals: &[f64],
        normal: f64,
    ) {
        let (mut sum, mut squares, mut weighted, mut variances) = (0.0, 0.0, 0.0, 0.0);
        let mut passes = [(0.0, 0.0); N_PASSES];
        for (i, l) in locals.iter().enumerate() {
            let across = l.beam[2].abs().max(GRAZING) * l.sigma;
            let (r, v) = (residuals[i], across * across);
            self.cost += l.weight * (r * r).min(REJECTED * REJECTED);
            self.weight += l.weight;
            let share = weights[i] * v;
            sum += share;
            squares += share * share;
            weighted += share * r * r;
            variances += share * v;
            let (of_pass, of_residuals) = &mut passes[usize::from(spots[i].pass) % N_PASSES];
            *of_pass += share;
            *of_residuals += share * r * v.sqrt();
        }
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

    /// Of a spot.
    pub(crate) fn mean_cost(&self) -> f64 {
        self.cost / self.weight
    }

    /// Residual over its standard deviation.
    fn normalized(&self, l: &Local) -> f64 {
        let h = &self.heights;
        let height =
            l.height - (h[0] + l.u * (h[1] + h[3] * l.u + h[4] * l.v) + l.v * (h[2] + h[5] * l.v));
        let du = (h[1] + 2.0 * h[3] * l.u + h[4] * l.v) / self.radius;
        let dv = (h[2] + h[4] * l.u + 2.0 * h[5] * l.v) / self.radius;
        let norm = (1.0 + du * du + dv * dv).sqrt();
        let cosine = (l.beam[2] - du * l.beam[0] - dv * l.beam[1]).abs() / norm;
        height / (norm * cosine.max(GRAZING) * l.sigma)
    }

    /// As a cost: squared, at most that of a residual that counts no more.
    pub(crate) fn cost_of(&self, s: &Spot) -> f64 {
        let (at, beam) = (self.axes * s.at, self.axes * s.beam);
        let local = Local {
            u: at[0] / self.radius,
            v: at[1] / self.radius,
            height: at[2],
            beam,
            sigma: s.sigma,
            weight: 1.0,
            inverse: 1.0,
        };
        let r = self.normalized(&local);
        (r * r).min(REJECTED * REJECTED)
    }

    /// Height of the middle over the plane that touches the sheet beside it, m.
    pub(crate) fn height_of_middle(&self) -> f64 {
        -self.heights[0] * self.axes.row(2).transpose().dot(&self.normal)
    }
}

/// Tukey's weights by the residuals.
fn reweight(locals: &[Local], residuals: &[f64], weights: &mut [f64]) {
    let mut sizes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
    let half = sizes.len() / 2;
    let median = *sizes.select_nth_unstable_by(half, f64::total_cmp).1;
    let scale = (MAD_TO_STD * median).max(1.0);
    for ((w, l), r) in weights.iter_mut().zip(locals).zip(residuals) {
        let x = r / (REJECTED * scale);
        let share = (1.0 - x * x).max(0.0);
        *w = l.inverse * share * share;
    }
}

/// Axes whose third one is the normal.
fn frame(normal: &Vector3<f64>) -> Matrix3<f64> {
    let [u, v] = so3::orthogonal_pair(normal);
    Matrix3::from_rows(&[u.transpose(), v.transpose(), normal.transpose()])
}

/// The normal of a plane through spots, in whose direction they spread least; it faces the lidar.
pub(crate) fn normal_of(spots: &[Spot]) -> Option<Vector3<f64>> {
    let mut sums = Moments::default();
    let mut beams = Vector3::zeros();
    for s in spots {
        sums.add_point(s.at.into());
        beams += s.beam;
    }
    if sums.n() == 0 {
        return None;
    }
    let normal = sums.eigen().normal;
    Some(if beams.dot(&normal) > 0.0 {
        -normal
    } else {
        normal
    })
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
    fn of(locals: &[Local], weights: &[f64]) -> Self {
        let (mut a, mut b, mut squares, mut n) = ([0.0; 15], [0.0; 6], 0.0, 0.0);
        for (l, &w) in locals.iter().zip(weights) {
            let (p, q, h) = (l.u, l.v, l.height);
            let (pp, pq, qq) = (p * p, p * q, q * q);
            let terms = [
                1.0,
                p,
                q,
                pp,
                pq,
                qq,
                pp * p,
                pp * q,
                p * qq,
                qq * q,
                pp * pp,
                pp * pq,
                pp * qq,
                pq * qq,
                qq * qq,
            ];
            for (sum, t) in a.iter_mut().zip(terms) {
                *sum += w * t;
            }
            let wh = w * h;
            for (sum, t) in b.iter_mut().zip(terms) {
                *sum += wh * t;
            }
            squares += wh * h;
            n += l.weight;
        }
        Self {
            n,
            matrix: Matrix6::from_fn(|i, j| a[PLACES[i][j]]),
            right: Vector6::from(b),
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
