// SPDX-License-Identifier: MIT OR Apache-2.0
//! How large the noise of an IMU shows itself in the course of time.

use crate::ImuNoise;

/// What the residuals of a trajectory say of the noise, over what is stated.
#[derive(Clone, Debug, Default)]
pub struct ShownNoise {
    /// s, increasing; without any the noise is as stated.
    pub times: Vec<f64>,
    /// Of gyro and accelerometer at these times, as standard deviations over the stated ones.
    pub ratios: Vec<[f64; 2]>,
}

impl ShownNoise {
    /// The noise at a time, between the nearest two.
    pub fn at(&self, time: f64, stated: &ImuNoise) -> ImuNoise {
        let last = self.times.len().saturating_sub(1);
        let after = self.times.partition_point(|&t| t < time).min(last);
        let before = after.saturating_sub(1);
        let (Some(low), Some(high)) = (self.ratios.get(before), self.ratios.get(after)) else {
            return *stated;
        };
        let gap = self.times[after] - self.times[before];
        let share = if gap > 0.0 {
            ((time - self.times[before]) / gap).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let ratio = |k: usize| (1.0 - share) * low[k] + share * high[k];
        ImuNoise {
            gyro: stated.gyro * ratio(0),
            accel: stated.accel * ratio(1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATED: ImuNoise = ImuNoise {
        gyro: 2.0,
        accel: 10.0,
    };

    #[test]
    fn the_noise_goes_from_one_time_to_the_next_and_stays_beyond_the_ends() {
        let shown = ShownNoise {
            times: vec![1.0, 3.0],
            ratios: vec![[1.0, 0.5], [2.0, 1.5]],
        };
        let at = |t: f64| {
            let noise = shown.at(t, &STATED);
            (noise.gyro, noise.accel)
        };
        assert_eq!(at(0.0), (2.0, 5.0));
        assert_eq!(at(2.0), (3.0, 10.0));
        assert_eq!(at(9.0), (4.0, 15.0));
    }

    #[test]
    fn without_any_the_noise_is_as_stated() {
        let noise = ShownNoise::default().at(1.0, &STATED);
        assert_eq!((noise.gyro, noise.accel), (2.0, 10.0));
    }
}
