// SPDX-License-Identifier: MIT OR Apache-2.0
//! How noisy ranges are, as the smooth surfaces of a map show it.

/// Steps of the range, half an octave each, the first one up to 0.25 m.
pub(crate) const N_STEPS: usize = 24;
const FIRST: f32 = 0.25;
/// Of the sheets of a range the noise is the residual of those that are smoother than most: what is more
/// is the shape of a surface.
const SMOOTH: f64 = 0.3;
/// Fewer sheets tell no noise of their range.
const FEWEST: usize = 25;
/// By how much the noise grows from a step to the next at most, and by how much it may shrink: where all
/// that is near are leaves, only what is farther tells the noise.
const GROWS: f64 = 1.4;
const SHRINKS: f64 = 1.1;

/// Standard deviation of a range by the range.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise([f64; N_STEPS]);

/// Step of a range.
#[inline]
pub(crate) fn step_of(range: f32) -> u8 {
    let octaves = (range / FIRST).max(1.0).log2();
    ((2.0 * octaves) as u8).min(N_STEPS as u8 - 1)
}

impl Noise {
    /// From the steps of the ranges of smooth sheets and the standard deviations of their residuals along the
    /// beams, none above `most`; none without sheets.
    pub(crate) fn of(found: &[(u8, f64)], most: f64) -> Option<Self> {
        let mut steps: [Vec<f64>; N_STEPS] = Default::default();
        for &(step, sigma) in found {
            steps[usize::from(step)].push(sigma);
        }
        let mut all: Vec<f64> = found.iter().map(|f| f.1).collect();
        let usual = quantile(&mut all)?.min(most);
        let own = steps.map(|mut s| {
            if s.len() < FEWEST {
                None
            } else {
                quantile(&mut s)
            }
        });
        let known: Vec<(usize, f64)> = (0..N_STEPS).filter_map(|k| Some((k, own[k]?))).collect();
        let of_step = |k: usize| {
            let nearest = known.iter().min_by_key(|(other, _)| other.abs_diff(k));
            let bounds = known.iter().map(|&(other, sigma)| sigma * growth(other, k));
            bounds.fold(nearest.map_or(usual, |n| n.1).min(most), f64::min)
        };
        Some(Self(std::array::from_fn(of_step)))
    }

    /// Of a range, m.
    #[inline]
    pub fn sigma(&self, range: f32) -> f64 {
        self.of_step(step_of(range))
    }

    #[inline]
    pub(crate) fn of_step(&self, step: u8) -> f64 {
        self.0[usize::from(step)]
    }
}

/// By how much the noise of one step may exceed that of another.
fn growth(from: usize, to: usize) -> f64 {
    let apart = from.abs_diff(to) as i32;
    if to > from {
        GROWS.powi(apart)
    } else {
        SHRINKS.powi(apart)
    }
}

fn quantile(values: &mut [f64]) -> Option<f64> {
    let at = ((values.len() as f64 * SMOOTH) as usize).min(values.len().checked_sub(1)?);
    Some(*values.select_nth_unstable_by(at, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_range_has_the_noise_of_its_sheets_and_others_that_of_the_nearest() {
        let near = (0..100).map(|i| (step_of(2.0), 0.01 + 1e-5 * f64::from(i)));
        let far = (0..100).map(|i| (step_of(16.0), 0.03 + 1e-5 * f64::from(i)));
        let found: Vec<(u8, f64)> = near.chain(far).collect();
        let noise = Noise::of(&found, 0.05).unwrap();
        assert!((noise.sigma(2.0) - 0.0103).abs() < 1e-9);
        assert!((noise.sigma(16.0) - 0.0303).abs() < 1e-9);
        assert_eq!(noise.sigma(0.1), noise.sigma(2.0));
        assert_eq!(noise.sigma(100.0), noise.sigma(16.0));
    }

    #[test]
    fn without_sheets_there_is_no_noise() {
        assert!(Noise::of(&[], 0.05).is_none());
    }

    #[test]
    fn leaves_that_are_near_do_not_make_ranges_noisy() {
        let leaves = (0..100).map(|_| (step_of(2.0), 0.07));
        let walls = (0..100).map(|_| (step_of(4.0), 0.01));
        let found: Vec<(u8, f64)> = leaves.chain(walls).collect();
        let noise = Noise::of(&found, 0.05).unwrap();
        assert!(noise.sigma(2.0) < 0.0125);
        assert!(Noise::of(&found, 0.005).unwrap().sigma(4.0) <= 0.005);
    }
}
