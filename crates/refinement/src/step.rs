// SPDX-License-Identifier: MIT OR Apache-2.0
//! Two planes with one normal beside a line. They have fewer parameters than two sheets of any kind, so a step
//! shows that is hardly higher than the noise.

use bentwing_trajectory::so3;
use nalgebra::Vector3;

use crate::sheet::{Room, Sheet};
use crate::split::{FEWEST, FLAT, Half, Pair, Sums, cost, gain, line_between, split};
use crate::spots::{Spot, dot, partition, single};

/// The line of the likeliest step about a given one, where it is likelier than one sheet and than two of any
/// kind.
pub(crate) fn certain_step(
    line: Half,
    spots: &mut [Spot],
    radius: f64,
    normal: &Vector3<f64>,
    room: &mut Room,
) -> Option<Half> {
    let one = Sheet::fit(spots, radius, normal, room)?;
    let first = planes_beside(line, spots, radius, normal, room)?;
    let line = line_between(spots, radius, &first, normal, room);
    let second = line.and_then(|line| planes_beside(line, spots, radius, normal, room));
    let pair = match second {
        Some(second) if cost(&second) < cost(&first) => second,
        _ => first,
    };
    let gained = gain(&pair, &one);
    let is_step = gained > 0.0
        && split(spots, radius, normal, Some(&one), room)
            .is_none_or(|free| gain(&free, &one) < gained);
    is_step.then_some(pair[0].1)
}

/// Two planes with one normal, each on its side of a line.
pub(crate) fn planes_beside(
    line: Half,
    spots: &mut [Spot],
    radius: f64,
    normal: &Vector3<f64>,
    room: &mut Room,
) -> Option<Pair> {
    let sides = partition(spots, |s| line.holds(&s.at));
    if sides.iter().any(|side| side.len() < FEWEST) {
        return None;
    }
    let normal = common_normal(&sides, radius, normal)?;
    let [a, b] = sides.map(|side| Sheet::level(side, radius, &normal, room));
    Some([(a?, line), (b?, line.other())])
}

/// Of the planes with the least squares whose heights are their own.
fn common_normal(
    sides: &[&mut [Spot]; 2],
    radius: f64,
    normal: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let [u, v] = so3::orthogonal_pair(normal);
    let [along, beside, up] = [u / radius, v / radius, *normal].map(|axis| single(&axis));
    let of_side = |side: &&mut [Spot]| {
        let mut sums = Sums::default();
        for s in side.iter() {
            sums.add(dot(&along, &s.at), dot(&beside, &s.at), s, &up);
        }
        sums.variances().map(|s| s * sums.w())
    };
    let [a, b] = [&sides[0], &sides[1]].map(of_side);
    let [uu, uv, vv, uh, vh, _] = std::array::from_fn(|k| a[k] + b[k]);
    let determinant = uu * vv - uv * uv;
    // What lies on a line leaves one slope free.
    let is_wide = determinant > FLAT * uu * vv;
    if !is_wide {
        return None;
    }
    let slopes = [vv * uh - uv * vh, uu * vh - uv * uh].map(|s| s / determinant);
    Some((normal - (u * slopes[0] + v * slopes[1]) / radius).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn planes_beside_a_line_share_a_normal_and_differ_by_the_step(
            slopes in prop::array::uniform2(-0.3..0.3_f32), height in -0.05..0.05_f32,
        ) {
            let spot = |i: usize| {
                let (x, y) = ((i % 10) as f32 * 0.01 - 0.045, (i / 10) as f32 * 0.01 - 0.045);
                let z = slopes[0] * x + slopes[1] * y + if x > 0.0 { height } else { 0.0 };
                Spot { at: [x, y, z], beam: [0.0, 0.0, -1.0], sigma: 0.01, pass: (i % 7) as u8 }
            };
            let mut spots: Vec<Spot> = (0..100).map(spot).collect();
            let line = Half { direction: Vector3::x(), offset: 0.0 };
            let mut room = Room::default();
            let [upper, lower] =
                planes_beside(line, &mut spots, 0.075, &Vector3::z(), &mut room).unwrap();
            prop_assert_eq!(upper.0.axes, lower.0.axes);
            let [x, y, z] = [-slopes[0], -slopes[1], 1.0].map(f64::from);
            let normal = Vector3::new(x, y, z).normalize();
            prop_assert!((upper.0.normal - normal).norm() < 1e-3);
            let apart = upper.0.heights[0] - lower.0.heights[0];
            prop_assert!((apart - f64::from(height) * normal.z).abs() < 1e-4);
        }
    }
}
