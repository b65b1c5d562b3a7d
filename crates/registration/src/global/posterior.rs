// SPDX-License-Identifier: MIT OR Apache-2.0
//! How certain the poses and the global states of a global registration are.
//!
//! Steps are smooth over the knots of a registration, but what the IMU does not know of the poses walks at
//! random: where the lidar sees little, as before a head turns, stiff knots would be sure of what they
//! cannot follow. So the equations are made once more with knots as close as those of the windows.
//!
//! The slow states are asked of them too: they, and what the IMU's noise does, explain each other.
//!
//! Their inverse would be the covariance if all rows erred as their weights say. The IMU's noise shows
//! itself larger or smaller, and matches scatter other than stated: `H⁻¹ M H⁻¹` (Huber 1967).

use std::f64::consts::PI;

use bentwing_trajectory::{CorrectionSpline, Trajectory};
use faer::Mat;
use nalgebra::{Matrix6, Vector3};

use super::gather::Gatherer;
use super::joint::Joint;
use super::problem::GlobalProblem;
use crate::state::State;
use crate::system::solve::Factorized;
use crate::{
    GlobalMatrix, Health, ImuNoise, N_GLOBALS, NormalEquations, Settings, SolveError, Solver,
};

/// Poses that are solved for together: of all pairs among them only the diagonal is used.
const TOGETHER: usize = 8;

/// The equations of the last iteration, with closer knots; whoever asks pays for the covariances.
#[derive(Clone, Debug)]
pub struct GlobalPosterior {
    factorized: Factorized,
    /// Variance of the other rows' gradient, less that of as many matches.
    excess: NormalEquations,
    /// Variance of matches over the one that their weights state.
    match_variance: f64,
    /// Spline and first control point of each piece.
    splines: Vec<(CorrectionSpline, usize)>,
    n_controls: usize,
    /// First stand-in of each piece's global states, and which of them are frozen.
    globals: Vec<(usize, [bool; N_GLOBALS])>,
    /// Variances `[δr, δt]` of what is faster than the knots, of each piece.
    fast: Vec<[f64; 2]>,
}

