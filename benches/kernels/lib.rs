// SPDX-License-Identifier: MIT OR Apache-2.0
//! Data for the benches, made from a fixed seed: scanners that fly through a hall with pillars.
#![forbid(unsafe_code)]

mod chain;
pub mod defaults;
mod features;
mod hall;
pub mod npy;
mod window;

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use bentwing_registration::{Globals, Settings as Registration};
use bentwing_surfels::{Points, SurfelSet};
use bentwing_trajectory::{Head, Imu, InertialUnit, LidarClock, RangeBias, Trajectory, so3};
pub use chain::chain;
pub use features::Features;
pub use window::prior;

use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};

/// Interval of the trajectory's samples, s.
pub const DT: f64 = 0.01;
const SPIN: f64 = 5.0; // rad/s
const GRAVITY: f64 = 9.80665;

/// Which scanner measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scanner {
    /// 2D, 40 Hz, 1,081 beams over 270° in a plane that contains the vertical and is spun about it.
    Hokuyo,
    /// 3D, 10 Hz, 16 beams over ±15°, fixed to a carrier that turns slowly.
    Vlp16,
}

/// What a scanner has recorded, and how it moved.
pub struct Flight {
    /// Returns, m, lidar frame.
    pub points: Vec<[f64; 3]>,
    /// Their stamps, s.
    pub stamps: Vec<f64>,
    /// Poses of the IMU with a small drift, as a prior has it.
    pub trajectory: Trajectory,
    /// Inertial samples.
    pub imu: Imu,
    /// The slow states.
    pub globals: Globals,
    scanner: Scanner,
}

impl Scanner {
    /// Flies for some seconds.
    pub fn fly(self, seconds: f64) -> Flight {
        let mut random = Random(1);
        let mut points = Vec::new();
        let mut stamps = Vec::new();
        for (time, beam) in self.beams(seconds) {
            let (p, R) = self.pose(time);
            let range = hall::range(&p, &(R * (self.mount() * beam)));
            if range < self.max_range() {
                points.push((beam * (range + self.sigma() * random.normal())).into());
                stamps.push(time);
            }
        }
        Flight {
            points,
            stamps,
            trajectory: self.drifted(seconds),
            imu: self.inertial(seconds),
            globals: Globals {
                head: Head {
                    T_imu_base: self.mount() * Isometry3::identity(),
                    clock: LidarClock::default(),
                    motor: None,
                    ranges: RangeBias::default(),
                },
                unit: InertialUnit::ideal(),
                gravity: Vector3::z() * GRAVITY,
            },
            scanner: self,
        }
    }

    /// Standard deviation of a range, m.
    pub fn sigma(self) -> f64 {
        match self {
            Self::Hokuyo => 0.01,
            Self::Vlp16 => 0.02,
        }
    }

    fn max_range(self) -> f64 {
        match self {
            Self::Hokuyo => 30.0,
            Self::Vlp16 => 100.0,
        }
    }

