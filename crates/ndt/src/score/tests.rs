// SPDX-License-Identifier: MIT OR Apache-2.0
//! The derivatives against central differences, and the sums against one thread's.

use bentwing_trajectory::so3;
use nalgebra::{Isometry3, Translation3, Vector3, Vector6};
use proptest::prelude::*;

use super::*;
use crate::Shape;
use crate::register::moved;

/// Three walls of a room, and its points in the map.
pub(crate) fn room() -> (Reference, Vec<[f64; 3]>) {
    let on_walls = |i: usize| {
        let (a, b) = (
            (i % 67) as f64 * 0.15 + 0.04,
            (i / 67 % 67) as f64 * 0.15 + 0.03,
        );
        match i % 3 {
            0 => [a, b, 0.013 * ((i % 7) as f64 - 3.0) + 0.5],
            1 => [a, 0.5 + 0.011 * ((i % 5) as f64 - 2.0), b],
            _ => [0.5 + 0.012 * ((i % 9) as f64 - 4.0), a, b],
        }
    };
    let points: Vec<[f64; 3]> = (0..13467).map(on_walls).collect();
    let shape = Shape {
        sigma: 0.02,
        roughness: 0.03,
    };
    let mut reference = Reference::new(1.0, 3, shape);
    let lidar = Vector3::new(5.0, 5.0, 5.0);
    reference.insert(&points, &Isometry3::identity(), &lidar);
    (reference, points)
}

/// The points as a sensor at `pose` sees them, one of `every`.
pub(crate) fn seen_from(points: &[[f64; 3]], pose: &Isometry3<f64>, every: usize) -> Vec<[f64; 3]> {
    let seen = points.iter().step_by(every);
    seen.map(|p| pose.inverse_transform_point(&(*p).into()).coords.into())
        .collect()
}

pub(crate) fn pose(r: [f64; 3], t: [f64; 3]) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(t), so3::exp(&Vector3::from(r)))
}

fn vector(max: f64) -> impl Strategy<Value = [f64; 3]> {
    let c = -max..max;
    [c.clone(), c.clone(), c]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// At any attitude and off the best pose. The voxels of the points are held by a step of the
    /// differences so short that hardly any point changes its voxel.
    #[test]
    fn the_gradient_is_that_of_the_cost(
        r in vector(1.8), t in vector(20.0), off in vector(0.01), shift in vector(0.05),
        finest in 0..3_usize, reach in 1.0..4.0_f64,
    ) {
        let (reference, points) = room();
        let truth = pose(r, t);
        let scan = seen_from(&points, &truth, 23);
        let at = moved(&truth, &Vector6::new(off[0], off[1], off[2], shift[0], shift[1], shift[2]));
        let scale = Scale::new(&reference, finest, reach);
        let voxels = |pose: &Isometry3<f64>| -> Vec<Option<usize>> {
            let place = |p: &[f64; 3]| pose.transform_point(&(*p).into()).coords.into();
            scan.iter().map(|p| {
                let here: [f64; 3] = place(p);
                reference.at(&here, finest).map(|(_, g)| std::ptr::from_ref(g).addr())
            }).collect()
        };
        let here = score(&reference, &scan, &at, &scale);
        for i in 0..6 {
            let mut step = Vector6::zeros();
            step[i] = 1e-7;
            let (ahead, behind) = (moved(&at, &step), moved(&at, &-step));
            // A point that changes its voxel makes the score jump.
            if voxels(&ahead) != voxels(&behind) {
                continue;
            }
            let cost = |pose| score(&reference, &scan, pose, &scale).cost;
            let numeric = (cost(&ahead) - cost(&behind)) / 2e-7;
            let size = here.hessian.diagonal().amax().sqrt() * 10.0 + here.gradient.norm();
            prop_assert!((numeric - here.gradient[i]).abs() < 1e-4 * size + 1e-2,
                "{i}: {numeric} against {}", here.gradient[i]);
        }
    }

    /// With all weights one (an endless reach) the cost is ½ Σ m², and its second derivative at
    /// residual zero is the Gauss-Newton matrix.
    #[test]
    fn the_hessian_is_that_of_the_weighted_squares(r in vector(1.8), t in vector(20.0), d in vector(1.0), e in vector(1.0)) {
        let (reference, points) = room();
        let truth = pose(r, t);
        let scan = seen_from(&points, &truth, 23);
        let scale = Scale::new(&reference, 0, 1e4);
        let direction = Vector6::new(d[0], d[1], d[2], e[0], e[1], e[2]) * 1e-7;
        let (ahead, behind) = (moved(&truth, &direction), moved(&truth, &-direction));
        let gradient = |pose| score(&reference, &scan, pose, &scale).gradient;
        let numeric = gradient(&ahead) - gradient(&behind);
        let analytic = score(&reference, &scan, &truth, &scale).hessian * direction * 2.0;
        // What is left out is the curvature of the rotation times residuals of the noise.
        prop_assert!((numeric - analytic).norm() < 0.02 * analytic.norm());
    }
}

#[test]
fn the_decay_is_that_of_the_mixture() {
    // Magnusson 2009, eqs. 6.7 and 6.8, with the outlier ratio 0.55 and voxels of 1 m.
    assert!((decay(1.0) - 0.4326).abs() < 1e-3);
    assert!(decay(4.0) < decay(1.0));
}

#[test]
fn any_number_of_threads_gives_the_same_sums() -> Result<(), rayon::ThreadPoolBuildError> {
    let (reference, points) = room();
    let scale = Scale::new(&reference, 0, 1.0);
    let at = pose([0.01, 0.0, 0.02], [0.03, 0.0, 0.0]);
    let mut all = Vec::new();
    for threads in [1, 2, 4] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()?;
        let sums = pool.install(|| score(&reference, &points, &at, &scale));
        all.push((
            sums.cost.to_bits(),
            sums.gradient.map(f64::to_bits),
            sums.hessian.map(f64::to_bits),
        ));
    }
    assert_eq!(all[0], all[1]);
    assert_eq!(all[0], all[2]);
    Ok(())
}
