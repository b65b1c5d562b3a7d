// SPDX-License-Identifier: MIT OR Apache-2.0
//! Chooses some points of a scan, evenly in space.

use rustc_hash::FxHashSet;

use crate::VoxelKey;

/// Indices of the first point in each voxel of edge `spacing`, m, and evenly chosen ones of these
/// where they are more than `most`.
///
/// Near the sensor a scan is dense; unthinned, the nearest surface alone would decide its pose.
pub fn thin(points: &[[f64; 3]], spacing: f64, most: usize) -> Vec<usize> {
    let mut seen = FxHashSet::with_capacity_and_hasher(points.len() / 2, rustc_hash::FxBuildHasher);
    let first = |i: &usize| seen.insert(VoxelKey::of(&points[*i], 1.0 / spacing));
    let kept: Vec<usize> = (0..points.len()).filter(first).collect();
    let n = kept.len().min(most);
    (0..n).map(|i| kept[i * kept.len() / n]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_point_of_each_voxel_is_kept_and_no_more_than_asked_for() {
        let points: Vec<[f64; 3]> = (0..1000)
            .map(|i| [0.01 * f64::from(i), 0.05, -0.05])
            .collect();
        let kept = thin(&points, 0.5, 1000);
        assert_eq!(kept, (0..20).map(|i| 50 * i).collect::<Vec<_>>());
        let fewer = thin(&points, 0.5, 7);
        assert_eq!(fewer.len(), 7);
        assert!(fewer.windows(2).all(|w| w[0] < w[1]));
        assert!(thin(&[], 0.5, 7).is_empty());
    }
}
