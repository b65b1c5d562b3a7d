// SPDX-License-Identifier: MIT OR Apache-2.0
//! Arithmetic coding as LAZ has it (Said 2004), without branches that cannot be foreseen.

/// Bits of the probabilities of a model.
const SHIFT: u32 = 15;
/// Counts of a model are halved when they are more.
const MOST: u32 = 1 << SHIFT;
/// The same of the model of a bit, and until when it is updated at most.
const BIT_SHIFT: u32 = 13;
const MOST_BITS: u32 = 1 << BIT_SHIFT;
const LONGEST_BIT_CYCLE: u32 = 64;
/// Bytes go out when the interval is shorter.
const SHORTEST: u32 = 1 << 24;
/// Bytes that are written at a time, of which at most three are certain.
const AT_ONCE: usize = 4;
/// Bits without a model that are put in at a time.
const MOST_RAW: u32 = 19;

/// How often each symbol came so far.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    /// Share of the symbols below each; behind the last one anything.
    below: Vec<u32>,
    counts: Vec<u32>,
    total: u32,
    cycle: u32,
    left: u32,
}

impl Model {
    pub(crate) fn new(n_symbols: usize) -> Self {
        let mut model = Self {
            below: vec![0; n_symbols + 1],
            counts: vec![1; n_symbols],
            total: 0,
            cycle: n_symbols as u32,
            left: 0,
        };
        model.update();
        model.cycle = (n_symbols as u32 + 6) >> 1;
        model.left = model.cycle;
        model
    }

    #[cold]
    fn update(&mut self) {
        self.total += self.cycle;
        if self.total > MOST {
            self.total = 0;
            for count in &mut self.counts {
                *count = (*count + 1) >> 1;
                self.total += *count;
            }
        }
        let scale = 0x8000_0000 / self.total;
        let mut sum = 0;
        for (below, count) in self.below.iter_mut().zip(&self.counts) {
            *below = (scale * sum) >> (31 - SHIFT);
            sum += count;
        }
        let longest = (self.counts.len() as u32 + 6) << 3;
        self.cycle = ((5 * self.cycle) >> 2).min(longest);
        self.left = self.cycle;
    }
}

/// How often a bit was zero so far.
#[derive(Clone, Debug)]
pub(crate) struct BitModel {
    n_zero: u32,
    n: u32,
    zero: u32,
    cycle: u32,
    left: u32,
}

impl Default for BitModel {
    fn default() -> Self {
        Self {
            n_zero: 1,
            n: 2,
            zero: 1 << (BIT_SHIFT - 1),
            cycle: 4,
            left: 4,
        }
    }
}

impl BitModel {
    #[cold]
    fn update(&mut self) {
        self.n += self.cycle;
        if self.n > MOST_BITS {
            self.n = (self.n + 1) >> 1;
            self.n_zero = (self.n_zero + 1) >> 1;
            self.n += u32::from(self.n_zero == self.n);
        }
        self.zero = (self.n_zero * (0x8000_0000 / self.n)) >> (31 - BIT_SHIFT);
        self.cycle = ((5 * self.cycle) >> 2).min(LONGEST_BIT_CYCLE);
        self.left = self.cycle;
    }
}

/// Makes bytes of symbols.
#[derive(Clone, Debug)]
pub(crate) struct Encoder {
    /// One for a carry that never comes, those that are out, and room.
    bytes: Vec<u8>,
    n: usize,
    base: u32,
    length: u32,
}

impl Encoder {
    /// With room for so many bytes at first.
    pub(crate) fn new(room: usize) -> Self {
        Self {
            bytes: vec![0; room + 1 + AT_ONCE],
            n: 1,
            base: 0,
            length: u32::MAX,
        }
    }

    #[inline]
    pub(crate) fn put(&mut self, model: &mut Model, symbol: u32) {
        let at = symbol as usize;
        let unit = self.length >> SHIFT;
        let low = model.below[at] * unit;
        let next = model.below[at + 1].wrapping_mul(unit);
        // The last symbol takes what rounding leaves.
        let is_last = at + 1 == model.counts.len();
        let high = if is_last { self.length } else { next };
        self.narrow(low, high - low);
        model.counts[at] += 1;
        model.left -= 1;
        if model.left == 0 {
            model.update();
        }
    }

    #[inline]
    pub(crate) fn put_bit(&mut self, model: &mut BitModel, bit: bool) {
        let zero = model.zero * (self.length >> BIT_SHIFT);
        if bit {
            self.narrow(zero, self.length - zero);
        } else {
            self.narrow(0, zero);
            model.n_zero += 1;
        }
        model.left -= 1;
        if model.left == 0 {
            model.update();
        }
    }

    /// The last `n` bits, 32 at most, of a value that has no others.
    #[inline]
    pub(crate) fn put_raw(&mut self, n: u32, value: u32) {
        let (mut n, mut value) = (n, value);
        if n > MOST_RAW {
            self.raw(16, value & 0xFFFF);
            (n, value) = (n - 16, value >> 16);
        }
        self.raw(n, value);
    }

    #[inline]
    fn raw(&mut self, n: u32, value: u32) {
        let unit = self.length >> n;
        self.narrow(value * unit, unit);
    }

    /// Narrows the interval, and puts out the bytes that are certain.
    #[inline]
    fn narrow(&mut self, by: u32, length: u32) {
        if self.n + AT_ONCE > self.bytes.len() {
            self.bytes.resize(2 * self.bytes.len(), 0);
        }
        let (base, is_more) = self.base.overflowing_add(by);
        let before = &mut self.bytes[self.n - 1];
        let (carried, goes_on) = before.overflowing_add(u8::from(is_more));
        *before = carried;
        if goes_on {
            self.carry();
        }
        let n_out = length.leading_zeros() / 8;
        self.bytes[self.n..self.n + AT_ONCE].copy_from_slice(&base.to_be_bytes());
        self.n += n_out as usize;
        self.base = base << (8 * n_out);
        self.length = length << (8 * n_out);
    }

    #[cold]
    fn carry(&mut self) {
        for byte in self.bytes[..self.n - 1].iter_mut().rev() {
            *byte = byte.wrapping_add(1);
            if *byte != 0 {
                break;
            }
        }
    }

    /// All bytes, and as many zeros as decoders read ahead.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        let is_long = self.length > 2 * SHORTEST;
        let (by, length) = if is_long {
            (SHORTEST, SHORTEST >> 1)
        } else {
            (SHORTEST >> 1, SHORTEST >> 9)
        };
        self.narrow(by, length);
        self.bytes.truncate(self.n);
        self.bytes.resize(self.n + 2 + usize::from(is_long), 0);
        self.bytes.remove(0);
        self.bytes
    }
}
