// SPDX-License-Identifier: MIT OR Apache-2.0
//! The number of a voxel.

#![allow(
    clippy::inline_always,
    reason = "only what is inlined into a dispatched function uses the machine's instructions"
)]

/// Bits of one coordinate; enough for ±400 km at 0.4 m.
const BITS: u32 = 21;
const OFFSET: i64 = 1 << (BITS - 1);
const MASK: u64 = (1 << BITS) - 1;

/// The coordinates of a voxel in 63 bits, in the order of x, then y, then z. Voxels two million edges
/// apart in a direction share a key.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VoxelKey(u64);

impl VoxelKey {
    /// The key of no voxel.
    pub const NONE: Self = Self(u64::MAX);

    /// Of the voxel of `p`, `per_metre` being one over its edge.
    #[inline]
    pub fn of(p: &[f64; 3], per_metre: f64) -> Self {
        Self::of_whole(p.map(|c| (c * per_metre).floor()))
    }

    /// Of the voxel with these whole coordinates.
    #[inline(always)]
    pub fn of_whole(coordinates: [f64; 3]) -> Self {
        Self::packed(coordinates.map(index_bits))
    }

    /// Of the voxel with these coordinates.
    #[inline]
    pub fn new(coordinates: [i64; 3]) -> Self {
        Self::packed(coordinates.map(|i| i.wrapping_add(OFFSET) as u64 & MASK))
    }

    #[inline(always)]
    fn packed([x, y, z]: [u64; 3]) -> Self {
        Self(x << (2 * BITS) | y << BITS | z)
    }

    /// Coordinates of the voxel.
    #[inline]
    pub fn coordinates(self) -> [i64; 3] {
        [self.0 >> (2 * BITS), self.0 >> BITS, self.0].map(|i| (i & MASK) as i64 - OFFSET)
    }

    /// The voxel of twice the edge that contains this one.
    #[must_use]
    pub fn coarser(self) -> Self {
        Self::new(self.coordinates().map(|i| i.div_euclid(2)))
    }

    /// The key as a number.
    #[inline]
    pub fn bits(self) -> u64 {
        self.0
    }

    /// One of `2^bits` evenly filled classes of keys.
    #[inline]
    pub fn class(self, bits: u32) -> usize {
        (self.0.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> (u64::BITS - bits)) as usize
    }
}

/// Coordinates of the voxel of `p`, `edge` long.
#[inline]
pub fn voxel_of(p: &[f64; 3], edge: f64) -> [i64; 3] {
    p.map(|c| (c / edge).floor() as i64)
}

/// The lowest bits of an integer and the offset. A float of 3 · 2⁵¹ has room for them in its last
/// bits; processors have no conversion of several floats at a time that is safe for all values.
#[inline(always)]
fn index_bits(whole: f64) -> u64 {
    const ROOM: f64 = 3.0 * (1u64 << 51) as f64;
    (whole + ROOM).to_bits().wrapping_add(OFFSET as u64) & MASK
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_key_holds_its_coordinates_in_order(
            a in prop::array::uniform3(-OFFSET..OFFSET), b in prop::array::uniform3(-OFFSET..OFFSET),
        ) {
            let (p, q) = (VoxelKey::new(a), VoxelKey::new(b));
            prop_assert_eq!(p.coordinates(), a);
            prop_assert_eq!(p.cmp(&q), a.cmp(&b));
            prop_assert_eq!(VoxelKey::of_whole(a.map(|i| i as f64)), p);
            prop_assert_eq!(p.coarser(), VoxelKey::new(a.map(|i| i >> 1)));
        }
    }

    #[test]
    fn voxels_on_both_sides_of_the_origin_are_told_apart() {
        let below = VoxelKey::of(&[-0.1, -0.1, -0.1], 1.0);
        assert_eq!(below.coordinates(), [-1; 3]);
        assert_eq!(below, VoxelKey::of(&[-0.9, -0.5, -0.2], 1.0));
        assert_ne!(below, VoxelKey::of(&[-0.1, -0.1, 0.1], 1.0));
        assert_eq!(voxel_of(&[-0.1, 0.1, 1.1], 1.0), [-1, 0, 1]);
    }
}
