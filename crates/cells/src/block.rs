// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cells by their place: blocks of 4³ cells in shards, so that threads fill them without meeting.

use bentwing_voxels::VoxelKey;
use rustc_hash::FxHashMap;

use crate::cell::Cell;

/// Shards; more than threads, so that they share the work evenly.
pub(crate) const N_SHARDS: usize = 1 << SHARD_BITS;
const SHARD_BITS: u32 = 4;
const NO_CELL: u32 = u32::MAX;

/// Block of a cell, and the cell's place in it.
#[inline]
pub(crate) fn block_of(cell: [i64; 3]) -> (VoxelKey, usize) {
    let [x, y, z] = cell.map(|c| (c & 3) as usize);
    (VoxelKey::new(cell.map(|c| c >> 2)), x << 4 | y << 2 | z)
}

/// Shard of a block.
#[inline]
pub(crate) fn shard_of(block: VoxelKey) -> usize {
    block.class(SHARD_BITS)
}

/// Middle of a cell.
#[inline]
pub(crate) fn middle_of(cell: [i64; 3], edge: f64) -> [f64; 3] {
    cell.map(|c| (c as f64 + 0.5) * edge)
}

/// A share of all blocks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shard {
    places: FxHashMap<VoxelKey, u32>,
    /// Indices of the cells of each block.
    blocks: Vec<[u32; 64]>,
    pub cells: Vec<Cell>,
    /// Where each cell is.
    pub coordinates: Vec<[i64; 3]>,
}

impl Shard {
    pub(crate) fn cell_mut(&mut self, at: [i64; 3]) -> &mut Cell {
        let (key, place) = block_of(at);
        let n_blocks = self.blocks.len() as u32;
        let block = *self.places.entry(key).or_insert(n_blocks);
        if block == n_blocks {
            self.blocks.push([NO_CELL; 64]);
        }
        let index = &mut self.blocks[block as usize][place];
        if *index == NO_CELL {
            *index = self.cells.len() as u32;
            self.cells.push(Cell::default());
            self.coordinates.push(at);
        }
        &mut self.cells[*index as usize]
    }

    /// The cells of a block, by their place in it.
    #[inline]
    pub(crate) fn block(&self, key: VoxelKey) -> Option<&[u32; 64]> {
        self.places.get(&key).map(|&b| &self.blocks[b as usize])
    }

    /// Index of the cell at a place of a block.
    #[inline]
    pub(crate) fn index(&self, key: VoxelKey, place: usize) -> Option<u32> {
        let index = self.block(key)?[place];
        (index != NO_CELL).then_some(index)
    }
}

/// The cells of a block that exist, by their place in it.
#[inline]
pub(crate) fn present(block: &[u32; 64], place: usize) -> Option<u32> {
    (block[place] != NO_CELL).then_some(block[place])
}

/// Shard and index of the cell at some coordinates.
#[inline]
pub(crate) fn find(shards: &[Shard], at: [i64; 3]) -> Option<(usize, u32)> {
    let (key, place) = block_of(at);
    let shard = shard_of(key);
    Some((shard, shards[shard].index(key, place)?))
}
