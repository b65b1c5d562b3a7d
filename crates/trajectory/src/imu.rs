// SPDX-License-Identifier: MIT OR Apache-2.0
//! Inertial samples and what they say about the trajectory's samples.

use nalgebra::{Matrix3, Vector3};

use crate::blows::Blows;
use crate::limits::{AtLimit, MAX_BRIDGE};
use crate::{Trajectory, so3};

/// Samples further apart than this, s, are a gap: nothing is said about the time between them.
const MAX_GAP: f64 = 0.05;

/// Inertial samples in time order, with the running integral of the gyro.
#[derive(Clone, Debug)]
pub struct Imu {
    times: Vec<f64>,
    gyro: Vec<Vector3<f64>>,
    accel: Vec<Vector3<f64>>,
    /// Cumulative trapezoid of the gyro at its own stamps, rad. Averaging the samples that fall
    /// in an interval instead would be centred half a sample off and read as latency.
    turned: Vec<Vector3<f64>>,
    /// The same of the accelerometer, m/s.
    pushed: Vec<Vector3<f64>>,
    at_limit: AtLimit,
    blows: Blows,
}

/// Integrals of the samples over an interval, imu frame, errors of the unit included.
#[derive(Clone, Copy, Debug)]
pub struct Increment {
    /// Of the gyro, rad.
    pub turned: Vector3<f64>,
    /// Of the accelerometer, m/s.
    pub pushed: Vector3<f64>,
}

/// Mean specific force around one sample of the trajectory, seen from the IMU at that sample, errors
/// of the unit included: its linear parts, so that each error enters exactly.
#[derive(Clone, Copy, Debug)]
pub struct NodeForce {
    /// `Σ w_k f_kj R_nᵀ R(t_k)` of each axis j, m/s²; the columns j add up to the mean force.
    pub by_axis: [Matrix3<f64>; 3],
    /// `Σ w_k R_nᵀ R(t_k)`: how a constant enters.
    pub gain: Matrix3<f64>,
}

impl Imu {
    /// Takes samples with increasing `times`; all slices have the same length. Straight lines take the
    /// place of forces that a ringing housing feigns.
    pub fn new(times: Vec<f64>, gyro: Vec<Vector3<f64>>, mut accel: Vec<Vector3<f64>>) -> Self {
        let blows = Blows::taken_out(&times, &mut accel);
        let (turned, pushed) = (integral(&times, &gyro), integral(&times, &accel));
        Self {
            times,
            gyro,
            accel,
            turned,
            pushed,
            at_limit: AtLimit::default(),
            blows,
        }
    }

    /// The same where axes were at the limit of their instrument; in `at_limit` those of the gyro come
    /// before those of the accelerometer. In their place stand values that bridge them.
    pub fn with_limits(
        times: Vec<f64>,
        mut gyro: Vec<Vector3<f64>>,
        mut accel: Vec<Vector3<f64>>,
        at_limit: &[[bool; 6]],
    ) -> Self {
        let at_limit = AtLimit::new(at_limit);
        at_limit.bridge(&times, &mut gyro, 0);
        at_limit.bridge(&times, &mut accel, 3);
        Self {
            at_limit,
            ..Self::new(times, gyro, accel)
        }
    }

    /// Which axes of gyro and accelerometer measured all that was in `[from, to]`.
    pub fn known(&self, from: f64, to: f64) -> [bool; 6] {
        if self.at_limit.is_empty() && self.blows.is_empty() {
            return [true; 6];
        }
        let first = self.times.partition_point(|&s| s <= from).saturating_sub(1);
        let last = self.times.partition_point(|&s| s < to);
        let last = last.min(self.len().max(1) - 1);
        let mut known = self.at_limit.none_in(first, last);
        if self.blows.any_in(first, last) {
            known[3..].fill(false);
        }
        known
    }

    /// The same with samples on straight lines across short gaps, for a first guess of the motion.
    #[must_use]
    pub fn bridged(&self) -> Self {
        let (mut times, mut gyro, mut accel) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..self.len() {
            let gap = if k > 0 {
                self.times[k] - self.times[k - 1]
            } else {
                0.0
            };
            let n = if gap > MAX_GAP && gap <= MAX_BRIDGE {
                (gap / MAX_GAP) as usize + 1
            } else {
                1
            };
            for i in 1..n {
                let u = i as f64 / n as f64;
                times.push(self.times[k - 1] + gap * u);
                gyro.push(self.gyro[k - 1].lerp(&self.gyro[k], u));
                accel.push(self.accel[k - 1].lerp(&self.accel[k], u));
            }
            times.push(self.times[k]);
            gyro.push(self.gyro[k]);
            accel.push(self.accel[k]);
        }
        Self::new(times, gyro, accel)
    }

