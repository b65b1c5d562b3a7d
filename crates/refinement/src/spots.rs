// SPDX-License-Identifier: MIT OR Apache-2.0
//! Points near the middle of a piece, in blocks that are computed with at once.

use bentwing_voxels::sym3;
use nalgebra::{Matrix3, Vector3};
use wide::f32x8;

/// Spots of a block; fixed, so that sums are the same on every machine.
pub(crate) const LANES: usize = 8;
/// A number of each spot of a block.
pub(crate) type Lanes = [f32; LANES];

/// A point near the middle of a piece.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spot {
    /// From the middle, m.
    pub at: [f32; 3],
    /// Unit direction of the beam.
    pub beam: [f32; 3],
    /// Of the range, m.
    pub sigma: f32,
    pub pass: u8,
}

/// Spots side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    pub at: [Lanes; 3],
    pub beam: [Lanes; 3],
    pub sigma: Lanes,
    pub pass: [u8; LANES],
    /// One, or zero where there is no spot.
    pub is: Lanes,
}

impl Block {
    #[inline]
    pub(crate) fn at(&self) -> [f32x8; 3] {
        self.at.map(f32x8::from)
    }

    #[inline]
    pub(crate) fn beam(&self) -> [f32x8; 3] {
        self.beam.map(f32x8::from)
    }
}

const EMPTY: Block = Block {
    at: [[0.0; LANES]; 3],
    beam: [[0.0; LANES]; 3],
    sigma: [1.0; LANES],
    pass: [0; LANES],
    is: [0.0; LANES],
};

/// Points near the middle of a piece.
#[derive(Clone, Debug, Default)]
pub(crate) struct Spots {
    blocks: Vec<Block>,
    n: usize,
}

impl Spots {
    pub(crate) fn len(&self) -> usize {
        self.n
    }

    pub(crate) fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    pub(crate) fn clear(&mut self) {
        self.blocks.clear();
        self.n = 0;
    }

    #[inline]
    pub(crate) fn push(&mut self, s: &Spot) {
        let k = self.n % LANES;
        if k == 0 {
            self.blocks.push(EMPTY);
        }
        self.n += 1;
        if let Some(block) = self.blocks.last_mut() {
            for axis in 0..3 {
                block.at[axis][k] = s.at[axis];
                block.beam[axis][k] = s.beam[axis];
            }
            block.sigma[k] = s.sigma;
            block.pass[k] = s.pass;
            block.is[k] = 1.0;
        }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = Spot> + '_ {
        let of_block = |block: &Block, k: usize| Spot {
            at: block.at.map(|c| c[k]),
            beam: block.beam.map(|c| c[k]),
            sigma: block.sigma[k],
            pass: block.pass[k],
        };
        let blocks = self.blocks.iter();
        let all = blocks.flat_map(move |block| (0..LANES).map(move |k| of_block(block, k)));
        all.take(self.n)
    }

    /// Those that are chosen, and the others.
    pub(crate) fn partition(&self, chosen: impl Fn(&Spot) -> bool) -> [Self; 2] {
        let mut parts = [Self::default(), Self::default()];
        for s in self.iter() {
            parts[usize::from(!chosen(&s))].push(&s);
        }
        parts
    }

    /// The normal of a plane through the spots, in whose direction they spread least; it faces the lidar.
    pub(crate) fn normal(&self) -> Option<Vector3<f64>> {
        let (mut firsts, mut seconds, mut beams) =
            ([f32x8::ZERO; 3], [f32x8::ZERO; 6], [f32x8::ZERO; 3]);
        for block in &self.blocks {
            let [x, y, z] = block.at();
            add(&mut firsts, [x, y, z]);
            add(&mut beams, block.beam());
            add(&mut seconds, [x * x, x * y, x * z, y * y, y * z, z * z]);
        }
        if self.n == 0 {
            return None;
        }
        let n = self.n as f64;
        let mean = Vector3::from(firsts.map(|s| total(s) / n));
        let [xx, xy, xz, yy, yz, zz] = seconds.map(|s| total(s) / n);
        let covariance = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) - mean * mean.transpose();
        let normal = sym3::eigen(&covariance).normal;
        let away = Vector3::from(beams.map(total)).dot(&normal) > 0.0;
        Some(if away { -normal } else { normal })
    }
}

/// Of the numbers of a block, always in the same order.
#[inline]
pub(crate) fn total(lanes: f32x8) -> f64 {
    lanes.to_array().into_iter().map(f64::from).sum()
}

#[inline]
pub(crate) fn add<const N: usize>(sums: &mut [f32x8; N], terms: [f32x8; N]) {
    for (sum, term) in sums.iter_mut().zip(terms) {
        *sum += term;
    }
}

#[inline]
pub(crate) fn dot(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(crate) fn single(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}
