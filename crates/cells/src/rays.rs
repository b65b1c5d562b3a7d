// SPDX-License-Identifier: MIT OR Apache-2.0
//! An even sample of the beams.

/// A beam that is kept: where it began, its unit direction, its length and its step of time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    pub length: f32,
    pub bin: u8,
}

/// Beams chosen by chance, but the same for the same input.
///
/// Every so many would take the same few of a lidar's rings again and again.
#[derive(Clone, Debug)]
pub(crate) struct RaySample {
    pub rays: Vec<Ray>,
    /// Draw of each ray.
    draws: Vec<u32>,
    most: usize,
    /// Rays with a draw below this are kept.
    limit: u32,
    n_seen: u64,
}

impl RaySample {
    /// At most `most` rays, and at least about half as many if there were.
    pub(crate) fn new(most: usize) -> Self {
        Self {
            rays: Vec::new(),
            draws: Vec::new(),
            most,
            limit: u32::MAX,
            n_seen: 0,
        }
    }

    /// Offers the next ray; it is only made if it is kept.
    #[inline]
    pub(crate) fn offer(&mut self, ray: impl FnOnce() -> Option<Ray>) {
        self.n_seen += 1;
        let draw = draw(self.n_seen);
        if draw > self.limit {
            return;
        }
        if let Some(ray) = ray() {
            self.rays.push(ray);
            self.draws.push(draw);
            if self.rays.len() > self.most {
                self.halve();
            }
        }
    }

    fn halve(&mut self) {
        self.limit /= 2;
        let keep: Vec<bool> = self.draws.iter().map(|&d| d <= self.limit).collect();
        let mut kept = keep.iter();
        self.rays.retain(|_| kept.next().copied().unwrap_or(false));
        let mut kept = keep.iter();
        self.draws.retain(|_| kept.next().copied().unwrap_or(false));
    }
}

/// An even hash of a number (`SplitMix64`).
fn draw(n: u64) -> u32 {
    let mut z = n.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_is_even_and_stays_below_its_limit() {
        let mut sample = RaySample::new(1000);
        for i in 0..65_000_u16 {
            let ray = Ray {
                origin: [0.0; 3],
                direction: [0.0, 0.0, 1.0],
                length: f32::from(i),
                bin: 0,
            };
            sample.offer(|| Some(ray));
        }
        assert!(sample.rays.len() <= 1000 && sample.rays.len() > 300);
        let late = sample.rays.iter().filter(|r| r.length > 32_768.0).count();
        assert!((late * 2).abs_diff(sample.rays.len()) < sample.rays.len() / 4);
    }
}
