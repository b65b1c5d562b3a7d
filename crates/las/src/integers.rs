// SPDX-License-Identifier: MIT OR Apache-2.0
//! Integers by how far they are from what was expected.

use crate::arithmetic::{BitModel, Encoder, Model};

/// More bits of a difference have a model for the upper ones alone.
const MODELLED: u32 = 8;

/// Encodes integers of `BITS` bits.
#[derive(Clone, Debug)]
pub(crate) struct Integers<const BITS: u32> {
    /// By the context, of the number of bits.
    n_bits: Vec<Model>,
    /// Of differences with no more bits than zero and one have.
    smallest: BitModel,
    /// By the number of bits, from one on.
    upper: Vec<Model>,
    /// Number of bits of the latest difference.
    pub latest: u32,
}

impl<const BITS: u32> Integers<BITS> {
    pub(crate) fn new(n_contexts: usize) -> Self {
        Self {
            n_bits: vec![Model::new(BITS as usize + 1); n_contexts],
            smallest: BitModel::default(),
            upper: (1..=BITS)
                .map(|n| Model::new(1 << n.min(MODELLED)))
                .collect(),
            latest: 0,
        }
    }

    #[inline]
    pub(crate) fn put(&mut self, encoder: &mut Encoder, expected: i32, value: i32, context: usize) {
        // Of 16 bits, the shorter way around.
        let unused = 32 - BITS;
        let difference = value.wrapping_sub(expected) << unused >> unused;
        let is_negative = difference <= 0;
        let size = if is_negative {
            difference.wrapping_neg()
        } else {
            difference - 1
        };
        let n = 32 - (size as u32).leading_zeros();
        self.latest = n;
        encoder.put(&mut self.n_bits[context], n);
        if n == 0 {
            encoder.put_bit(&mut self.smallest, difference != 0);
        } else if n < 32 {
            let mask = (1_u32 << n) - 1;
            let bits = if is_negative {
                (difference as u32).wrapping_add(mask)
            } else {
                size as u32
            };
            let n_raw = n.saturating_sub(MODELLED);
            encoder.put(&mut self.upper[n as usize - 1], bits >> n_raw);
            if n_raw > 0 {
                encoder.put_raw(n_raw, bits & ((1 << n_raw) - 1));
            }
        }
    }
}
