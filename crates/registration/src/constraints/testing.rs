// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scenes with large angles and the comparison of Jacobians with central differences.

use bentwing_surfels::SurfelSet;
use bentwing_trajectory::{
    CorrectionSpline, Head, InertialUnit, LidarClock, Motor, MotorErrors, RangeBias, Trajectory,
    so3,
};
use nalgebra::{Isometry3, Matrix3, Vector3};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

use crate::{Globals, ImuNoise, N_GLOBALS, NormalEquations, RowGroup, Settings};

pub fn settings() -> Settings {
    Settings {
        knot_interval: 0.2,
        range_sigma: 0.01,
        n_neighbors: 2,
        max_match_distance: 1.0,
        min_match_gap: 0.3,
        first_cauchy_scale: 3.0,
        cauchy_scale: 1.0,
        max_outer: 5,
        n_inner: 2,
        min_translation: 5e-4,
        min_rotation: 2e-5,
        velocity_sigma: 0.5,
        rate_sigma: 0.5,
        imu_noise: ImuNoise {
            gyro: 5e-3,
            accel: 8e-3,
        },
        motion_accel_density: 1.5,
        motion_angular_density: 1.0,
    }
}

/// A spinning trajectory of half a second and a motor head, at random large angles.
#[derive(Clone, Debug)]
pub struct Scene {
    pub trajectory: Trajectory,
    pub globals: Globals,
}

fn vector(max: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-max..max).prop_map(Vector3::from)
}

impl Scene {
    pub fn any() -> impl Strategy<Value = Self> {
        (
            vector(7.0),
            vector(2.0),
            vector(3.0),
            vector(1.5),
            vector(1.5),
            vector(2.0),
            0..3_usize,
        )
            .prop_map(
                |(rate, velocity, start, extrinsic, mount, axis, main_axis)| {
                    let pose = |n: i32| {
                        let t = 0.01 * f64::from(n);
                        let wobble = Vector3::new((9.0 * t).sin(), (7.0 * t).cos(), t) * 0.1;
                        (
                            velocity * t + wobble,
                            so3::exp(&start) * so3::exp(&(rate * t + wobble)),
                        )
                    };
                    let (positions, rotations) = (0..51).map(pose).unzip();
                    let motor = Motor {
                        axis: axis.try_normalize(1e-3).unwrap_or_else(Vector3::z),
                        zero: 0.4,
                        T_motor_lidar: Isometry3::new(Vector3::new(0.05, 0.1, -0.02), mount),
                        errors: MotorErrors {
                            eccentricity: [0.01, -0.02],
                            wobble: [[0.01, -0.02, 0.004, 0.01], [0.005, 0.01, -0.01, 0.02]],
                        },
                    };
                    let head = Head {
                        T_imu_base: Isometry3::new(Vector3::new(0.1, -0.2, 0.05), extrinsic),
                        clock: LidarClock {
                            latency: 0.002,
                            rate: 3e-5,
                            epoch: 1.5,
                        },
                        motor: Some(motor),
                        ranges: RangeBias {
                            offset: 0.02,
                            grazing: 1e-3,
                        },
                    };
                    let unit = InertialUnit {
                        gyro_bias: Vector3::new(0.01, 0.02, -0.03),
                        accel_bias: Vector3::new(0.1, -0.05, 0.02),
                        gyro: Matrix3::new(0.03, 0.05, 0.0, 0.05, -0.04, 0.0, 0.06, -0.02, 0.01),
                        g_sensitivity: Matrix3::new(3.0, -1.0, 2.0, 1.0, 4.0, -2.0, 0.5, 1.5, -3.0)
                            * 1e-3,
                        accel: Matrix3::new(
                            0.02, -0.05, 0.04, 0.01, 0.03, -0.02, 0.05, 0.02, -0.01,
                        ),
                        reference: Vector3::new(0.5, -0.3, 9.6),
                        main_axis,
                    };
                    let globals = Globals {
                        head,
                        unit,
                        gravity: Vector3::new(0.1, -0.05, 9.8),
                    };
                    let trajectory = Trajectory::new(2.0, 0.01, positions, rotations).unwrap();
                    Self {
                        trajectory,
                        globals,
                    }
                },
            )
    }

    /// A second of motion with a pause of `seconds`.
    pub fn still_for(seconds: f64) -> Trajectory {
        let moved = |n: i32| {
            (0.01 * f64::from(n)).min(0.3) + (0.01 * f64::from(n) - 0.3 - seconds).max(0.0)
        };
        let positions = (0..101).map(|n| Vector3::x() * moved(n)).collect();
        Trajectory::new(0.0, 0.01, positions, vec![so3::exp(&Vector3::zeros()); 101]).unwrap()
    }

    pub fn spline(&self) -> CorrectionSpline {
        CorrectionSpline::covering(self.trajectory.start(), self.trajectory.end(), 0.2)
    }

