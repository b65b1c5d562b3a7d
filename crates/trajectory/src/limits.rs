// SPDX-License-Identifier: MIT OR Apache-2.0
//! Samples at the limit of an instrument, which say no more than that the truth lies beyond.

use std::ops::Range;

use nalgebra::{Matrix5, Vector3, Vector5};

/// Across a gap of at most this, s, the motion is guessed better by both its ends than by the first.
pub(crate) const MAX_BRIDGE: f64 = 0.25;

/// Samples on each side of a stretch that a quartic is laid through, at least, and half of which are
/// beside the limit.
const FEWEST: usize = 6;

/// Which axes of which samples are at their limit.
#[derive(Clone, Debug, Default)]
pub(crate) struct AtLimit {
    /// How often each axis was there up to a sample; empty where none was.
    counts: Vec<[u32; 6]>,
}

impl AtLimit {
    /// Takes the samples in time order.
    pub fn new(at_limit: &[[bool; 6]]) -> Self {
        let mut sum = [0; 6];
        let add = |row: &[bool; 6]| {
            for (sum, &is_there) in sum.iter_mut().zip(row) {
                *sum += u32::from(is_there);
            }
            sum
        };
        let mut counts: Vec<_> = at_limit.iter().map(add).collect();
        if counts.last() == Some(&[0; 6]) {
            counts.clear();
        }
        Self { counts }
    }

    /// Whether no axis ever is.
    pub fn is_empty(&self) -> bool {
        self.counts.is_empty()
    }

    /// Which axes are beside their limits in all samples `first ..= last`.
    pub fn none_in(&self, first: usize, last: usize) -> [bool; 6] {
        let before = self.before(first);
        let until = self.counts.get(last).unwrap_or(&before);
        std::array::from_fn(|axis| until[axis] == before[axis])
    }

    /// Puts quartics through the samples around them in the place of short stretches at a limit: a
    /// straight line would only cut off once more what is missing. `offset` is the place of the axis x.
    pub fn bridge(&self, times: &[f64], values: &mut [Vector3<f64>], offset: usize) {
        for axis in 0..3 {
            let measured: Vec<f64> = values.iter().map(|v| v[axis]).collect();
            for (first, last) in self.stretches(offset + axis) {
                let Some(quartic) = self.quartic(times, &measured, offset + axis, first, last)
                else {
                    continue;
                };
                for k in first..=last {
                    let beyond = measured[k].signum();
                    let said = beyond * quartic.at(times[k]);
                    values[k][axis] = beyond * said.max(measured[k].abs());
                }
            }
        }
    }

    /// The quartic through the samples beside the limit that are as far around a stretch as it is long.
    fn quartic(
        &self,
        times: &[f64],
        values: &[f64],
        axis: usize,
        first: usize,
        last: usize,
    ) -> Option<Quartic> {
        let width = times.get(last + 1)? - times[first.checked_sub(1)?];
        let reach = (last + 1 - first).max(FEWEST);
        let known = |range: Range<usize>| -> Vec<usize> {
            range.filter(|&k| !self.is_at(k, axis)).collect()
        };
        let before = known(first.saturating_sub(reach)..first);
        let after = known(last + 1..(last + 1 + reach).min(times.len()));
        if width > MAX_BRIDGE || before.len().min(after.len()) < FEWEST / 2 {
            return None;
        }
        let samples = before.iter().chain(&after).map(|&k| (times[k], values[k]));
        Quartic::through(0.5 * (times[first] + times[last]), width, samples)
    }

    fn before(&self, sample: usize) -> [u32; 6] {
        let counts = sample.checked_sub(1).and_then(|k| self.counts.get(k));
        counts.copied().unwrap_or_default()
    }

    fn is_at(&self, sample: usize, axis: usize) -> bool {
        self.counts[sample][axis] > self.before(sample)[axis]
    }

    /// First and last samples of the stretches in which an axis stays at its limit.
    fn stretches(&self, axis: usize) -> Vec<(usize, usize)> {
        let mut found: Vec<(usize, usize)> = Vec::new();
        for k in (0..self.counts.len()).filter(|&k| self.is_at(k, axis)) {
            match found.last_mut() {
                Some((_, last)) if *last + 1 == k => *last = k,
                _ => found.push((k, k)),
            }
        }
        found
    }
}

