// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cells of several sizes around points that are sorted along a space-filling curve.

use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Bits of a coordinate.
const BITS: u32 = 21;
const OFFSET: i64 = 1 << (BITS - 1);
/// The cell at another one's side, of which a cell has 26, and itself.
const AROUND: i64 = 3;

/// The place of a finest cell on a curve along which the cells of every larger one lie together.
#[inline]
pub(crate) fn code_of(cell: [i64; 3]) -> u64 {
    let [x, y, z] = cell.map(|c| spread(c.wrapping_add(OFFSET) as u64));
    x << 2 | y << 1 | z
}

/// Puts two zeros behind every bit.
#[inline]
fn spread(c: u64) -> u64 {
    let mut c = c & ((1 << BITS) - 1);
    c = (c | c << 32) & 0x001F_0000_0000_FFFF;
    c = (c | c << 16) & 0x001F_0000_FF00_00FF;
    c = (c | c << 8) & 0x100F_00F0_0F00_F00F;
    c = (c | c << 4) & 0x10C3_0C30_C30C_30C3;
    (c | c << 2) & 0x1249_2492_4924_9249
}

/// The cells of one size that hold points.
#[derive(Clone, Debug, Default)]
pub(crate) struct Level {
    pub edge: f64,
    shift: u32,
    /// Where the points of each cell begin; the end of the last one is behind them.
    pub starts: Vec<u32>,
    numbers: FxHashMap<u64, u32>,
}

impl Level {
    /// Of points with these sorted codes, `level` sizes above the finest cells of `edge`.
    pub(crate) fn of(codes: &[u64], edge: f64, level: u32) -> Self {
        let shift = 3 * level;
        let begins = |i: &usize| *i == 0 || codes[*i] >> shift != codes[*i - 1] >> shift;
        let mut starts: Vec<u32> = (0..codes.len())
            .into_par_iter()
            .filter(begins)
            .map(|i| i as u32)
            .collect();
        let cells = starts.iter().enumerate();
        let numbers = cells
            .map(|(number, &at)| (codes[at as usize] >> shift, number as u32))
            .collect();
        starts.push(codes.len() as u32);
        Self {
            edge: edge * f64::from(1 << level),
            shift,
            starts,
            numbers,
        }
    }

    pub(crate) fn n_cells(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// The points of a cell.
    pub(crate) fn points(&self, number: u32) -> std::ops::Range<usize> {
        let at = number as usize;
        self.starts[at] as usize..self.starts[at + 1] as usize
    }

    /// Coordinates of the cell of a point.
    #[inline]
    pub(crate) fn cell_of(&self, p: &[f64; 3]) -> [i64; 3] {
        p.map(|c| (c / self.edge).floor() as i64)
    }

    /// Number of the cell at some coordinates.
    #[inline]
    pub(crate) fn number(&self, cell: [i64; 3]) -> Option<u32> {
        let fine = cell.map(|c| c << (self.shift / 3));
        self.numbers.get(&(code_of(fine) >> self.shift)).copied()
    }

    /// Numbers of the cells at a cell's sides, edges and corners, and its own.
    pub(crate) fn around(&self, cell: [i64; 3]) -> impl Iterator<Item = u32> + '_ {
        (0..AROUND.pow(3)).filter_map(move |k| {
            let offset = [k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1];
            self.number([0, 1, 2].map(|a| cell[a] + offset[a]))
        })
    }

    /// Numbers of the cells at the three sides of a point's cell that are nearest to it.
    #[inline]
    pub(crate) fn beside(&self, p: &[f64; 3]) -> [Option<u32>; 3] {
        let scaled = p.map(|c| c / self.edge);
        let cell = scaled.map(|c| c.floor() as i64);
        let beside = |axis: usize| {
            let mut other = cell;
            other[axis] += if scaled[axis] - cell[axis] as f64 > 0.5 {
                1
            } else {
                -1
            };
            self.number(other)
        };
        [beside(0), beside(1), beside(2)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_code_of_a_larger_cell_is_the_beginning_of_its_cells_codes(
            cell in prop::array::uniform3(-OFFSET / 2..OFFSET / 2), level in 0..8_u32,
        ) {
            let above = cell.map(|c| c >> level << level);
            prop_assert_eq!(code_of(cell) >> (3 * level), code_of(above) >> (3 * level));
        }
    }

    #[test]
    fn each_point_is_in_the_cell_that_its_coordinates_say() {
        let points: Vec<[f64; 3]> = (0..500)
            .map(|i| {
                [
                    f64::from(i % 7) * 0.3 - 1.0,
                    f64::from(i % 11) * 0.21 - 1.1,
                    f64::from(i) * 0.01 - 2.0,
                ]
            })
            .collect();
        let mut codes: Vec<u64> = points
            .iter()
            .map(|p| code_of(p.map(|c| (c / 0.1).floor() as i64)))
            .collect();
        codes.sort_unstable();
        for level in 0..3 {
            let cells = Level::of(&codes, 0.1, level);
            let counted: usize = (0..cells.n_cells())
                .map(|c| cells.points(c as u32).len())
                .sum();
            assert_eq!(counted, points.len());
            for p in &points {
                let number = cells.number(cells.cell_of(p)).unwrap();
                let of_point = code_of(p.map(|c| (c / 0.1).floor() as i64)) >> (3 * level);
                assert!(
                    cells
                        .points(number)
                        .all(|i| codes[i] >> (3 * level) == of_point)
                );
            }
        }
    }
}
