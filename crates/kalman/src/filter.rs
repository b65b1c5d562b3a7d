// SPDX-License-Identifier: MIT OR Apache-2.0
//! The filter: inertial samples carry the state on, sweeps of the lidar correct it.

use bentwing_trajectory::so3;
use bentwing_voxels::thin;
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3};

use crate::drift::Drift;
use crate::error::KalmanError;
use crate::features::{Feature, Sweep, features};
use crate::gain;
use crate::map::{LocalMap, MapSettings};
use crate::measure::{Moment, Mounts, Turning, place};
use crate::nodes::{Node, correct, moment};
use crate::odometry::{HighRate, OdometryPose};
use crate::predict::{Noise, Sample, spread, step, walk};
use crate::state::{DIM, Mounted, Square, State, Tangent, at};
use crate::update::{Fit, Rules, Seen, update};

/// No carrier is faster, m/s.
const MAX_SPEED: f64 = 100.0;
/// Stamps of the lidar may differ from the IMU's clock by this, s: so long nodes are kept.
const MAX_LATENCY: f64 = 0.05;
/// The density of force and rate is unknown while no sample says it: so many times the sensor's.
const BLIND: f64 = 300.0;
/// A velocity of more standard deviations is none of a carrier at rest.
const REST_GATE: f64 = 4.0;
/// Samples farther apart, s, say nothing of the time between them.
const MAX_STEP: f64 = 0.05;

/// What the filter is told once.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Standard deviation of a range, m.
    pub sigma: f64,
    /// Of the inertial samples and the slow states.
    pub noise: Noise,
    /// How the map is kept.
    pub map: MapSettings,
    /// Most features of an update.
    pub max_features: usize,
    /// Least distance between them, m.
    pub spacing: f64,
    /// Most iterations of an update.
    pub max_iterations: usize,
    /// Information of a feature relative to that of an independent one.
    pub independence: f64,
    /// Standard deviation of what the stamps of a sweep are wrong by in common, s.
    pub stamp_jitter: f64,
    /// Whether depth edges take part.
    pub edges: bool,
    /// Axis of the motor, motor frame.
    pub axis: Vector3<f64>,
    /// Between the poses of the trajectory, s.
    pub pose_interval: f64,
    /// Between the poses of the high-rate odometry, s.
    pub odometry_interval: f64,
    /// Its low-pass factor λ; 1 does not smooth.
    pub smoothing: f64,
}

/// What is known at the beginning.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// s.
    pub time: f64,
    /// At that time.
    pub state: State,
    /// Of its tangent; what is known exactly has zeros.
    pub covariance: Square,
}

/// A pose of the IMU in the map.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    /// s.
    pub time: f64,
    /// In the map.
    pub pose: Mounted,
}

/// What became of a sweep.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Of the update; None where too little matched.
    pub fit: Option<Fit>,
    /// Planar and edge features.
    pub n_features: [usize; 2],
    /// Planes in the map.
    pub n_planes: usize,
    /// Share of the features that saw something new.
    pub new_share: f64,
    /// Seconds without inertial samples.
    pub blind: f64,
}

/// The error-state iterated Kalman filter (Fu 2023, section 2.3).
#[derive(Clone, Debug)]
pub struct Filter {
    settings: Settings,
    time: f64,
    state: State,
    P: Square,
    sample: Option<Sample>,
    /// From `MAX_LATENCY` before the last update on.
    nodes: Vec<Node>,
    updated: f64,
    map: LocalMap,
    first: f64,
    poses: Vec<Pose>,
    n_asked: u64,
    odometry: HighRate,
    blind: f64,
    drift: Drift,
}

impl Filter {
    /// A filter that has seen nothing.
    pub fn new(settings: Settings, start: &Start) -> Self {
        Self {
            settings,
            time: start.time,
            state: start.state,
            P: start.covariance,
            sample: None,
            nodes: vec![Node {
                is_asked: true,
                ..Node::of(&start.state, start.time)
            }],
            updated: start.time,
            map: LocalMap::new(&settings.map, settings.sigma),
            first: start.time,
            poses: vec![Pose {
                time: start.time,
                pose: start.state.pose,
            }],
            n_asked: 1,
            odometry: HighRate::new(start.time, settings.odometry_interval, settings.smoothing),
            blind: 0.0,
            drift: Drift::default(),
        }
    }

    /// Time of the state, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Its covariance.
    pub fn covariance(&self) -> &Square {
        &self.P
    }

    /// Corrected poses at a uniform rate since this was asked last.
    pub fn take_poses(&mut self) -> Vec<Pose> {
        std::mem::take(&mut self.poses)
    }

    /// Poses of the high-rate odometry since this was asked last.
    pub fn take_odometry(&mut self) -> Vec<OdometryPose> {
        self.odometry.take()
    }

