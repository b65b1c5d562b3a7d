// SPDX-License-Identifier: MIT OR Apache-2.0
//! Points near the middle of a piece, some of which are computed with at once.

use bentwing_voxels::sym3;
use nalgebra::{Matrix3, Vector3};
use wide::f32x8;

/// Spots that are computed with at once; fixed, so that sums are the same on every machine.
pub(crate) const LANES: usize = 8;

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

/// What stands where there is no spot.
pub(crate) const NO_SPOT: Spot = Spot {
    at: [0.0; 3],
    beam: [0.0; 3],
    sigma: 1.0,
    pass: 0,
};

/// Puts those that are chosen before the others.
pub(crate) fn partition(spots: &mut [Spot], chosen: impl Fn(&Spot) -> bool) -> [&mut [Spot]; 2] {
    let mut n_chosen = 0;
    for i in 0..spots.len() {
        if chosen(&spots[i]) {
            spots.swap(n_chosen, i);
            n_chosen += 1;
        }
    }
    spots.split_at_mut(n_chosen).into()
}

/// The normal of a plane through spots, in whose direction they spread least; it faces the lidar.
pub(crate) fn normal_of(spots: &[Spot]) -> Option<Vector3<f64>> {
    let (mut firsts, mut seconds, mut beams) = ([0.0_f32; 3], [0.0_f32; 6], [0.0_f32; 3]);
    for spot in spots {
        let [x, y, z] = spot.at;
        add(&mut firsts, [x, y, z]);
        add(&mut beams, spot.beam);
        add(&mut seconds, [x * x, x * y, x * z, y * y, y * z, z * z]);
    }
    if spots.is_empty() {
        return None;
    }
    let n = spots.len() as f64;
    let mean = Vector3::from(firsts.map(|s| f64::from(s) / n));
    let [xx, xy, xz, yy, yz, zz] = seconds.map(|s| f64::from(s) / n);
    let covariance = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) - mean * mean.transpose();
    let normal = sym3::eigen(&covariance).normal;
    let away = Vector3::from(beams.map(f64::from)).dot(&normal) > 0.0;
    Some(if away { -normal } else { normal })
}

/// Of numbers side by side, always in the same order.
#[inline]
pub(crate) fn total(lanes: f32x8) -> f64 {
    lanes.to_array().into_iter().map(f64::from).sum()
}

#[inline]
pub(crate) fn add<T: std::ops::AddAssign, const N: usize>(sums: &mut [T; N], terms: [T; N]) {
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