    /// The Hokuyo's centre beam looks down.
    fn mount(self) -> UnitQuaternion<f64> {
        let R = match self {
            Self::Hokuyo => Matrix3::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0),
            Self::Vlp16 => Matrix3::identity(),
        };
        so3::of_matrix(R)
    }

    /// Times and directions in the lidar frame.
    fn beams(self, seconds: f64) -> Vec<(f64, Vector3<f64>)> {
        match self {
            Self::Hokuyo => (0..(seconds * 40.0 * 1081.0) as u64)
                .map(|i| {
                    let (scan, beam) = (i / 1081, (i % 1081) as f64);
                    let angle = (beam * 0.25 - 135.0) * PI / 180.0;
                    let time = scan as f64 * 0.025 + beam * 0.025 / 1440.0;
                    (time, Vector3::new(angle.cos(), angle.sin(), 0.0))
                })
                .collect(),
            Self::Vlp16 => (0..(seconds * 289_000.0) as u64)
                .map(|i| {
                    let time = i as f64 / 289_000.0;
                    let azimuth = -TAU * 10.0 * time;
                    let elevation = ((i % 16) as f64 * 2.0 - 15.0) * PI / 180.0;
                    let level = elevation.cos();
                    let (sin, cos) = azimuth.sin_cos();
                    (
                        time,
                        Vector3::new(level * cos, level * sin, elevation.sin()),
                    )
                })
                .collect(),
        }
    }

    fn pose(self, t: f64) -> (Vector3<f64>, UnitQuaternion<f64>) {
        let p = Vector3::new(
            4.0 * (0.25 * t).sin(),
            2.0 * (0.4 * t).cos(),
            0.3 * (0.5 * t).sin(),
        );
        let tilt = Vector3::new(0.05 * (1.1 * t).sin(), 0.04 * (0.9 * t).cos(), 0.0);
        (
            p,
            so3::exp(&tilt) * so3::exp(&(Vector3::z() * (self.turn_rate() * t))),
        )
    }

    fn turn_rate(self) -> f64 {
        match self {
            Self::Hokuyo => SPIN,
            Self::Vlp16 => 0.3,
        }
    }

    fn drifted(self, seconds: f64) -> Trajectory {
        let n = ((seconds + 0.05) / DT) as usize + 1;
        let sample = |i: usize| {
            let t = i as f64 * DT;
            let (p, R) = self.pose(t);
            let share = t / seconds;
            let drift = Vector3::new(0.02, -0.015, 0.01) * share;
            (
                p + drift,
                so3::exp(&(Vector3::new(0.001, 0.002, 0.004) * share)) * R,
            )
        };
        let (positions, rotations) = (0..n).map(sample).unzip();
        Trajectory::new(0.0, DT, positions, rotations).expect("more than two samples")
    }

    /// Central differences of the pose, which are exact enough for a bench.
    fn inertial(self, seconds: f64) -> Imu {
        let (rate, h) = (200.0, 1e-3);
        let times: Vec<f64> = (-20..((seconds + 0.3) * rate) as i32)
            .map(|k| f64::from(k) / rate)
            .collect();
        let gyro = |&t: &f64| {
            let (before, after) = (self.pose(t - h).1, self.pose(t + h).1);
            (before.inverse() * after).scaled_axis() / (2.0 * h)
        };
        let accel = |&t: &f64| {
            let [a, b, c] = [t - h, t, t + h].map(|t| self.pose(t).0);
            let up = Vector3::z() * GRAVITY;
            self.pose(t).1.inverse() * ((a - 2.0 * b + c) / (h * h) + up)
        };
        let (gyro, accel) = (
            times.iter().map(gyro).collect(),
            times.iter().map(accel).collect(),
        );
        Imu::new(times, gyro, accel)
    }
}

impl Flight {
    /// Surfels of each second, as the estimator makes them.
    pub fn surfels(&self) -> Vec<Arc<SurfelSet>> {
        let end = self.stamps.last().map_or(0.0, |t| t.ceil()) as usize;
        let second = |s: usize| {
            let at = |t: usize| self.stamps.partition_point(|&x| x < t as f64);
            let part = at(s)..at(s + 1);
            let points = Points {
                points: &self.points[part.clone()],
                stamps: &self.stamps[part],
                angles: &[],
            };
            let settings = defaults::surfels(self.scanner.sigma());
            Arc::new(bentwing_surfels::extract(
                points,
                &self.trajectory,
                &self.globals.head,
                &settings,
            ))
        };
        (0..end).map(second).collect()
    }

    /// Settings of the registration for this scanner.
    pub fn settings(&self) -> Registration {
        defaults::registration(self.scanner.sigma())
    }
}

/// Machines swing; one thread swings least.
///
/// # Panics
/// When the operating system gives no thread.
pub fn one_thread() -> rayon::ThreadPool {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.expect("one thread")
}

/// Pseudo-random numbers (splitmix64), the same on every machine.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64
    }

    /// Sum of twelve: normal enough, with mean zero and variance one.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}