    /// Carries the state on to the time `until` by samples in time order, those after it included.
    pub fn propagate(&mut self, samples: &[Sample], until: f64) {
        for sample in samples {
            if sample.time <= self.time {
                self.sample = Some(*sample);
                continue;
            }
            let before = self.sample.unwrap_or(Sample {
                time: self.time,
                ..*sample
            });
            let from = if before.time < self.time {
                before.towards(sample, self.time)
            } else {
                before
            };
            let to = if sample.time > until {
                from.towards(sample, until)
            } else {
                *sample
            };
            self.advance(&from, &to, sample.time - before.time > MAX_STEP);
            self.sample = Some(to);
            if self.time >= until {
                return;
            }
        }
        // Beyond the last sample its values go on.
        if let Some(last) = self.sample.filter(|_| self.time < until) {
            let to = Sample {
                time: until,
                ..last
            };
            self.advance(
                &Sample {
                    time: self.time,
                    ..last
                },
                &to,
                until - last.time > MAX_STEP,
            );
        }
    }

    /// From one sample to another, stopping where a pose is asked for.
    fn advance(&mut self, from: &Sample, to: &Sample, is_blind: bool) {
        let mut noise = self.settings.noise;
        if is_blind {
            self.blind += to.time - from.time;
            noise.gyro *= BLIND;
            noise.accel *= BLIND;
        }
        let mut here = *from;
        while here.time < to.time {
            let asked = self.first + self.settings.pose_interval * self.n_asked as f64;
            let stop = to.time.min(asked).min(self.odometry.next());
            let there = if stop < to.time {
                from.towards(to, stop)
            } else {
                *to
            };
            let gyro = 0.5 * (here.gyro + there.gyro);
            let accel = 0.5 * (here.accel + there.accel);
            self.step(&gyro, &accel, stop, &noise);
            if stop >= asked {
                self.n_asked += 1;
                if let Some(node) = self.nodes.last_mut() {
                    node.is_asked = true;
                }
            }
            if stop >= self.odometry.next() {
                self.odometry.add(stop, &self.state);
            }
            here = there;
        }
    }

    fn step(&mut self, gyro: &Vector3<f64>, accel: &Vector3<f64>, until: f64, noise: &Noise) {
        let dt = until - self.time;
        let (next, F) = step(&self.state, gyro, accel, dt);
        spread(&mut self.P, &F, noise, dt);
        if let Some(node) = self.nodes.last_mut() {
            node.rate = gyro - self.state.gyro_bias;
            node.a = (next.v - self.state.v) / dt.max(f64::MIN_POSITIVE);
        }
        self.state = next;
        self.time = until;
        let last = self.nodes.last().copied();
        let ahead = last.map_or_else(Vector3::zeros, |n| n.rate);
        self.nodes.push(Node {
            rate: ahead,
            ..Node::of(&next, until)
        });
    }

    /// Corrects the state by a sweep that ends about now, and adds it to the map.
    ///
    /// # Errors
    /// If the state is not finite, or moves faster than any carrier.
    pub fn update(&mut self, sweep: &Sweep<'_>) -> Result<Outcome, KalmanError> {
        let found = features(sweep, self.settings.sigma);
        let moments = |f: &Feature| {
            (
                *f,
                moment(&self.nodes, f.time - self.state.latency, self.time),
            )
        };
        let planar: Vec<(Feature, Moment)> = found.planar.iter().map(moments).collect();
        let none = Vec::new();
        let edges = if self.settings.edges {
            &found.edges
        } else {
            &none
        };
        let edges: Vec<(Feature, Moment)> = edges.iter().map(moments).collect();
        let points: Vec<[f64; 3]> = found.planar.iter().map(|f| f.p.into()).collect();
        let chosen: Vec<(Feature, Moment)> =
            (thin(&points, self.settings.spacing, self.settings.max_features).into_iter())
                .map(|i| planar[i])
                .collect();
        let turning = turning(sweep, self.settings.axis);
        let seen = Seen {
            planar: &chosen,
            edges: &edges,
            turning,
        };
        let rules = Rules {
            max_iterations: self.settings.max_iterations,
            independence: self.settings.independence,
            stamp_jitter: self.settings.stamp_jitter,
        };
        let predicted = self.state;
        walk(&mut self.P, &self.settings.noise, self.time - self.updated);
        let fit = update(&mut self.state, &mut self.P, &self.map, &seen, &rules);
        self.require_health()?;
        let error = self.state.minus(&predicted);
        let mounts = Mounts::of(&self.state);
        let placed =
            |(f, m): &(Feature, Moment)| place(f, m, &turning, (&self.state, &mounts), &error).x;
        let planar: Vec<_> = planar.iter().map(placed).collect();
        let edges: Vec<_> = edges.iter().map(placed).collect();
        let birth = self.drift.birth();
        let new_share = self.map.insert(&planar, &edges, birth);
        let (base, in_map) = self.view(turning.rate);
        let here = self.state.pose.t;
        let matched = fit.as_ref().map_or(&[][..], |f| &f.births);
        self.drift.add(matched, &in_map, &base);
        self.map.follow(&here);
        correct(&mut self.nodes, self.updated, &error);
        self.release();
        Ok(Outcome {
            fit,
            n_features: [found.planar.len(), found.edges.len()],
            n_planes: self.map.n_planes(),
            new_share,
            blind: std::mem::take(&mut self.blind),
        })
    }