impl GlobalPosterior {
    /// What the matches of a settled registration say once more, how they fit, and how much they scatter.
    pub(super) fn new(
        problem: &GlobalProblem<'_>,
        states: &[State<'_>],
        gatherer: &mut Gatherer,
        settings: &Settings,
    ) -> Result<(Self, Health, f64), SolveError> {
        let knot_interval = problem.plan.posterior_interval.min(settings.knot_interval);
        let settings = &Settings {
            knot_interval,
            ..settings.clone()
        };
        for state in states {
            settings.require_dense(&state.trajectory)?;
        }
        let states = states.iter().map(|s| s.with_knots(knot_interval));
        let mut states: Vec<State<'_>> = states.collect();
        for (state, piece) in states.iter_mut().zip(&problem.pieces) {
            for (frozen, doubted) in state.frozen.iter_mut().zip(piece.doubted) {
                *frozen &= !doubted;
            }
        }
        let joint = Joint::new(&states);
        let n_controls = joint.n_controls();
        let mut equations = NormalEquations::new(n_controls);
        let mut excess = NormalEquations::new(n_controls);
        for (number, (state, piece)) in states.iter_mut().zip(&problem.pieces).enumerate() {
            let first = Some(piece.first_pose(number == 0));
            let rows = state.fixed_rows(first, settings);
            joint.add_piece(&mut equations, number, &rows);
            let rows = state.noisy_rows(first, settings, &piece.shown_noise);
            joint.add_piece(&mut excess, number, &rows);
        }
        let fixed = equations.clone();
        let (health, dispersion) =
            gatherer.judge(&mut equations, &joint, &states, settings.cauchy_scale);
        let match_variance = variance_of(dispersion);
        excess.take_away(match_variance, &fixed);
        joint.freeze(&mut equations, &states);
        joint.freeze(&mut excess, &states);
        let posterior = Self {
            factorized: Solver::default().factorize(&equations, 0, &[true; N_GLOBALS])?,
            excess,
            match_variance,
            n_controls,
            globals: states
                .iter()
                .enumerate()
                .map(|(piece, s)| (joint.stand_in(piece), s.frozen))
                .collect(),
            fast: problem
                .pieces
                .iter()
                .map(|p| match p.imu {
                    Some(_) => faster(&settings.imu_noise, p.trajectory.dt(), knot_interval),
                    None => [0.0; 2],
                })
                .collect(),
            splines: states
                .into_iter()
                .enumerate()
                .map(|(piece, s)| (s.spline, joint.control(piece, 0)))
                .collect(),
        };
        Ok((posterior, health, dispersion))
    }

    /// Marginal covariances of the correction `[δr, δt]` of a piece at `times`, rad and m, perturbed
    /// on the left in the map frame.
    pub fn at(&self, piece: usize, times: &[f64]) -> Vec<Matrix6<f64>> {
        let add = |rows: &mut Mat<f64>, pose: usize, time: &f64| {
            self.add_pose(rows, pose, piece, *time, &Matrix6::identity());
        };
        self.in_groups(times, add, self.fast[piece])
    }

    /// Covariances of the correction at the second of two times as seen from the pose at the first.
    pub fn since(
        &self,
        piece: usize,
        trajectory: &Trajectory,
        pairs: &[[f64; 2]],
    ) -> Vec<Matrix6<f64>> {
        let add = |rows: &mut Mat<f64>, pose: usize, [first, second]: &[f64; 2]| {
            let apart = trajectory.pose(*second).p - trajectory.pose(*first).p;
            self.add_pose(rows, pose, piece, *second, &Matrix6::identity());
            self.add_pose(rows, pose, piece, *first, &-carrying(&apart));
        };
        self.in_groups(pairs, add, self.fast[piece].map(|v| 2.0 * v))
    }

    /// Covariance of the global states of a piece; zero where frozen.
    pub fn globals(&self, piece: usize) -> GlobalMatrix {
        let (first, frozen) = &self.globals[piece];
        let free: Vec<usize> = (0..N_GLOBALS).filter(|&i| !frozen[i]).collect();
        let mut rows = Mat::<f64>::zeros(6 * self.n_controls + N_GLOBALS, free.len());
        for (column, i) in free.iter().enumerate() {
            rows[(6 * first + i, column)] = 1.0;
        }
        let known = self
            .factorized
            .sandwich_of(&rows, self.match_variance, &self.excess);
        let mut covariance = GlobalMatrix::zeros();
        for (r, &i) in free.iter().enumerate() {
            for (c, &j) in free.iter().enumerate() {
                covariance[(i, j)] = known[(r, c)];
            }
        }
        covariance
    }

    fn in_groups<T>(
        &self,
        poses: &[T],
        add: impl Fn(&mut Mat<f64>, usize, &T),
        [turn, shift]: [f64; 2],
    ) -> Vec<Matrix6<f64>> {
        let fast = Matrix6::from_diagonal(&[turn, turn, turn, shift, shift, shift].into());
        let of_group = |group: &[T]| {
            let n_rows = 6 * self.n_controls + N_GLOBALS;
            let mut rows = Mat::<f64>::zeros(n_rows, 6 * group.len());
            for (pose, of_pose) in group.iter().enumerate() {
                add(&mut rows, pose, of_pose);
            }
            let joint = self
                .factorized
                .sandwich_of(&rows, self.match_variance, &self.excess);
            let block = move |k: usize| joint.fixed_view::<6, 6>(6 * k, 6 * k) + fast;
            (0..group.len()).map(block).collect::<Vec<_>>()
        };
        poses.chunks(TOGETHER).flat_map(of_group).collect()
    }

    /// Adds `effect` of the correction at a time to the columns of a pose.
    fn add_pose(
        &self,
        rows: &mut Mat<f64>,
        pose: usize,
        piece: usize,
        time: f64,
        effect: &Matrix6<f64>,
    ) {
        let (spline, first) = &self.splines[piece];
        let basis = spline.basis(time);
        for (k, w) in basis.weights.iter().enumerate() {
            for i in 0..6 {
                for j in 0..6 {
                    rows[(6 * (first + basis.first + k) + i, 6 * pose + j)] += w * effect[(j, i)];
                }
            }
        }
    }
}

/// Variance of matches over what their weights state. Residuals show too little of it, for the solution
/// has followed them, and what is stated is too much, for surfels average: the truth lies between.
/// Residuals above what is stated count in full.
fn variance_of(dispersion: f64) -> f64 {
    dispersion.max(0.5 * (1.0 + dispersion))
}

/// What a correction of one pose makes of another one that is fixed to it.
fn carrying(apart: &Vector3<f64>) -> Matrix6<f64> {
    let mut effect = Matrix6::identity();
    let across = -apart.cross_matrix();
    effect.fixed_view_mut::<3, 3>(3, 0).copy_from(&across);
    effect
}

/// Variances of rotation and position, rad² and m², that the white noise of an IMU makes faster than knots
/// can follow: `∫ S(ω) dω / π` from `π / h` on, with `S = N² / ω²` of a turn and `N² / ω⁴` of a way.
fn faster(noise: &ImuNoise, dt: f64, interval: f64) -> [f64; 2] {
    let [gyro, accel] = [noise.gyro, noise.accel].map(|sigma| sigma * sigma * dt);
    [
        gyro * interval / PI.powi(2),
        accel * interval.powi(3) / (3.0 * PI.powi(4)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matches_err_by_no_less_than_they_show_and_half_of_what_is_stated() {
        assert_eq!(variance_of(0.0), 0.5);
        assert_eq!(variance_of(1.0), 1.0);
        assert_eq!(variance_of(7.0), 7.0);
    }

    #[test]
    fn a_turn_moves_what_is_fixed_at_a_distance() {
        let apart = Vector3::new(2.0, 0.0, 0.0);
        let turn = nalgebra::Vector6::new(0.0, 0.0, 1e-3, 0.0, 0.0, 0.0);
        let moved = carrying(&apart) * turn;
        assert!((moved[4] - 2e-3).abs() < 1e-15, "{moved}");
    }

    /// Means over all phases of a walk at random less its best piecewise mean are of this order.
    #[test]
    fn what_is_faster_than_the_knots_grows_with_their_interval() {
        let noise = ImuNoise {
            gyro: 0.005,
            accel: 0.1,
        };
        let [fine, coarse] = [0.2, 0.4].map(|h| faster(&noise, 0.01, h));
        assert!((coarse[0] / fine[0] - 2.0).abs() < 1e-12);
        assert!((coarse[1] / fine[1] - 8.0).abs() < 1e-12);
        // 0.5 mrad/√s over 0.2 s: a tenth of the square of a walk over the interval.
        assert!((fine[0] / (0.0005_f64.powi(2) * 0.2) - 0.101).abs() < 1e-3);
    }
}