    /// Eight surfels; their times lie inside an interval of the trajectory, where the
    /// interpolation is differentiable.
    pub fn surfels() -> SurfelSet {
        let f = f64::from;
        SurfelSet {
            means: (0..8)
                .map(|i| Vector3::new(3.0 + f(i), -2.0, 0.5 * f(i)))
                .collect(),
            covariances: vec![Matrix3::identity(); 8],
            normals: vec![Vector3::x(); 8],
            stamps: (0..8).map(|i| 2.0 + 0.002 + 0.05 * f(i) + 0.005).collect(),
            angles: (0..8).map(|i| 0.9 * f(i)).collect(),
            n_points: vec![10; 8],
            level_starts: vec![0, 8],
            voxel_sizes: vec![0.4],
        }
    }

    /// A correction of one control point or global state.
    fn step(&self, unknown: usize, size: f64) -> (Vec<[f64; 6]>, Globals) {
        let mut controls = vec![[0.0; 6]; self.spline().n_controls()];
        let mut globals = self.globals.clone();
        if let Some(global) = unknown.checked_sub(6 * controls.len()) {
            let mut delta = [0.0; N_GLOBALS];
            delta[global] = size;
            globals.correct(&delta);
        } else {
            controls[unknown / 6][unknown % 6] = size;
        }
        (controls, globals)
    }

    /// The trajectory with a correction composed into its samples.
    fn corrected(&self, controls: &[[f64; 6]]) -> Trajectory {
        let spline = self.spline();
        let mut trajectory = self.trajectory.clone();
        let correction = |n| spline.evaluate(controls, self.trajectory.time(n));
        let corrections: Vec<_> = (0..trajectory.len()).map(correction).collect();
        trajectory.correct(&corrections);
        trajectory
    }

    /// Central differences of `residuals` by every unknown; fourth order, so that a step large
    /// enough against rounding has no error of its own.
    fn derivatives(&self, residuals: impl Fn(&[[f64; 6]], &Globals) -> Vec<f64>) -> Vec<Vec<f64>> {
        let at = |unknown: usize, size: f64| {
            let (controls, globals) = self.step(unknown, size);
            residuals(&controls, &globals)
        };
        let h = 1e-3;
        let derivative = |u: usize| {
            let [a, b, c, d] = [at(u, -2.0 * h), at(u, -h), at(u, h), at(u, 2.0 * h)];
            (0..a.len())
                .map(|i| (a[i] - 8.0 * b[i] + 8.0 * c[i] - d[i]) / (12.0 * h))
                .collect()
        };
        (0..6 * self.spline().n_controls() + N_GLOBALS)
            .map(derivative)
            .collect()
    }
}

/// Checks the single row held by `group` against central differences of `residual`.
pub fn assert_row(
    scene: &Scene,
    group: &RowGroup,
    residual: impl Fn(&[[f64; 6]], &Globals) -> f64,
) -> Result<(), TestCaseError> {
    let mut group = group.clone();
    group.add(1.0, 1.0);
    let mut equations = NormalEquations::new(scene.spline().n_controls());
    group.flush(&mut equations);
    let numeric = scene.derivatives(|c, g| vec![residual(c, g)]);
    let numeric: Vec<f64> = numeric.iter().map(|d| d[0]).collect();
    compare(&gradient_of(&equations), &numeric)
}

/// Checks rows by the gradient and the diagonal of the information that they add up to.
pub fn assert_rows(
    scene: &Scene,
    add: impl Fn(&mut NormalEquations),
    residuals: impl Fn(&Trajectory, &Globals) -> Vec<f64>,
) -> Result<(), TestCaseError> {
    let mut equations = NormalEquations::new(scene.spline().n_controls());
    add(&mut equations);
    let numeric = scene.derivatives(|c, g| residuals(&scene.corrected(c), g));
    let r = residuals(&scene.trajectory, &scene.globals);
    let gradient = numeric
        .iter()
        .map(|d| d.iter().zip(&r).map(|(d, r)| d * r).sum());
    compare(&gradient_of(&equations), &gradient.collect::<Vec<f64>>())?;
    let diagonal = numeric.iter().map(|d| d.iter().map(|d| d * d).sum());
    compare(&diagonal_of(&equations), &diagonal.collect::<Vec<f64>>())
}

fn gradient_of(equations: &NormalEquations) -> Vec<f64> {
    let knots = (0..equations.n_controls()).flat_map(|k| *equations.knot_gradient(k));
    knots.chain(equations.global_gradient).collect()
}

fn diagonal_of(equations: &NormalEquations) -> Vec<f64> {
    let knot = |k: usize| (0..6).map(move |i| (k, i));
    let knots = (0..equations.n_controls()).flat_map(knot);
    let knots = knots.map(|(k, i)| equations.diagonal(k)[i]);
    knots
        .chain((0..N_GLOBALS).map(|g| equations.corner()[(g, g)]))
        .collect()
}

/// Agreement to 1e-6 of the largest entry.
fn compare(analytic: &[f64], numeric: &[f64]) -> Result<(), TestCaseError> {
    let scale = numeric.iter().fold(1e-3_f64, |m, v| m.max(v.abs()));
    for (i, (a, n)) in analytic.iter().zip(numeric).enumerate() {
        prop_assert!((a - n).abs() < 1e-6 * scale, "unknown {i}: {a} against {n}");
    }
    Ok(())
}
