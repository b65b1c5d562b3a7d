// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cells of several sizes around points that are sorted along a space-filling curve.

use rayon::prelude::*;

/// Bits of a coordinate.
const BITS: u32 = 21;
/// Rows of three cells around a cell, and cells.
const N_ROWS: usize = 9;
pub(crate) const N_AROUND: usize = 3 * N_ROWS;
/// Where the cells at the lower and upper side of a cell along each axis are among those around it.
const BESIDE: [[usize; 2]; 3] = [[4, 22], [10, 16], [12, 14]];
/// No cell.
pub(crate) const NONE: u32 = u32::MAX;

/// The place of a finest cell on a curve along which the cells of every larger one lie together.
#[inline]
pub(crate) fn code_of(cell: [u32; 3]) -> u64 {
    let [x, y, z] = cell.map(|c| spread(u64::from(c)));
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

/// Takes every third bit.
#[inline]
fn gathered(c: u64) -> u64 {
    let mut c = c & 0x1249_2492_4924_9249;
    c = (c | c >> 2) & 0x10C3_0C30_C30C_30C3;
    c = (c | c >> 4) & 0x100F_00F0_0F00_F00F;
    c = (c | c >> 8) & 0x001F_0000_FF00_00FF;
    c = (c | c >> 16) & 0x001F_0000_0000_FFFF;
    (c | c >> 32) & ((1 << BITS) - 1)
}

/// The place of a cell with this code among all cells by x, then y, then z.
#[inline]
fn row_key(code: u64) -> u64 {
    let [x, y, z] = [code >> 2, code >> 1, code].map(gathered);
    x << (2 * BITS) | y << BITS | z
}

/// The cells of one size that hold points, numbered along the curve.
#[derive(Clone, Debug, Default)]
pub(crate) struct Level {
    pub edge: f64,
    /// Where the points of each cell begin; the end of the last one is behind them.
    starts: Vec<u32>,
    /// Cells by x, then y, then z: that as one number, and the number of the cell.
    rows: Vec<(u64, u32)>,
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
        let key =
            |(number, &at): (usize, &u32)| (row_key(codes[at as usize] >> shift), number as u32);
        let mut rows: Vec<(u64, u32)> = starts.par_iter().enumerate().map(key).collect();
        rows.par_sort_unstable();
        starts.push(codes.len() as u32);
        Self {
            edge: edge * f64::from(1 << level),
            starts,
            rows,
        }
    }

    pub(crate) fn n_cells(&self) -> usize {
        self.rows.len()
    }

    /// The points of a cell.
    #[inline]
    pub(crate) fn points(&self, number: u32) -> std::ops::Range<usize> {
        let at = number as usize;
        self.starts[at] as usize..self.starts[at + 1] as usize
    }

    /// The cell of a point by its place along the curve.
    pub(crate) fn cell_of(&self, point: usize) -> u32 {
        self.starts.partition_point(|&s| s as usize <= point) as u32 - 1
    }

    /// Number of the cell at a place among the rows.
    #[inline]
    pub(crate) fn in_rows(&self, place: usize) -> u32 {
        self.rows[place].1
    }

    /// Finds the cells around those from a place among the rows on.
    pub(crate) fn around(&self, from: usize) -> Around<'_> {
        let key = self.rows[from].0;
        let mut at = [0; N_ROWS];
        for (row, place) in at.iter_mut().enumerate() {
            let first = first_of_row(key, row);
            *place = self.rows.partition_point(|r| r.0 < first);
        }
        Around { level: self, at }
    }
}

/// The first one of three cells in a row beside the cell with this key.
#[inline]
fn first_of_row(key: u64, row: usize) -> u64 {
    let one = |shift: u32| 1_u64 << shift;
    (key + (row as u64 / 3) * one(2 * BITS) + (row as u64 % 3) * one(BITS))
        .wrapping_sub(one(2 * BITS) + one(BITS) + 1)
}

/// Goes along the rows of cells and tells which others are around.
pub(crate) struct Around<'a> {
    level: &'a Level,
    at: [usize; N_ROWS],
}

