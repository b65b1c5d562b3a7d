// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is wrong with ranges in the same way each time, and does not average out.

use nalgebra::Vector3;

/// A measured range r at the angle of incidence θ is too long by `offset + grazing · r · tan θ`.
///
/// A scale is none of it: with it the whole world would be larger, and nothing the lidar sees says so.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RangeBias {
    /// m.
    pub offset: f64,
    /// rad: the share of a beam's width by which its echo from a slanted surface is late.
    pub grazing: f64,
}

impl RangeBias {
    /// Whether there is none.
    pub fn is_zero(&self) -> bool {
        *self == Self::default()
    }

    /// A point, m, lidar frame, where it is if nothing is known of the surface.
    #[inline]
    pub fn corrected(&self, p: &Vector3<f64>) -> Vector3<f64> {
        let range = p.norm();
        if range <= f64::MIN_POSITIVE {
            return *p;
        }
        p * (1.0 - self.offset / range)
    }

    /// The point that [`Self::corrected`] leads to `p`.
    pub fn measured(&self, p: &Vector3<f64>) -> Vector3<f64> {
        let range = p.norm();
        if range <= f64::MIN_POSITIVE {
            return *p;
        }
        p * (1.0 + self.offset / range)
    }

    /// By how much the range to `sight` is too long, m.
    #[inline]
    pub fn error(&self, sight: &Sight) -> f64 {
        self.offset + self.grazing * sight.slant
    }
}

/// How a surface was looked at.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// Unit vector from the lidar.
    pub ray: Vector3<f64>,
    /// `r tan θ`, m.
    pub slant: f64,
}

impl Sight {
    /// The sight of a point, m, on a surface with this unit normal; all in the lidar frame.
    #[inline]
    pub fn of(point: &Vector3<f64>, normal: &Vector3<f64>) -> Self {
        let range = point.norm().max(f64::MIN_POSITIVE);
        let ray = point / range;
        let along = normal.dot(point).abs().max(LEAST_COSINE * range);
        let aside = (range * range - along * along).max(0.0).sqrt();
        Self {
            ray,
            slant: range * aside / along,
        }
    }
}

/// At smaller cosines of incidence nothing is known of what a beam does.
const LEAST_COSINE: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const BIAS: RangeBias = RangeBias {
        offset: 0.02,
        grazing: 1e-3,
    };

    proptest! {
        #[test]
        fn what_was_measured_is_corrected_back(p in prop::array::uniform3(-20.0..20.0_f64)) {
            let p = Vector3::from(p);
            prop_assume!(p.norm() > 0.1);
            prop_assert!((BIAS.corrected(&BIAS.measured(&p)) - p).norm() < 1e-12);
        }

        #[test]
        fn on_a_surface_that_faces_the_lidar_nothing_is_late(p in prop::array::uniform3(-20.0..20.0_f64)) {
            let p = Vector3::from(p);
            prop_assume!(p.norm() > 0.1);
            let sight = Sight::of(&p, &-p.normalize());
            prop_assert!(sight.slant.abs() < 1e-6 * p.norm());
            let moved = p - sight.ray * BIAS.error(&sight);
            prop_assert!((moved - BIAS.corrected(&p)).norm() < 1e-6);
        }
    }

    #[test]
    fn a_surface_under_45_degrees_is_late_by_its_range() {
        let p = Vector3::new(4.0, 0.0, 0.0);
        let sight = Sight::of(&p, &Vector3::new(-1.0, 1.0, 0.0).normalize());
        assert!((sight.slant - 4.0).abs() < 1e-12);
        assert!((BIAS.error(&sight) - (0.02 + 4e-3)).abs() < 1e-12);
    }

    #[test]
    fn the_lidar_itself_stays_where_it_is() {
        assert_eq!(BIAS.corrected(&Vector3::zeros()), Vector3::zeros());
    }
}
