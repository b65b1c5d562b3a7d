// SPDX-License-Identifier: MIT OR Apache-2.0
//! The cells of a grid along a ray, in order.

/// Visits the cells of edge `edge` along `origin + t · direction` for t in [`begin`, `end`]: the
/// cell's coordinates, and where the ray enters and leaves it (Amanatides and Woo 1987).
pub(crate) fn walk(
    origin: &[f64; 3],
    direction: &[f64; 3],
    (begin, end): (f64, f64),
    edge: f64,
    mut visit: impl FnMut([i64; 3], f64, f64),
) {
    let mut cell = [0_i64; 3];
    let mut step = [0_i64; 3];
    let (mut next, mut delta) = ([f64::INFINITY; 3], [f64::INFINITY; 3]);
    for axis in 0..3 {
        let (o, d) = (origin[axis], direction[axis]);
        cell[axis] = ((o + d * begin) / edge).floor() as i64;
        if d.abs() > 1e-12 {
            step[axis] = if d > 0.0 { 1 } else { -1 };
            let border = (cell[axis] + i64::from(d > 0.0)) as f64 * edge;
            next[axis] = (border - o) / d;
            delta[axis] = edge / d.abs();
        }
    }
    let mut at = begin;
    loop {
        let mut axis = usize::from(next[1] < next[0]);
        if next[2] < next[axis] {
            axis = 2;
        }
        let out = next[axis].min(end);
        visit(cell, at, out);
        if next[axis] >= end {
            return;
        }
        at = out.max(at);
        cell[axis] += step[axis];
        next[axis] += delta[axis];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_point_of_the_ray_lies_in_the_cell_visited_then(
            o in prop::array::uniform3(-5.0..5.0_f64),
            d in prop::array::uniform3(-1.0..1.0_f64),
            end in 0.1..9.0_f64,
        ) {
            let mut last = 0.0;
            walk(&o, &d, (0.0, end), 0.3, |cell, from, to| {
                assert!((from - last).abs() < 1e-9 && to >= from - 1e-9);
                let middle = 0.5 * (from + to);
                for axis in 0..3 {
                    let at = (o[axis] + d[axis] * middle) / 0.3 - cell[axis] as f64;
                    assert!((-1e-6..1.0 + 1e-6).contains(&at));
                }
                last = to;
            });
            prop_assert!((last - end).abs() < 1e-9);
        }
    }
}
