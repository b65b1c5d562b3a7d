// SPDX-License-Identifier: MIT OR Apache-2.0
//! Blows to an instrument's housing: it rings once, and an accelerometer says nothing of the motion.
//!
//! What pushes the carrier pushes one way for some samples, and its integral is a change of velocity. A
//! housing that rings pushes to and fro, faster than the samples can follow and further than their range:
//! what is left of their integral is chance, up to a meter per second that no correction with knots some
//! tenths of a second apart can take back.

use std::ops::Range;

use nalgebra::Vector3;

/// m/s² beside the force around it: nothing that moves a carrier for so short a time is as strong.
const STRONG: f64 = 20.0;
/// m/s² beside the force around it, down to which a blow is followed on both sides.
const FADED: f64 = 5.0;
/// The force around a sample is that of so much time before and behind it, s.
const AROUND: f64 = 0.05;
/// s; what lasts longer is a motion.
const LONGEST: f64 = 0.06;
/// s, over which the filter of an instrument spreads the shortest push.
const SPREAD: f64 = 0.0101;
/// A push one way leaves more than this share of its size in the integral.
const ONE_WAY: f64 = 0.6;

/// Stretches of samples in time order that say nothing of the motion.
#[derive(Clone, Debug, Default)]
pub(crate) struct Blows(Vec<Range<usize>>);

impl Blows {
    /// Finds blows among forces and puts straight lines in their place.
    pub fn taken_out(times: &[f64], accel: &mut [Vector3<f64>]) -> Self {
        let found = Samples { times, accel }.blows();
        let lines: Vec<_> = found
            .iter()
            .map(|blow| Samples { times, accel }.line_across(blow))
            .collect();
        for (blow, line) in found.iter().zip(lines) {
            accel[blow.clone()].copy_from_slice(&line);
        }
        Self(found)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether any of the samples `first ..= last` is in a blow.
    pub fn any_in(&self, first: usize, last: usize) -> bool {
        self.0.iter().any(|b| b.start <= last && first < b.end)
    }
}

struct Samples<'a> {
    times: &'a [f64],
    accel: &'a [Vector3<f64>],
}

