// SPDX-License-Identifier: MIT OR Apache-2.0
//! Records of point format 6 as the chunks of a LAZ file.

use std::io::{self, Seek, SeekFrom, Write};

use ::laz::laszip::{ChunkTable, ChunkTableEntry};
use ::laz::record::{LayeredPointRecordCompressor, RecordCompressor};
use ::laz::{LasZipError, LazItem, LazItemRecordBuilder, LazVlr, LazVlrBuilder};
use rayon::prelude::*;

use crate::SIZE;
use crate::layer::layers;

/// Layers of what all records have.
const N_LAYERS: usize = 9;
/// Where the records say of which scanner they are.
const SCANNER: usize = 15;
const SCANNER_BITS: u8 = 0x30;

/// Compresses records into chunks.
#[derive(Clone, Debug)]
pub struct Chunks {
    vlr: LazVlr,
    /// What all records have, and all of it.
    items: [Vec<LazItem>; 2],
    size: usize,
}

impl Chunks {
    /// Of records with so many extra bytes; all chunks but the last are of one size, or each is of its own.
    ///
    /// # Errors
    /// Where there is no such record.
    pub fn new(n_extra: u16, own_sizes: bool) -> Result<Self, LasZipError> {
        let items = LazItemRecordBuilder::default_for_point_format_id(6, n_extra)?;
        let common = LazItemRecordBuilder::default_for_point_format_id(6, 0)?;
        let builder = LazVlrBuilder::new(items.clone());
        let vlr = if own_sizes {
            builder.with_variable_chunk_size().build()
        } else {
            builder.build()
        };
        Ok(Self {
            vlr,
            items: [common, items],
            size: SIZE + usize::from(n_extra),
        })
    }

    /// Bytes of a record.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Records of a chunk where all are of one size.
    pub fn fixed(&self) -> Option<usize> {
        let is_fixed = !self.vlr.uses_variable_size_chunks();
        is_fixed.then(|| self.vlr.chunk_size() as usize)
    }

    /// What the header of the file must announce.
    ///
    /// # Errors
    /// None that writing to memory has.
    pub fn announced(&self) -> Result<Vec<u8>, LasZipError> {
        let mut data = Vec::new();
        self.vlr.write_to(&mut data)?;
        Ok(data)
    }

    /// The chunk of some records, at least one.
    ///
    /// # Errors
    /// None that writing to memory has.
    pub fn compressed(&self, records: &[u8]) -> Result<Vec<u8>, LasZipError> {
        let [common, all] = &self.items;
        let rows = records.chunks_exact(self.size);
        // Each scanner has models of its own.
        if rows.clone().any(|row| row[SCANNER] & SCANNER_BITS != 0) {
            return layered(all, rows);
        }
        let chunk = layered(common, rows.clone().map(|row| &row[..SIZE]))?;
        let first = &records[..self.size];
        let layers = layers(records, self.size, SIZE);
        Ok(joined(&chunk, &first[SIZE..], &layers))
    }
}

/// Records in layers.
fn layered<'a>(
    items: &Vec<LazItem>,
    rows: impl Iterator<Item = &'a [u8]>,
) -> Result<Vec<u8>, LasZipError> {
    let mut compressor = LayeredPointRecordCompressor::new(Vec::new());
    compressor.set_fields_from(items)?;
    for row in rows {
        compressor.compress_next(row)?;
    }
    compressor.done()?;
    Ok(compressor.into_inner())
}

/// The chunk with the extra bytes of its first record, and the layers of those of the others.
fn joined(chunk: &[u8], first: &[u8], layers: &[Option<Vec<u8>>]) -> Vec<u8> {
    let sizes = SIZE + 4 + 4 * N_LAYERS;
    let mut joined = [&chunk[..SIZE], first, &chunk[SIZE..sizes]].concat();
    for layer in layers {
        let size = layer.as_ref().map_or(0, Vec::len) as u32;
        joined.extend(size.to_le_bytes());
    }
    joined.extend(&chunk[sizes..]);
    for layer in layers.iter().flatten() {
        joined.extend(layer);
    }
    joined
}

/// Appends chunks to what a file has before its points.
#[derive(Debug)]
pub struct Appended<W> {
    chunks: Chunks,
    file: W,
    table: ChunkTable,
    /// Of the place of the table.
    start: u64,
}

