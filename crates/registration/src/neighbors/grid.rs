// SPDX-License-Identifier: MIT OR Apache-2.0
//! Features sorted into the cells of a voxel grid.

use std::ops::Range;

use bentwing_voxels::VoxelKey;

/// Features whose distances are computed together.
pub(crate) const LANES: usize = 16;

/// Features sorted by grid cell, as a structure of arrays.
///
/// Cells of equal x and y lie behind each other in order of z, so that a column of three cells is
/// one contiguous run.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Key of each non-empty cell, increasing.
    cell_keys: Vec<VoxelKey>,
    /// Features of cell `c` are `cell_starts[c] .. cell_starts[c + 1]`.
    cell_starts: Vec<u32>,
    /// Original index of each sorted feature.
    order: Vec<u32>,
    cell_size: f32,
    /// Position (x, y, z), normal and time of each sorted feature, and `LANES - 1` that are far away.
    columns: [Vec<f32>; 6],
    times: Vec<f32>,
}

impl Grid {
    /// Sorts features into cells of size `cell_size` (in the unit of the positions), which is the
    /// largest distance that can be searched. `times` in seconds; all slices have the same length.
    pub fn new(
        positions: &[[f32; 3]],
        normals: &[[f32; 3]],
        times: &[f64],
        cell_size: f32,
    ) -> Self {
        let mut keyed: Vec<(VoxelKey, u32)> = (0u32..)
            .zip(positions)
            .map(|(i, p)| (key_of(p, cell_size), i))
            .collect();
        keyed.sort_unstable();
        let mut cell_keys = Vec::new();
        let mut cell_starts = Vec::new();
        for (sorted, &(key, _)) in (0u32..).zip(&keyed) {
            if cell_keys.last() != Some(&key) {
                cell_keys.push(key);
                cell_starts.push(sorted);
            }
        }
        cell_starts.push(keyed.len() as u32);
        let order: Vec<u32> = keyed.iter().map(|&(_, i)| i).collect();
        let columns = [
            gather(&order, |i| positions[i][0]),
            gather(&order, |i| positions[i][1]),
            gather(&order, |i| positions[i][2]),
            gather(&order, |i| normals[i][0]),
            gather(&order, |i| normals[i][1]),
            gather(&order, |i| normals[i][2]),
        ];
        let times = gather(&order, |i| times[i] as f32);
        Self {
            cell_keys,
            cell_starts,
            order,
            cell_size,
            columns,
            times,
        }
    }

    /// Number of features.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// Whether there are no features.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// Number of non-empty cells.
    pub(crate) fn n_cells(&self) -> usize {
        self.cell_keys.len()
    }

    /// Sorted features of cell `c`.
    pub(crate) fn cell(&self, c: usize) -> Range<usize> {
        self.cell_starts[c] as usize..self.cell_starts[c + 1] as usize
    }

    /// Key of cell `c`.
    pub(crate) fn cell_key(&self, c: usize) -> VoxelKey {
        self.cell_keys[c]
    }

    /// Original index of sorted feature `s`.
    pub(crate) fn original(&self, s: usize) -> u32 {
        self.order[s]
    }

    /// The six numbers and the time of sorted feature `s`.
    pub(crate) fn feature(&self, s: usize) -> ([f32; 6], f32) {
        (std::array::from_fn(|d| self.columns[d][s]), self.times[s])
    }

    /// The six numbers and the times of `LANES` sorted features from `first` on.
    #[inline]
    pub(crate) fn block(&self, first: usize) -> Option<([&[f32; LANES]; 6], &[f32; LANES])> {
        let [a, b, c, d, e, f] = &self.columns;
        let columns = [
            a.get(first..)?.first_chunk()?,
            b.get(first..)?.first_chunk()?,
            c.get(first..)?.first_chunk()?,
            d.get(first..)?.first_chunk()?,
            e.get(first..)?.first_chunk()?,
            f.get(first..)?.first_chunk()?,
        ];
        Some((columns, self.times.get(first..)?.first_chunk()?))
    }

    /// The nine columns of three cells around the cell with `key`, the middle one first.
    pub(crate) fn columns_around(&self, key: VoxelKey) -> [Column; 9] {
        let [x, y, z] = key.coordinates();
        let side = |i: i64, step: i64| match step {
            -1 => (1.0, i as f32 * self.cell_size),
            0 => (0.0, 0.0),
            _ => (-1.0, (i + 1) as f32 * self.cell_size),
        };
        STEPS.map(|(dx, dy)| {
            let first = VoxelKey::new([x + dx, y + dy, z - 1]);
            let last = VoxelKey::new([x + dx, y + dy, z + 1]);
            let from = self.cell_keys.partition_point(|&k| k < first);
            let n = self.cell_keys[from..]
                .iter()
                .take_while(|&&k| k <= last)
                .count();
            Column {
                run: self.cell_starts[from] as usize..self.cell_starts[from + n] as usize,
                sides: [side(x, dx), side(y, dy)],
                slack: 1e-4 * self.cell_size,
            }
        })
    }
}

/// From a cell to the columns around it: itself, across its sides, across its edges.
const STEPS: [(i64, i64); 9] = [
    (0, 0),
    (-1, 0),
    (1, 0),
    (0, -1),
    (0, 1),
    (-1, -1),
    (-1, 1),
    (1, -1),
    (1, 1),
];

/// Three cells above each other, beside those of a query.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    /// Its sorted features.
    pub(crate) run: Range<usize>,
    /// For x and y: away from the column (or nowhere), and where it ends there.
    sides: [(f32, f32); 2],
    /// What rounding may put on the wrong side.
    slack: f32,
}

impl Column {
    /// Square of a distance that no feature of the column falls short of, for a query in the
    /// middle cell.
    pub(crate) fn square_distance(&self, query: &[f32; 6]) -> f32 {
        let squares = self.sides.iter().zip(query).map(|(&(away, end), q)| {
            let beyond = (away * (q - end) - self.slack).max(0.0);
            beyond * beyond
        });
        squares.sum()
    }
}

/// Values in sorted order, and so many more that a block can begin at the last one.
fn gather(order: &[u32], value: impl Fn(usize) -> f32) -> Vec<f32> {
    let sorted = order.iter().map(|&i| value(i as usize));
    sorted.chain([f32::INFINITY; LANES - 1]).collect()
}

fn key_of(p: &[f32; 3], cell_size: f32) -> VoxelKey {
    VoxelKey::of_whole(p.map(|c| f64::from((c / cell_size).floor())))
}