impl Samples<'_> {
    fn blows(&self) -> Vec<Range<usize>> {
        let mut found: Vec<Range<usize>> = Vec::new();
        let mut next = 0;
        for k in self.candidates() {
            if k < next || self.beside(k).norm() < STRONG {
                continue;
            }
            let blow = self.extent(k);
            next = blow.end;
            if self.is_alone(&blow) && self.rings(&blow) {
                found.push(blow);
            }
        }
        found
    }

    /// Samples far enough from the mean of all to be looked at.
    fn candidates(&self) -> impl Iterator<Item = usize> {
        let mean = self.accel.iter().sum::<Vector3<f64>>() / self.accel.len().max(1) as f64;
        let far = move |&k: &usize| (self.accel[k] - mean).norm_squared() > (0.5 * STRONG).powi(2);
        (0..self.accel.len()).filter(far)
    }

    /// What a force has beside the median of those around it.
    fn beside(&self, k: usize) -> Vector3<f64> {
        let around = self.between(self.times[k] - AROUND, self.times[k] + AROUND);
        let mut values: Vec<f64> = Vec::with_capacity(around.len());
        Vector3::from_fn(|axis, _| {
            values.clear();
            values.extend(self.accel[around.clone()].iter().map(|f| f[axis]));
            let middle = values.len() / 2;
            self.accel[k][axis] - *values.select_nth_unstable_by(middle, f64::total_cmp).1
        })
    }

    /// The stretch about the strong sample `k` in which forces fade on both sides, and one more on each.
    fn extent(&self, k: usize) -> Range<usize> {
        let lasts = |j: &usize| self.beside(*j).norm() > FADED;
        let count = |range: &mut dyn Iterator<Item = usize>| {
            // A ring passes through zero: one quiet sample does not end it.
            let (mut n, mut reach, mut quiet) = (0, 0, 0);
            for j in range {
                n += 1;
                if lasts(&j) {
                    (reach, quiet) = (n, 0);
                } else if quiet == 1 {
                    break;
                } else {
                    quiet += 1;
                }
            }
            reach
        };
        let before = count(&mut (0..k).rev());
        let after = count(&mut (k + 1..self.times.len()));
        (k - before).saturating_sub(1)..(k + after + 2).min(self.times.len())
    }

    /// Whether it is short, and calm on both sides.
    fn is_alone(&self, blow: &Range<usize>) -> bool {
        let (first, last) = (self.times[blow.start], self.times[blow.end - 1]);
        let before = self.between(first - AROUND, first).start..blow.start;
        let after = blow.end..self.between(last, last + AROUND).end;
        let is_calm = |mut side: Range<usize>| {
            side.len() >= 2 && side.all(|k| self.beside(k).norm() < STRONG)
        };
        last - first < LONGEST && is_calm(before) && is_calm(after)
    }

    /// Whether it pushes to and fro, or for a shorter time than the shortest push.
    fn rings(&self, blow: &Range<usize>) -> bool {
        let beside: Vec<_> = blow.clone().map(|k| self.beside(k)).collect();
        let left = beside.iter().sum::<Vector3<f64>>().norm();
        let size: f64 = beside.iter().map(Vector3::norm).sum();
        let strong: Vec<_> = blow
            .clone()
            .zip(&beside)
            .filter_map(|(k, f)| (f.norm() > FADED).then_some(k))
            .collect();
        let is_spike = strong.len() == 1
            && strong[0] > 0
            && strong[0] + 1 < self.times.len()
            && self.times[strong[0] + 1] - self.times[strong[0] - 1] < SPREAD;
        is_spike || left < ONE_WAY * size
    }

    /// Forces on the straight line between the means of what is before a stretch and behind it.
    fn line_across(&self, blow: &Range<usize>) -> Vec<Vector3<f64>> {
        let (first, last) = (self.times[blow.start], self.times[blow.end - 1]);
        let before = self.between(first - AROUND, first).start..blow.start;
        let after = blow.end..self.between(last, last + AROUND).end;
        let mean = |side: Range<usize>| {
            let n = side.len() as f64;
            let time = self.times[side.clone()].iter().sum::<f64>() / n;
            (time, self.accel[side].iter().sum::<Vector3<f64>>() / n)
        };
        let ((t0, from), (t1, to)) = (mean(before), mean(after));
        let at = |k: usize| from.lerp(&to, (self.times[k] - t0) / (t1 - t0));
        blow.clone().map(at).collect()
    }

    fn between(&self, from: f64, to: f64) -> Range<usize> {
        self.times.partition_point(|&t| t < from)..self.times.partition_point(|&t| t <= to)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// Two seconds at `rate_hz` of gravity and rotors, with what `felt` adds.
    fn measured(rate_hz: f64, felt: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<Vector3<f64>>) {
        let times: Vec<f64> = (0..(2.0 * rate_hz) as usize)
            .map(|k| k as f64 / rate_hz)
            .collect();
        let force = |&t: &f64| Vector3::new(felt(t), 0.3, 9.8 + 1.5 * (TAU * 90.0 * t).sin());
        (times.clone(), times.iter().map(force).collect())
    }

    fn ring(start: f64, lasting: f64, size: f64) -> impl Fn(f64) -> f64 {
        move |t| {
            let u = (t - start) / lasting;
            let ringing = size * (TAU * u).sin();
            if (0.0..1.0).contains(&u) {
                ringing.clamp(-78.0, 78.0)
            } else {
                0.0
            }
        }
    }

    /// Largest of what is left along x.
    fn left(accel: &[Vector3<f64>]) -> f64 {
        accel.iter().fold(0.0, |most, f| most.max(f.x.abs()))
    }

    #[test]
    fn a_housing_that_rings_is_taken_out_at_any_rate_and_phase() {
        for rate_hz in [200.0, 400.0, 1000.0] {
            for (n, lasting) in [0.012, 0.017, 0.023, 0.03].into_iter().enumerate() {
                let start = 1.0 + 0.0013 * n as f64;
                let (times, mut accel) = measured(rate_hz, ring(start, lasting, 120.0));
                let blows = Blows::taken_out(&times, &mut accel);
                assert_eq!(blows.0.len(), 1, "{lasting} s at {rate_hz} Hz");
                assert!(left(&accel) < 1e-9, "{lasting} s at {rate_hz} Hz");
                let at = times.partition_point(|&t| t < start + 0.5 * lasting);
                assert!(blows.any_in(at, at) && !blows.any_in(0, at - (0.05 * rate_hz) as usize));
            }
        }
    }

    #[test]
    fn a_single_spike_is_taken_out() {
        let (times, mut accel) = measured(200.0, ring(1.001, 0.0055, 120.0));
        assert_eq!(Blows::taken_out(&times, &mut accel).0.len(), 1);
        assert!(left(&accel) < 1e-9);
    }

    #[test]
    fn pushes_swings_and_rough_rides_stay_as_they_are() {
        let push = |t: f64| if (1.0..1.02).contains(&t) { 60.0 } else { 0.0 };
        let swing = |t: f64| 25.0 * (TAU * 3.0 * t).sin();
        let rough = |t: f64| 40.0 * (TAU * 31.0 * t).sin();
        let felt: [&dyn Fn(f64) -> f64; 3] = [&push, &swing, &rough];
        for felt in felt {
            let (times, accel) = measured(200.0, felt);
            let mut after = accel.clone();
            assert!(Blows::taken_out(&times, &mut after).0.is_empty());
            assert_eq!(after, accel);
        }
    }

    #[test]
    fn a_blow_at_an_end_of_the_samples_and_no_samples_at_all_are_left_alone() {
        let (times, mut accel) = measured(200.0, ring(-0.004, 0.02, 120.0));
        assert!(Blows::taken_out(&times, &mut accel).0.is_empty());
        assert!(Blows::taken_out(&[], &mut []).0.is_empty());
    }
}
