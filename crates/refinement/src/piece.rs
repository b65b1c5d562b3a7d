// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is kept of a sheet: as few bytes as tell where a point beside it most probably is.

use wide::f32x8;

use crate::sheet::Sheet;
use crate::split::Half;

/// Less than this cosine between beam and normal tells nothing about a range.
const GRAZING: f32 = 0.05;
/// Points farther from a sheet than this many standard deviations are none of its.
const FARTHEST: f32 = 3.0;

/// A sheet and where it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    /// Units of the map.
    pub middle: [i32; 3],
    axes: [[f32; 3]; 3],
    heights: [f32; 6],
    per_radius: f32,
    /// Variance of the true surface about this one.
    variance: f32,
    /// The side of a plane on which the sheet is: its normal, and its distance from the middle.
    half: [f32; 4],
}

/// What a sheet says of points: weights, moves along the beams and the variances that are left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hypothesis {
    /// Zero where it says nothing.
    pub weight: f32x8,
    pub shift: f32x8,
    pub variance: f32x8,
}

impl Piece {
    pub(crate) fn of(middle: [i32; 3], sheet: &Sheet, half: Option<&Half>) -> Self {
        let row = |k: usize| [0, 1, 2].map(|a| sheet.axes[(k, a)] as f32);
        let side = half.map_or([0.0; 4], |h| {
            let d = h.direction;
            [d[0], d[1], d[2], h.offset].map(|v| v as f32)
        });
        Self {
            middle,
            axes: [0, 1, 2].map(row),
            heights: [0, 1, 2, 3, 4, 5].map(|k| sheet.heights[k] as f32),
            per_radius: 1.0 / sheet.radius as f32,
            variance: (sheet.roughness + sheet.variance) as f32,
            half: side,
        }
    }

    /// Of points (m, from the middle) whose ranges have the standard deviations `sigma`.
    #[inline]
    pub(crate) fn says(&self, at: &[f32x8; 3], beam: &[f32x8; 3], sigma: f32x8) -> Hypothesis {
        let along = |row: &[f32; 3], c: &[f32x8; 3]| c[0] * row[0] + c[1] * row[1] + c[2] * row[2];
        let [x, y, z, offset] = self.half;
        let is_inside = along(&[x, y, z], at).simd_ge(f32x8::splat(offset));
        let [u, v, height] = self.axes.map(|row| along(&row, at));
        let (u, v, h) = (u * self.per_radius, v * self.per_radius, &self.heights);
        let share = 1.0 - u * u - v * v;
        let off = height - (h[0] + u * (h[1] + h[3] * u + h[4] * v) + v * (h[2] + h[5] * v));
        let du = (h[1] + 2.0 * h[3] * u + h[4] * v) * self.per_radius;
        let dv = (h[2] + h[4] * u + 2.0 * h[5] * v) * self.per_radius;
        let across = self.axes.map(|row| along(&row, beam));
        // Neither is divided by the length of the normal, so that the move, their ratio, needs none.
        let squared_length = 1.0 + du * du + dv * dv;
        let slope = across[2] - du * across[0] - dv * across[1];
        // A beam from behind has met the other side of something thin.
        let is_met = slope.simd_lt(f32x8::ZERO)
            & (slope * slope).simd_ge(GRAZING * GRAZING * squared_length);
        let measured = slope * slope * sigma * sigma;
        let all = measured + self.variance * squared_length;
        let squared = off * off / all;
        let says = is_inside
            & is_met
            & share.simd_gt(f32x8::ZERO)
            & squared.simd_le(f32x8::splat(FARTHEST * FARTHEST));
        let trust = measured / all;
        Hypothesis {
            weight: says & (share * share * bell(squared)),
            shift: says & (-trust * off / slope),
            variance: (1.0 - trust) * sigma * sigma,
        }
    }
}

/// `exp(−x / 2)`, within 2e-5 of itself up to the square of `FARTHEST`.
#[inline]
fn bell(x: f32x8) -> f32x8 {
    let y = x * (-0.5 / 16.0);
    let terms = [1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0];
    let sum = terms
        .into_iter()
        .fold(f32x8::splat(1.0 / 120.0), |sum, term| sum * y + term);
    let squared = |s: f32x8| s * s;
    squared(squared(squared(squared(sum))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bell_is_that_of_a_normal_distribution() {
        for k in 0..=90_u8 {
            let x = 0.1 * f32::from(k);
            let expected = (-0.5 * x).exp();
            let found = bell(f32x8::splat(x)).to_array()[0];
            assert!((found / expected - 1.0).abs() < 2e-5, "{x}");
        }
    }
}
