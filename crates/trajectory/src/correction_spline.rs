// SPDX-License-Identifier: MIT OR Apache-2.0
//! The correction that is estimated: a uniform cubic B-spline over the dense trajectory.
//!
//! `δ(t) = Σ_{m=0..3} B_m(u) c_{j+m}` with `t = t0 + (j + u)·h` (Kaul 2015, eq. 3): the high
//! frequencies stay in the trajectory's samples, only their slow error is solved for.

/// Weights of the four control points that act at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Basis {
    /// Index of the first control point.
    pub first: usize,
    /// Weights of control points `first .. first + 4`; they sum to one.
    pub weights: [f64; 4],
}

/// Weights of five neighbouring control points: a linear combination of up to three bases whose
/// times lie within one knot interval of each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StencilWeights {
    /// Index of the first control point.
    pub first: usize,
    /// Weights of control points `first .. first + 5`.
    pub weights: [f64; 5],
}

/// Knots of the correction: `n_controls` control points, `h` seconds apart.
#[derive(Clone, Copy, Debug)]
pub struct CorrectionSpline {
    t0: f64,
    h: f64,
    n_controls: usize,
}

impl CorrectionSpline {
    /// The shortest spline with interval `h` that covers `[start, end]`.
    pub fn covering(start: f64, end: f64, h: f64) -> Self {
        // A stencil needs five control points.
        let intervals = (((end - start) / h).ceil() as usize).max(2);
        Self {
            t0: start,
            h,
            n_controls: intervals + 3,
        }
    }

    /// Number of control points.
    pub fn n_controls(&self) -> usize {
        self.n_controls
    }

    /// Knot interval, s.
    pub fn h(&self) -> f64 {
        self.h
    }

    /// Control points that act at `t`; times outside the spline act like its ends.
    pub fn basis(&self, t: f64) -> Basis {
        let n_intervals = self.n_controls - 3;
        let x = ((t - self.t0) / self.h).clamp(0.0, n_intervals as f64);
        let first = (x as usize).min(n_intervals - 1);
        let u = x - first as f64;
        let (u2, u3, w) = (u * u, u * u * u, 1.0 - u);
        let weights = [
            w * w * w / 6.0,
            (3.0 * u3 - 6.0 * u2 + 4.0) / 6.0,
            (-3.0 * u3 + 3.0 * u2 + 3.0 * u + 1.0) / 6.0,
            u3 / 6.0,
        ];
        Basis { first, weights }
    }

    /// `Σ_k coefficients[k] · δ(times[k])` as weights of control points.
    ///
    /// The times must not be further apart than one knot interval. The finite differences of the
    /// trajectory's samples are differentiated exactly this way, also across a knot.
    pub fn stencil<const K: usize>(
        &self,
        times: [f64; K],
        coefficients: [f64; K],
    ) -> StencilWeights {
        let bases = times.map(|t| self.basis(t));
        let lowest = bases.iter().map(|b| b.first).min().unwrap_or(0);
        let first = lowest.min(self.n_controls.saturating_sub(5));
        let mut weights = [0.0; 5];
        for (basis, c) in bases.iter().zip(coefficients) {
            for (m, w) in basis.weights.iter().enumerate() {
                weights[basis.first + m - first] += c * w;
            }
        }
        StencilWeights { first, weights }
    }

    /// Value of the spline with control points `controls` at `t`.
    pub fn evaluate<const D: usize>(&self, controls: &[[f64; D]], t: f64) -> [f64; D] {
        let basis = self.basis(t);
        let mut value = [0.0; D];
        for (w, c) in basis.weights.iter().zip(&controls[basis.first..]) {
            for (v, c) in value.iter_mut().zip(c) {
                *v += w * c;
            }
        }
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn controls(n: usize) -> Vec<[f64; 1]> {
        (0..n).map(|i| [(1.7 * i as f64).sin()]).collect()
    }

    proptest! {
        #[test]
        fn weights_are_a_partition_of_one(t in -1.0..7.0_f64) {
            let basis = CorrectionSpline::covering(0.0, 5.0, 0.2).basis(t);
            prop_assert!((basis.weights.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            prop_assert!(basis.first + 4 <= 28);
        }

        #[test]
        fn a_stencil_is_the_same_combination_of_values(t in 0.2..4.8_f64, d in 0.0..0.15_f64) {
            let spline = CorrectionSpline::covering(0.0, 5.0, 0.2);
            let c = controls(spline.n_controls());
            let stencil = spline.stencil([t - d / 2.0, t, t + d / 2.0], [1.0, -2.0, 1.0]);
            let by_weights: f64 =
                stencil.weights.iter().zip(&c[stencil.first..]).map(|(w, c)| w * c[0]).sum();
            let value = |t| spline.evaluate(&c, t)[0];
            let direct = value(t - d / 2.0) - 2.0 * value(t) + value(t + d / 2.0);
            prop_assert!((by_weights - direct).abs() < 1e-13);
        }

        #[test]
        fn a_stencil_shorter_than_a_knot_interval_has_its_control_points(
            start in -1e5..1e5_f64, h in 0.02..10.0_f64, share in 0.0..0.4995_f64, u in 0.0..1.0_f64,
        ) {
            let (end, dt) = (start + 7.3 * h, share * h);
            let spline = CorrectionSpline::covering(start, end, h);
            let t = start + u * (end - start);
            let stencil = spline.stencil([t - dt, t, t + dt], [1.0, -2.0, 1.0]);
            prop_assert!(stencil.first + 5 <= spline.n_controls());
            prop_assert!(stencil.weights.iter().sum::<f64>().abs() < 1e-12);
        }
    }

    #[test]
    fn value_slope_and_curvature_are_continuous_at_a_knot() {
        let spline = CorrectionSpline::covering(0.0, 5.0, 0.2);
        let c = controls(spline.n_controls());
        let d = 1e-4;
        let f = |t| spline.evaluate(&c, t)[0];
        let slope = |t: f64| (f(t + d) - f(t - d)) / (2.0 * d);
        let curvature = |t: f64| (f(t + d) - 2.0 * f(t) + f(t - d)) / (d * d);
        assert!((slope(1.0 - 2.0 * d) - slope(1.0 + 2.0 * d)).abs() < 0.1);
        assert!((curvature(1.0 - 2.0 * d) - curvature(1.0 + 2.0 * d)).abs() < 1.0);
    }

    #[test]
    fn the_spline_is_zero_with_two_derivatives_where_the_first_three_controls_are_zero() {
        let spline = CorrectionSpline::covering(0.0, 1.0, 0.2);
        let mut c = controls(spline.n_controls());
        c[..3].fill([0.0]);
        let early = spline.evaluate(&c, 1e-3)[0];
        assert!(early.abs() < 1e-6);
    }
}