    /// Hands out the poses since the last update, and forgets nodes that no sweep can need.
    pub fn release(&mut self) {
        for n in &mut self.nodes {
            if n.is_asked && n.time > self.updated {
                self.poses.push(Pose {
                    time: n.time,
                    pose: n.pose,
                });
            }
        }
        self.updated = self.time;
        let keep = self
            .nodes
            .partition_point(|n| n.time < self.time - MAX_LATENCY);
        self.nodes.drain(..keep.saturating_sub(1));
    }

    /// Corrects the state by the knowledge that the carrier is at rest: its velocity is zero with the
    /// standard deviation `sigma`, m/s. Returns whether it can be; otherwise nothing is changed.
    ///
    /// To be called after an update. A lidar whose motor has not begun to turn sees too little to hold
    /// the position, which the inertial samples alone lose by centimetres within a second.
    pub fn rest(&mut self, sigma: f64) -> bool {
        let variance = sigma * sigma;
        let moves = |i: usize| {
            let v = self.state.v[i];
            v * v
                > REST_GATE * REST_GATE * (self.P[(at::VELOCITY + i, at::VELOCITY + i)] + variance)
        };
        if (0..3).any(moves) {
            return false;
        }
        let (mut information, mut gradient) = (Square::zeros(), Tangent::zeros());
        for i in 0..3 {
            information[(at::VELOCITY + i, at::VELOCITY + i)] = 1.0 / variance;
            gradient[at::VELOCITY + i] = self.state.v[i] / variance;
        }
        let Some(P) = gain::posterior(&self.P, &information) else {
            return false;
        };
        self.state = self.state.plus(&-(P * gradient));
        self.P = P;
        if let Some(last) = self.nodes.last_mut() {
            last.pose = self.state.pose;
            last.v = self.state.v;
        }
        true
    }

    /// Covariance (6 × 6) of attitude and position, with that of the map they are in.
    pub fn pose_covariance(&self) -> Matrix6<f64> {
        self.P.fixed_view::<6, 6>(at::ROTATION, at::ROTATION)
            + self.drift.covariance(&self.state.pose.t)
    }

    /// Position of the motor (or the fixed lidar) and the covariance of the view from there: what is
    /// seen comes to lie where the motor is and as far about its axis as the encoder's delay is wrong
    /// at a `rate`, rad/s, however the IMU is mounted on it.
    fn view(&self, rate: f64) -> (Vector3<f64>, Matrix6<f64>) {
        let R = so3::matrix(&self.state.pose.R);
        let lever = R * self.state.base.t;
        let mut effect = SMatrix::<f64, 6, DIM>::zeros();
        let mut set = |r: usize, c: usize, m: &Matrix3<f64>| {
            effect.fixed_view_mut::<3, 3>(r, c).copy_from(m);
        };
        set(0, at::ROTATION, &Matrix3::identity());
        set(0, at::BASE_ROTATION, &R);
        set(3, at::POSITION, &Matrix3::identity());
        set(3, at::ROTATION, &-so3::hat(&lever));
        set(3, at::BASE_TRANSLATION, &R);
        let axis = self.state.pose.R * self.state.base.R * self.settings.axis;
        effect
            .fixed_view_mut::<3, 1>(0, at::ENCODER_DELAY)
            .copy_from(&(axis * -rate));
        (
            self.state.pose.t + lever,
            effect * self.P * effect.transpose(),
        )
    }

    fn require_health(&self) -> Result<(), KalmanError> {
        let (time, speed) = (self.time, self.state.v.norm());
        if !self.state.is_finite() {
            return Err(KalmanError::NotFinite { time });
        }
        if speed > MAX_SPEED {
            return Err(KalmanError::TooFast { time, speed });
        }
        Ok(())
    }
}

/// How the motor turns during a sweep: a constant change of its rate, by the means of both halves.
fn turning(sweep: &Sweep<'_>, axis: Vector3<f64>) -> Turning {
    let (angles, times, n) = (sweep.angles, sweep.times, sweep.times.len());
    let still = Turning {
        axis,
        rate: 0.0,
        change: 0.0,
        middle: 0.0,
    };
    if angles.len() != n || n < 3 {
        return still;
    }
    let (first, half, last) = (0, n / 2, n - 1);
    let (a, b) = (times[half] - times[first], times[last] - times[half]);
    let middle = 0.5 * (times[first] + times[last]);
    if times[last] <= times[first] {
        return still;
    }
    let rate = (angles[last] - angles[first]) / (times[last] - times[first]);
    // A sweep with most of its points at one end tells the mean only.
    let change = if a.min(b) < 0.2 * (a + b) {
        0.0
    } else {
        let halves = [
            (angles[half] - angles[first]) / a,
            (angles[last] - angles[half]) / b,
        ];
        2.0 * (halves[1] - halves[0]) / (a + b)
    };
    Turning {
        axis,
        rate,
        change,
        middle,
    }
}
