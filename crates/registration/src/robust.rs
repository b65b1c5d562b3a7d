// SPDX-License-Identifier: MIT OR Apache-2.0
//! The influence function of matches.

/// Cauchy weight of a residual in standard deviations: 1 at zero, 1/2 at `scale`.
pub fn cauchy_weight(normalized_residual: f64, scale: f64) -> f64 {
    let x = normalized_residual / scale;
    1.0 / (1.0 + x * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outlier_of_ten_sigma_counts_a_hundredth() {
        assert_eq!(cauchy_weight(0.0, 1.0), 1.0);
        assert_eq!(cauchy_weight(-3.0, 3.0), 0.5);
        assert!((cauchy_weight(10.0, 1.0) - 1.0 / 101.0).abs() < 1e-15);
    }
}
