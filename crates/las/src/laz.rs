// SPDX-License-Identifier: MIT OR Apache-2.0
//! Records of point format 6 as the chunks of a LAZ file.

use std::io::{self, Seek, SeekFrom, Write};

use ::laz::laszip::{ChunkTable, ChunkTableEntry};
use ::laz::record::{LayeredPointRecordCompressor, RecordCompressor};
use ::laz::{LasZipError, LazItem, LazItemRecordBuilder, LazVlr, LazVlrBuilder};
use rayon::prelude::*;

use crate::layer;
use crate::records::SIZE;
use crate::returns::{self, N_LAYERS};

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
        let of_all = match returns::layers(records, self.size) {
            Some(layers) => layers,
            None => split(&layered(common, rows.clone().map(|row| &row[..SIZE]))?),
        };
        let layers = [&of_all[..], &layer::layers(records, self.size, SIZE)].concat();
        let sizes = layers.iter().map(|layer| layer.len() as u32);
        let n = rows.len() as u32;
        let head: Vec<u8> = std::iter::once(n)
            .chain(sizes)
            .flat_map(u32::to_le_bytes)
            .collect();
        Ok([&records[..self.size], &head, &layers.concat()].concat())
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

/// The layers of a chunk without extra bytes.
fn split(chunk: &[u8]) -> [Vec<u8>; N_LAYERS] {
    let (sizes, mut rest) = chunk[SIZE + 4..].split_at(4 * N_LAYERS);
    std::array::from_fn(|k| {
        let size = &sizes[4 * k..4 * k + 4];
        let size = size
            .iter()
            .rev()
            .fold(0, |n, &byte| n << 8 | usize::from(byte));
        let (layer, behind) = rest.split_at(size);
        rest = behind;
        layer.to_vec()
    })
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

    /// Pseudo-random numbers.
    struct Chance(u64);

    impl Chance {
        fn below(&mut self, n: u64) -> u64 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (self.0 >> 33) % n
        }
    }

    /// What records are like beside their extra bytes.
    #[derive(Clone, Copy, Debug)]
    struct Kind {
        scanners: u64,
        /// Numbers of returns, and of runs.
        returns: u64,
        runs: u64,
        /// One coordinate is within so many bits.
        bits: u32,
        intensities: u64,
        /// Between points, in steps of 1e-7 s, of which some are much longer or go back.
        pause: u64,
    }

    /// Records whose extra bytes are constant, step by step, noisy, or one below the one before.
    fn records(n: usize, seed: u64, kind: Kind) -> Vec<u8> {
        let (mut chance, mut time) = (Chance(seed), 1.0e8);
        let of_record = |i: usize| {
            let mut row = [0; SIZE + 5];
            for axis in 0..3 {
                let at = chance.below(1 << kind.bits) as i32 - (1_i64 << (kind.bits - 1)) as i32;
                row[4 * axis..4 * axis + 4].copy_from_slice(&at.to_le_bytes());
            }
            let intensity = (chance.below(kind.intensities) * 40_503) as u16;
            row[12..14].copy_from_slice(&intensity.to_le_bytes());
            row[14] = 0x11 * (1 + chance.below(kind.returns) as u8);
            row[SCANNER] = (chance.below(kind.scanners) as u8) << 4;
            row[20] = chance.below(kind.runs) as u8;
            time += 1e-7
                * (chance.below(kind.pause) as f64 - 1.0)
                * match chance.below(500) {
                    0 => 1e4,
                    1 => 1e6,
                    2 => -300.0,
                    _ => 1.0,
                };
            row[22..30].copy_from_slice(&f64::to_le_bytes(time));
            row[SIZE] = 7;
            row[SIZE + 1] = (i / 50) as u8;
            row[SIZE + 2] = chance.below(256) as u8;
            row[SIZE + 3] = 255 - i as u8;
            row[SIZE + 4] = (chance.below(256) & chance.below(256)) as u8;
            row
        };
        (0..n).flat_map(of_record).collect()
    }

    const PLAIN: Kind = Kind {
        scanners: 1,
        returns: 1,
        runs: 1,
        bits: 20,
        intensities: 300,
        pause: 60,
    };

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]
        #[test]
        fn a_file_of_single_returns_has_the_bytes_that_laz_gives_it(
            n in 1..3000_usize,
            seed: u64,
            bits in 1..=32_u32,
            intensities in 1..70_000_u64,
            pause in 1..2000_u64,
        ) {
            let kind = Kind { bits, intensities, pause, ..PLAIN };
            let records = records(n, seed, kind);
            prop_assert!(ours(&records, 5) == expected(&records, 5));
        }

        #[test]
        fn a_file_of_anything_has_the_bytes_that_laz_gives_it(
            n in 1..2000_usize,
            seed: u64,
            scanners in 1..3_u64,
            returns in 1..3_u64,
            runs in 1..3_u64,
            pause in prop::sample::select(vec![60, 60_000_000]),
        ) {
            let kind = Kind { scanners, returns, runs, pause, ..PLAIN };
            let records = records(n, seed, kind);
            prop_assert!(ours(&records, 5) == expected(&records, 5));
        }
    }

    #[test]
    fn counts_are_halved_as_those_of_laz() {
        let records = records(60_000, 3, PLAIN);
        let chunks = Chunks::new(5, false).unwrap();
        let all = layered(&chunks.items[1], records.chunks_exact(chunks.size())).unwrap();
        assert!(returns::layers(&records, chunks.size()).is_some());
        assert!(chunks.compressed(&records).unwrap() == all);
    }

    #[test]
    fn a_file_without_points_has_the_bytes_that_laz_gives_it() {
        assert_eq!(ours(&[], 5), expected(&[], 5));
    }

    #[test]
    fn records_without_extra_bytes_are_compressed_too() {
        let rows = records(900, 9, PLAIN);
        let bare: Vec<u8> = rows
            .chunks_exact(SIZE + 5)
            .flat_map(|row| row[..SIZE].to_vec())
            .collect();
        assert!(ours(&bare, 0) == expected(&bare, 0));
    }
}
