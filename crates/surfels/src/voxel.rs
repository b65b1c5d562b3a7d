// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which voxel a point is in.

/// Bits of one coordinate in a key.
const BITS: u32 = 21;
const MASK: u64 = (1 << BITS) - 1;

/// Key of the voxel of `p`, `per_metre` being one over its edge; voxels a million edges apart in a direction share one.
#[inline]
pub fn key(p: &[f64; 3], per_metre: f64) -> u64 {
    let [x, y, z] = p.map(|c| (c * per_metre).floor() as i64 as u64 & MASK);
    x << (2 * BITS) | y << BITS | z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_on_both_sides_of_the_origin_are_told_apart() {
        let below = key(&[-0.1, -0.1, -0.1], 1.0);
        assert_ne!(below, key(&[0.1, 0.1, 0.1], 1.0));
        assert_eq!(below, key(&[-0.9, -0.5, -0.2], 1.0));
        assert_ne!(below, key(&[-0.1, -0.1, 0.1], 1.0));
    }
}