    /// Forces of the samples, with lines and polynomials in the place of what says nothing of the motion.
    pub fn forces(&self) -> &[Vector3<f64>] {
        &self.accel
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Time of the last sample, s; minus infinity without any.
    pub fn end(&self) -> f64 {
        self.times.last().copied().unwrap_or(f64::NEG_INFINITY)
    }

    /// Index of the last sample at or before `t`, if `t` lies between two samples without a gap.
    fn bracket(&self, t: f64) -> Option<usize> {
        let after = self.times.partition_point(|&s| s <= t);
        if after == 0 {
            return None;
        }
        if after == self.times.len() {
            return (self.times[after - 1] == t && after > 1).then_some(after - 2);
        }
        (self.times[after] - self.times[after - 1] <= MAX_GAP).then_some(after - 1)
    }

    /// Integrals of the samples from the first one to `t`.
    fn until(&self, t: f64) -> Option<Increment> {
        let k = self.bracket(t)?;
        let width = self.times[k + 1] - self.times[k];
        let s = t - self.times[k];
        let mean = |v: &[Vector3<f64>]| v[k] + (v[k + 1] - v[k]) * (0.5 * s / width);
        Some(Increment {
            turned: self.turned[k] + mean(&self.gyro) * s,
            pushed: self.pushed[k] + mean(&self.accel) * s,
        })
    }

    /// Integrals of the samples over `[from, to]`; `None` in a gap.
    ///
    /// Where the axis of rotation moves, the rotation vector is not the integral of the rates: a head
    /// that spins and is tilted would seem to tilt less. The next term is a twelfth of the product of
    /// two integrals that follow each other.
    ///
    /// References: Savage 1998, Strapdown inertial navigation integration algorithm design part 1.
    pub fn increment(&self, from: f64, to: f64) -> Option<Increment> {
        let (first, last) = (self.until(from)?, self.until(to)?);
        let turned = last.turned - first.turned;
        let before = self.until(2.0 * from - to);
        let coning =
            before.map_or_else(Vector3::zeros, |b| (first.turned - b.turned).cross(&turned));
        Some(Increment {
            turned: turned + coning / 12.0,
            pushed: last.pushed - first.pushed,
        })
    }

    /// Triangular mean of the specific force over `±dt` around sample `n`, which is what the
    /// second difference of the positions measures; `None` in a gap or at the ends.
    pub fn node_force(&self, trajectory: &Trajectory, n: usize) -> Option<NodeForce> {
        let (t, dt) = (trajectory.time(n), trajectory.dt());
        self.bracket(t - dt)?;
        self.bracket(t + dt)?;
        let first = self.times.partition_point(|&s| s <= t - dt);
        let last = self.times.partition_point(|&s| s < t + dt);
        let mut node = NodeForce {
            by_axis: [Matrix3::zeros(); 3],
            gain: Matrix3::zeros(),
        };
        let mut total = 0.0;
        for k in first.max(1)..last.min(self.len() - 1) {
            let span = self.times[k + 1] - self.times[k - 1];
            let weight = (1.0 - (self.times[k] - t).abs() / dt) * span;
            let R = relative_rotation(trajectory, n, self.times[k]) * weight;
            for (part, f) in node.by_axis.iter_mut().zip(self.accel[k].iter()) {
                *part += R * *f;
            }
            node.gain += R;
            total += weight;
        }
        // Fewer samples than nodes: the nearest straight line between samples stands in.
        if total <= 0.0 {
            return self.interpolated_force(t);
        }
        for part in &mut node.by_axis {
            *part /= total;
        }
        node.gain /= total;
        Some(node)
    }

    fn interpolated_force(&self, t: f64) -> Option<NodeForce> {
        let k = self.bracket(t)?;
        let u = (t - self.times[k]) / (self.times[k + 1] - self.times[k]);
        let force = self.accel[k] + (self.accel[k + 1] - self.accel[k]) * u;
        Some(NodeForce {
            by_axis: [force.x, force.y, force.z].map(Matrix3::from_diagonal_element),
            gain: Matrix3::identity(),
        })
    }
}

/// Cumulative trapezoid.
fn integral(times: &[f64], values: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut sum = Vector3::zeros();
    let mut sums = Vec::with_capacity(times.len());
    for k in 0..times.len() {
        if k > 0 {
            sum += (values[k] + values[k - 1]) * (0.5 * (times[k] - times[k - 1]));
        }
        sums.push(sum);
    }
    sums
}

/// `R_nᵀ R(t)` for `t` within one interval of sample `n`.
fn relative_rotation(trajectory: &Trajectory, n: usize, t: f64) -> Matrix3<f64> {
    let u = (t - trajectory.time(n)) / trajectory.dt();
    let steps = trajectory.steps();
    let phi = if u < 0.0 {
        steps[n.max(1) - 1]
    } else {
        steps[n.min(steps.len() - 1)]
    } * u;
    so3::matrix(&so3::exp(&phi))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::InertialUnit;

    fn uniform(rate_hz: f64, phase: f64, seconds: f64) -> Vec<f64> {
        (0..(seconds * rate_hz) as usize)
            .map(|k| phase + k as f64 / rate_hz)
            .collect()
    }

    #[test]
    fn a_linear_rate_is_integrated_exactly_at_any_phase() {
        let times = uniform(200.0, -0.0013, 1.0);
        let gyro = times
            .iter()
            .map(|&t| Vector3::new(1.0 + 2.0 * t, 0.0, 0.0))
            .collect();
        let accel = vec![Vector3::zeros(); times.len()];
        let imu = Imu::new(times, gyro, accel);
        let angle = imu.increment(0.1, 0.2047).unwrap().turned.x;
        let exact = 0.1047 + (0.2047_f64.powi(2) - 0.1_f64.powi(2));
        assert!((angle - exact).abs() < 1e-12);
    }

    #[test]
    fn a_spinning_imu_that_is_tilted_turns_as_far_as_it_did() {
        let rotation =
            |t: f64| so3::exp(&(Vector3::x() * 0.3 * t)) * so3::exp(&(Vector3::z() * 6.0 * t));
        let times = uniform(200.0, -0.0213, 1.0);
        let rate =
            |t: f64| so3::exp(&(Vector3::z() * -6.0 * t)) * Vector3::x() * 0.3 + Vector3::z() * 6.0;
        let gyro = times.iter().map(|&t| rate(t)).collect();
        let imu = Imu::new(times.clone(), gyro, vec![Vector3::zeros(); times.len()]);
        let (mut sum, mut n) = (Vector3::zeros(), 0.0);
        for k in 1..90 {
            let (from, to) = (0.01 * f64::from(k), 0.01 * f64::from(k + 1));
            let exact = so3::log(&(rotation(from).inverse() * rotation(to)));
            // The integral of the rates misses 3e-4 of 0.3 rad/s, and trapezoids at 200 Hz a fourth of it.
            let off = imu.increment(from, to).unwrap().turned - exact;
            sum += rotation(0.5 * (from + to)) * off / (to - from);
            n += 1.0;
        }
        assert!((sum / n).norm() < 2.5e-5, "{sum}");
    }

    #[test]
    fn a_short_gap_is_bridged_by_straight_lines_and_a_long_one_is_not() {
        let rate = |t: f64| Vector3::new(1.0 + 2.0 * t, 0.0, -t);
        let all = uniform(200.0, 0.0, 1.0);
        let rates: Vec<_> = all.iter().map(|&t| rate(t)).collect();
        let whole = Imu::new(all, rates.clone(), rates)
            .increment(0.35, 0.36)
            .unwrap();
        for (gap, is_bridged) in [(0.2, true), (0.4, false)] {
            let mut times = uniform(200.0, 0.0, 1.0);
            times.retain(|&t| t <= 0.3 || t >= 0.3 + gap);
            let gyro: Vec<_> = times.iter().map(|&t| rate(t)).collect();
            let imu = Imu::new(times, gyro.clone(), gyro);
            assert!(imu.increment(0.35, 0.36).is_none());
            let said = imu.bridged().increment(0.35, 0.36);
            assert_eq!(said.is_some(), is_bridged);
            if let Some(said) = said {
                assert!((said.turned - whole.turned).norm() < 1e-12);
                assert!((said.pushed - whole.pushed).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn nothing_is_said_across_a_gap_or_beyond_the_ends() {
        let mut times = uniform(200.0, 0.0, 1.0);
        times.retain(|&t| !(0.4..0.6).contains(&t));
        let n = times.len();
        let imu = Imu::new(times, vec![Vector3::z(); n], vec![Vector3::zeros(); n]);
        assert!(imu.increment(0.1, 0.2).is_some());
        assert!(imu.increment(0.3, 0.5).is_none());
        assert!(imu.increment(0.9, 1.1).is_none());
    }

    #[test]
    fn mean_force_of_a_turning_imu_under_constant_force_is_that_force() {
        let rate = Vector3::new(0.3, -0.2, 6.0);
        let positions = vec![Vector3::zeros(); 101];
        let rotations: Vec<_> = (0..101)
            .map(|n| so3::exp(&(rate * 0.01 * f64::from(n))))
            .collect();
        let trajectory = Trajectory::new(0.0, 0.01, positions, rotations).unwrap();
        let force = Vector3::new(1.0, 2.0, 9.8);
        for rate_hz in [100.0, 200.0, 250.0, 1000.0] {
            let times = uniform(rate_hz, -0.0021, 1.1);
            let accel = times
                .iter()
                .map(|&t| so3::exp(&(rate * t)).inverse() * force)
                .collect();
            let imu = Imu::new(times.clone(), vec![rate; times.len()], accel);
            let node = imu.node_force(&trajectory, 50).unwrap();
            let felt = InertialUnit::ideal().force(&node);
            assert!((trajectory.rotations()[50] * felt - force).norm() < 1e-9);
        }
    }
}
