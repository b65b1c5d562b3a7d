// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is known of one cell of space.

use bentwing_voxels::Moments;
use nalgebra::{Matrix3, Vector3};

/// Time is told in so many steps; one bit each.
pub(crate) const N_BINS: usize = 256;

/// Steps of time, one bit each.
pub(crate) type Bins = [u64; N_BINS / 64];

/// Fewer points have no surface.
const MIN_POINTS: u32 = 10;
/// A cell's points must spread across by this share of its edge for a plane: those of one scan
/// line leave the normal free to turn about the line.
const MIN_SPREAD: f64 = 0.1;
/// A surface is flat where its thickness is below this share of its smaller extent.
const FLAT: f64 = 0.45;
/// Points are never known better than this share of the edge when beams are followed past them.
const BLUR: f64 = 0.125;
/// A beam so many standard deviations from the middle of a cell's points went through them.
const CORE: f64 = 1.4;
/// Of few points the extent is not known either.
const FEW: u32 = 5;

/// A plane through the points of a cell, relative to its middle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    pub mean: [f32; 3],
    pub normal: [f32; 3],
    /// Standard deviation of the points across the plane.
    pub thickness: f32,
    pub is_flat: bool,
}

impl Plane {
    /// The plane through points, where they have one.
    pub(crate) fn of(sums: &Moments, edge: f64) -> Option<Self> {
        if sums.n() < MIN_POINTS {
            return None;
        }
        let e = sums.eigen();
        let spread = e.values[1].max(0.0).sqrt();
        if spread < MIN_SPREAD * edge {
            return None;
        }
        // With the plane itself fitted to the n points.
        let n = f64::from(sums.n());
        let thickness = (e.values[0].max(0.0) * n / (n - 3.0)).sqrt();
        Some(Self {
            mean: sums.mean().map(|v| v as f32).into(),
            normal: e.normal.map(|v| v as f32).into(),
            thickness: thickness as f32,
            is_flat: thickness < FLAT * spread,
        })
    }
}

/// Where the points of a cell are, relative to its middle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Core {
    mean: Vector3<f64>,
    inverse: Matrix3<f64>,
}

impl Core {
    /// The ellipsoid a beam must pass through to have been where the points are.
    pub(crate) fn of(sums: &Moments, edge: f64) -> Option<Self> {
        if sums.n() == 0 {
            return None;
        }
        let blur = if sums.n() < FEW { 1.6 * BLUR } else { BLUR } * edge;
        let wide = sums.covariance() + Matrix3::from_diagonal_element(blur * blur);
        let inverse = wide.try_inverse()?;
        Some(Self {
            mean: sums.mean(),
            inverse,
        })
    }

    /// Where along a ray that begins at `origin` it comes nearest to the middle of the points, if
    /// it comes nearer than `CORE`.
    pub(crate) fn crossing(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let m = self.mean - origin;
        let weighted = self.inverse * direction;
        let along = m.dot(&weighted) / direction.dot(&weighted);
        let miss = m - along * direction;
        (miss.dot(&(self.inverse * miss)) < CORE * CORE).then_some(along)
    }
}

/// What a survey keeps of a cell.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Cell {
    /// Relative to the middle of the cell.
    pub sums: Moments,
    pub hits: Bins,
}

pub(crate) fn set(bins: &mut Bins, bin: u8) {
    bins[usize::from(bin) / 64] |= 1 << (bin % 64);
}

/// Number of bins in `a` and not in `b`.
pub(crate) fn count_without(a: &Bins, b: &Bins) -> u32 {
    a.iter().zip(b).map(|(a, b)| (a & !b).count_ones()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn the_plane_of_a_noisy_tilted_patch_has_its_normal_and_thickness() {
        let normal = Vector3::new(1.0, -2.0, 2.0) / 3.0;
        let (u, v) = (
            Vector3::new(2.0, 2.0, 1.0) / 3.0,
            Vector3::new(-2.0, 1.0, 2.0) / 3.0,
        );
        let mut sums = Moments::default();
        for i in 0..20 {
            for j in 0..20 {
                let off = if (i + j) % 2 == 0 { 0.01 } else { -0.01 };
                let p = u * (f64::from(i) * 0.01) + v * (f64::from(j) * 0.01) + normal * off;
                sums.add_point(p.into());
            }
        }
        let plane = Plane::of(&sums, 0.2);
        assert!(plane.is_some_and(|p| {
            let n = Vector3::from(p.normal).map(f64::from);
            n.dot(&normal).abs() > 0.9999 && (f64::from(p.thickness) - 0.01).abs() < 2e-4
        }));
    }

    #[test]
    fn points_on_a_line_have_no_plane() {
        let mut sums = Moments::default();
        for i in 0..50 {
            sums.add_point([0.004 * f64::from(i), 0.0, 0.0]);
        }
        assert!(Plane::of(&sums, 0.2).is_none());
    }

    #[test]
    fn a_ray_through_the_middle_crosses_and_one_beside_does_not() {
        let mut sums = Moments::default();
        for i in 0..100 {
            sums.add_point([0.01 * f64::from(i % 10), 0.01 * f64::from(i / 10), 0.0]);
        }
        let core = Core::of(&sums, 0.2);
        let down = Vector3::new(0.0, 0.0, -1.0);
        let from = |x| Vector3::new(x, 0.045, 2.0);
        assert!(core.is_some_and(|c| {
            c.crossing(&from(0.05), &down)
                .is_some_and(|t| (t - 2.0).abs() < 1e-9)
                && c.crossing(&from(0.2), &down).is_none()
        }));
    }
}