/// A polynomial of the fourth degree of `(time - middle) / width`.
struct Quartic {
    middle: f64,
    width: f64,
    factors: Vector5<f64>,
}

impl Quartic {
    /// The one with the least squares of distances.
    fn through(middle: f64, width: f64, samples: impl Iterator<Item = (f64, f64)>) -> Option<Self> {
        let (mut normal, mut right) = (Matrix5::zeros(), Vector5::zeros());
        for (time, value) in samples {
            let powers = powers((time - middle) / width);
            normal += powers * powers.transpose();
            right += powers * value;
        }
        Some(Self {
            middle,
            width,
            factors: normal.cholesky()?.solve(&right),
        })
    }

    fn at(&self, time: f64) -> f64 {
        self.factors.dot(&powers((time - self.middle) / self.width))
    }
}

fn powers(u: f64) -> Vector5<f64> {
    Vector5::new(1.0, u, u.powi(2), u.powi(3), u.powi(4))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: f64 = 0.9;

    /// Two swings of one second about y with an even noise, as they are and as they are measured.
    fn swings(noise: f64) -> (Vec<f64>, Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
        let times: Vec<f64> = (0..400).map(|k| 0.005 * f64::from(k)).collect();
        let swing = |t: f64| (2.0 * std::f64::consts::PI * t).sin();
        let jitter = |t: f64| noise * (7919.0 * t).sin();
        let value = |&t: &f64| Vector3::new(0.0, swing(t) + jitter(t), 0.1);
        let values: Vec<_> = times.iter().map(value).collect();
        let cut = |v: &Vector3<f64>| Vector3::new(v.x, v.y.clamp(-LIMIT, LIMIT), v.z);
        let measured = values.iter().map(cut).collect();
        (times, values, measured)
    }

    /// What is missing of the integral of each half of a swing, all together.
    fn missing(values: &[Vector3<f64>], of: &[Vector3<f64>]) -> f64 {
        let halves = values.chunks(100).zip(of.chunks(100));
        let sum = |half: &[Vector3<f64>]| -> f64 { half.iter().map(|v| v.y).sum() };
        halves.map(|(a, b)| (sum(a) - sum(b)).abs()).sum()
    }

    #[test]
    fn what_a_limit_cut_off_is_bridged_to_a_fifth_with_noise_and_without() {
        for noise in [0.0, 0.02] {
            let (times, values, measured) = swings(noise);
            let is_at = |v: &Vector3<f64>| [false, v.y.abs() >= LIMIT, false, false, false, false];
            let flags: Vec<_> = measured.iter().map(is_at).collect();
            let mut bridged = measured.clone();
            AtLimit::new(&flags).bridge(&times, &mut bridged, 0);
            let [left, lost] = [&bridged, &measured].map(|v| missing(v, &values));
            assert!(5.0 * left < lost, "{left} of {lost} with {noise}");
            for (after, before) in bridged.iter().zip(&measured) {
                assert!(after.x == before.x && after.z == before.z);
                assert!(before.y.abs() >= LIMIT || after.y == before.y);
            }
        }
    }

    #[test]
    fn long_stretches_and_those_at_the_ends_stay_at_the_limit() {
        let times: Vec<f64> = (0..200).map(|k| 0.005 * f64::from(k)).collect();
        let measured = vec![Vector3::new(1.0, 1.0, 1.0); 200];
        let mut flags = vec![[false; 6]; 200];
        for (k, flags) in flags.iter_mut().enumerate() {
            flags[3] = !(4..=190).contains(&k);
            flags[4] = (60..120).contains(&k);
        }
        let mut bridged = measured.clone();
        AtLimit::new(&flags).bridge(&times, &mut bridged, 3);
        assert_eq!(bridged, measured);
    }

    #[test]
    fn an_axis_is_known_where_no_sample_of_it_is_at_the_limit() {
        let mut flags = vec![[false; 6]; 10];
        flags[4][1] = true;
        let found = AtLimit::new(&flags);
        assert_eq!(found.none_in(0, 3), [true; 6]);
        assert_eq!(found.none_in(5, 9), [true; 6]);
        let without_y = [true, false, true, true, true, true];
        assert_eq!(found.none_in(3, 4), without_y);
        assert_eq!(found.none_in(4, 4), without_y);
        assert_eq!(found.none_in(0, 9), without_y);
    }
}