impl Around<'_> {
    /// Numbers of the cells around the one at a place among the rows and its own, by x, then y, then z;
    /// `NONE` where there are no points. Places are asked for in their order.
    #[inline]
    pub(crate) fn of(&mut self, place: usize) -> [u32; N_AROUND] {
        let rows = &self.level.rows;
        let key = rows[place].0;
        let mut found = [NONE; N_AROUND];
        for (row, at) in self.at.iter_mut().enumerate() {
            let first = first_of_row(key, row);
            while *at < rows.len() && rows[*at].0 < first {
                *at += 1;
            }
            for (other, number) in rows[*at..].iter().take(3) {
                if *other > first + 2 {
                    break;
                }
                found[3 * row + (other - first) as usize] = *number;
            }
        }
        found
    }
}

/// Of the cells around one, those at its sides: along each axis the lower and the upper.
pub(crate) fn beside(around: &[u32; N_AROUND]) -> [[u32; 2]; 3] {
    BESIDE.map(|sides| sides.map(|k| around[k]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_code_of_a_larger_cell_is_the_beginning_of_its_cells_codes(
            cell in prop::array::uniform3(0..1_u32 << BITS), level in 0..8_u32,
        ) {
            let above = cell.map(|c| c >> level << level);
            prop_assert_eq!(code_of(cell) >> (3 * level), code_of(above) >> (3 * level));
        }

        #[test]
        fn a_code_keeps_the_coordinates(cell in prop::array::uniform3(0..1_u32 << BITS)) {
            let [x, y, z] = cell.map(u64::from);
            prop_assert_eq!(row_key(code_of(cell)), x << 42 | y << 21 | z);
        }
    }

    /// Sorted codes of the cells of some points.
    fn codes(edge: f64) -> Vec<u64> {
        let point = |i: i32| {
            [
                f64::from(i % 7) * 0.3 + 1.0,
                f64::from(i % 11) * 0.21 + 1.1,
                f64::from(i) * 0.01 + 2.0,
            ]
        };
        let mut codes: Vec<u64> = (0..500)
            .map(|i| code_of(point(i).map(|c| (c / edge) as u32)))
            .collect();
        codes.sort_unstable();
        codes
    }

    #[test]
    fn each_point_is_in_the_cell_that_its_code_says() {
        let codes = codes(0.1);
        for level in 0..3 {
            let cells = Level::of(&codes, 0.1, level);
            let counted: usize = (0..cells.n_cells())
                .map(|c| cells.points(c as u32).len())
                .sum();
            assert_eq!(counted, codes.len());
            for (i, code) in codes.iter().enumerate() {
                let own = cells.points(cells.cell_of(i));
                assert!(own.contains(&i));
                assert!(
                    own.into_iter()
                        .all(|k| codes[k] >> (3 * level) == code >> (3 * level))
                );
            }
        }
    }

    #[test]
    fn around_a_cell_are_those_whose_coordinates_differ_by_one() {
        let codes = codes(0.1);
        for level in 0..3 {
            let cells = Level::of(&codes, 0.1, level);
            let place_of = |number: u32| {
                let code = codes[cells.points(number).start] >> (3 * level);
                [code >> 2, code >> 1, code].map(|c| gathered(c) as i64)
            };
            for from in [0, cells.n_cells() / 2] {
                let mut around = cells.around(from);
                for place in from..cells.n_cells() {
                    let own = place_of(cells.in_rows(place));
                    let found = around.of(place);
                    let expected: Vec<u32> = (0..cells.n_cells() as u32)
                        .filter(|&c| (0..3).all(|a| (place_of(c)[a] - own[a]).abs() <= 1))
                        .collect();
                    let mut seen: Vec<u32> = found.into_iter().filter(|&c| c != NONE).collect();
                    seen.sort_unstable();
                    assert_eq!(seen, expected);
                    for (axis, sides) in beside(&found).iter().enumerate() {
                        for (side, &number) in sides.iter().enumerate().filter(|(_, n)| **n != NONE)
                        {
                            let mut at = own;
                            at[axis] += 2 * side as i64 - 1;
                            assert_eq!(place_of(number), at);
                        }
                    }
                }
            }
        }
    }
}