impl<W: Write + Seek> Appended<W> {
    /// Begins where the file stands.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn new(chunks: Chunks, mut file: W) -> io::Result<Self> {
        let start = file.stream_position()?;
        file.write_all(&start.to_le_bytes())?;
        Ok(Self {
            chunks,
            file,
            table: ChunkTable::default(),
            start,
        })
    }

    /// Appends each of some parts, none of which is empty, as a chunk; they are compressed beside each other.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn append(&mut self, parts: &[&[u8]]) -> Result<(), LasZipError> {
        let compressed: Vec<_> = parts
            .par_iter()
            .map(|part| self.chunks.compressed(part))
            .collect();
        for (part, chunk) in parts.iter().zip(compressed) {
            let chunk = chunk?;
            self.file.write_all(&chunk)?;
            self.table.push(ChunkTableEntry {
                point_count: (part.len() / self.chunks.size) as u64,
                byte_count: chunk.len() as u64,
            });
        }
        Ok(())
    }

    /// Writes the table of the chunks.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn finish(mut self) -> Result<(), LasZipError> {
        let end = self.file.stream_position()?;
        self.file.seek(SeekFrom::Start(self.start))?;
        self.file.write_all(&end.to_le_bytes())?;
        self.file.seek(SeekFrom::Start(end))?;
        self.table.write_to(&mut self.file, &self.chunks.vlr)?;
        self.file.flush()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use ::laz::ParLasZipCompressor;
    use proptest::prelude::*;

    use super::*;

    /// The file of `laz` itself.
    fn expected(records: &[u8], n_extra: u16) -> Vec<u8> {
        let items = LazItemRecordBuilder::default_for_point_format_id(6, n_extra).unwrap();
        let vlr = LazVlrBuilder::new(items).with_fixed_chunk_size(700).build();
        let mut file = ParLasZipCompressor::new(Cursor::new(Vec::new()), vlr).unwrap();
        file.compress_many(records).unwrap();
        file.done().unwrap();
        file.into_inner().into_inner()
    }

    fn ours(records: &[u8], n_extra: u16) -> Vec<u8> {
        let chunks = Chunks::new(n_extra, false).unwrap();
        let parts: Vec<&[u8]> = records.chunks(700 * chunks.size()).collect();
        let mut bytes = Cursor::new(Vec::new());
        let mut file = Appended::new(chunks, &mut bytes).unwrap();
        file.append(&parts).unwrap();
        file.finish().unwrap();
        bytes.into_inner()
    }

    /// Records whose extra bytes are constant, step by step, noisy, or one below the one before.
    fn records(n: usize, seed: u64, scanners: u8) -> Vec<u8> {
        let mut state = seed;
        let mut next = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 56) as u8
        };
        let of_record = |i: usize| {
            let mut row = [0; SIZE + 5];
            for byte in row.iter_mut().take(12).step_by(4) {
                *byte = next();
            }
            row[14] = 0x11;
            row[SCANNER] = (next() & scanners) << 4;
            row[22..30].copy_from_slice(&(i as f64 * 1e-5).to_le_bytes());
            row[SIZE] = 7;
            row[SIZE + 1] = (i / 50) as u8;
            row[SIZE + 2] = next();
            row[SIZE + 3] = 255 - i as u8;
            row[SIZE + 4] = next() & next() & next();
            row
        };
        (0..n).flat_map(of_record).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn a_file_has_the_bytes_that_laz_gives_it(n in 1..3000_usize, seed: u64, scanners in 0..2_u8) {
            let records = records(n, seed, scanners);
            prop_assert!(ours(&records, 5) == expected(&records, 5));
        }
    }

    #[test]
    fn counts_are_halved_as_those_of_laz() {
        let records = records(60_000, 3, 0);
        let chunks = Chunks::new(5, false).unwrap();
        let all = layered(&chunks.items[1], records.chunks_exact(chunks.size())).unwrap();
        assert!(chunks.compressed(&records).unwrap() == all);
    }

    #[test]
    fn a_file_without_points_has_the_bytes_that_laz_gives_it() {
        assert_eq!(ours(&[], 5), expected(&[], 5));
    }

    #[test]
    fn records_without_extra_bytes_are_compressed_too() {
        let rows = records(900, 9, 0);
        let bare: Vec<u8> = rows
            .chunks_exact(SIZE + 5)
            .flat_map(|row| row[..SIZE].to_vec())
            .collect();
        assert!(ours(&bare, 0) == expected(&bare, 0));
    }
}
