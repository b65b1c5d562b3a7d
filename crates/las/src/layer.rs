// SPDX-License-Identifier: MIT OR Apache-2.0
//! The extra bytes of a LAZ chunk, layer after layer.
//!
//! A layer has an encoder and a model of its own. The crate `laz` goes from point to point through all
//! layers, whose models together are larger than the nearest cache, and waits at each symbol for the end
//! of the one before. Here few layers are done side by side, so that the processor works at one while
//! another waits.

/// Bits of the probabilities of a model.
const SHIFT: u32 = 15;
/// Counts of a model are halved when they are more.
const MOST: u32 = 1 << SHIFT;
/// Bytes go out when the interval is shorter.
const SHORTEST: u32 = 1 << 24;
const N_SYMBOLS: usize = 256;
/// Symbols until a model is updated: at first, and at most.
const FIRST_CYCLE: u32 = (N_SYMBOLS as u32 + 6) >> 1;
const LONGEST_CYCLE: u32 = (N_SYMBOLS as u32 + 6) << 3;
/// Bytes that a symbol may take, and that are written at a time.
const MOST_BYTES: usize = 2;
const AT_ONCE: usize = 4;
/// Layers side by side.
const TOGETHER: usize = 4;

/// The layers of the last bytes, from `from` on, of all rows of `size` bytes behind the first one; none
/// for a byte that all rows have in common.
pub(crate) fn layers(rows: &[u8], size: usize, from: usize) -> Vec<Option<Vec<u8>>> {
    let n = (rows.len() / size).saturating_sub(1);
    let mut symbols = vec![vec![0; n]; size - from];
    for (i, pair) in rows.windows(2 * size).step_by(size).enumerate() {
        for (k, of_layer) in symbols.iter_mut().enumerate() {
            of_layer[i] = pair[size + from + k].wrapping_sub(pair[from + k]);
        }
    }
    let is_changing = |of_layer: &&Vec<u8>| of_layer.iter().any(|&symbol| symbol != 0);
    let changing: Vec<&Vec<u8>> = symbols.iter().filter(is_changing).collect();
    let mut coded = changing.chunks(TOGETHER).flat_map(|some| match some {
        [a, b, c, d] => side_by_side([a, b, c, d]).to_vec(),
        few => few.iter().flat_map(|one| side_by_side([one])).collect(),
    });
    symbols
        .iter()
        .map(|one| is_changing(&one).then(|| coded.next()).flatten())
        .collect()
}

/// Layers of as many symbols each.
fn side_by_side<const N: usize>(symbols: [&Vec<u8>; N]) -> [Vec<u8>; N] {
    let n = symbols.iter().map(|s| s.len()).min().unwrap_or(0);
    let symbols = symbols.map(|s| &s[..n]);
    let mut models: [Model; N] = std::array::from_fn(|_| Model::new());
    let mut encoders: [Encoder; N] = std::array::from_fn(|_| Encoder::new(n));
    for i in 0..n {
        for k in 0..N {
            encoders[k].put(&mut models[k], symbols[k][i]);
        }
    }
    encoders.map(Encoder::finish)
}

/// How often each symbol came so far.
struct Model {
    /// Share of the symbols below each, and one behind.
    below: [u32; N_SYMBOLS + 1],
    counts: [u32; N_SYMBOLS],
    total: u32,
    cycle: u32,
    left: u32,
}

impl Model {
    fn new() -> Self {
        let mut model = Self {
            below: [0; N_SYMBOLS + 1],
            counts: [1; N_SYMBOLS],
            total: 0,
            cycle: N_SYMBOLS as u32,
            left: 0,
        };
        model.update();
        (model.cycle, model.left) = (FIRST_CYCLE, FIRST_CYCLE);
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
        for (below, count) in self.below.iter_mut().zip(self.counts) {
            *below = (scale * sum) >> (31 - SHIFT);
            sum += count;
        }
        self.cycle = ((5 * self.cycle) >> 2).min(LONGEST_CYCLE);
        self.left = self.cycle;
    }
}

/// Arithmetic encoder (Said 2004), without branches that cannot be foreseen.
struct Encoder {
    /// One for a carry that never comes, those that are out, and room.
    bytes: Vec<u8>,
    n: usize,
    base: u32,
    length: u32,
}

impl Encoder {
    /// For so many symbols.
    fn new(n: usize) -> Self {
        Self {
            bytes: vec![0; 1 + MOST_BYTES * (n + 2) + AT_ONCE],
            n: 1,
            base: 0,
            length: u32::MAX,
        }
    }

    #[inline]
    fn put(&mut self, model: &mut Model, symbol: u8) {
        let at = usize::from(symbol);
        let unit = self.length >> SHIFT;
        let low = model.below[at] * unit;
        let next = model.below[at + 1] * unit;
        // The last symbol takes what rounding leaves.
        let high = if at == N_SYMBOLS - 1 {
            self.length
        } else {
            next
        };
        self.narrow(low, high - low);
        model.counts[at] += 1;
        model.left -= 1;
        if model.left == 0 {
            model.update();
        }
    }

    /// Narrows the interval, and puts out the bytes that are certain.
    #[inline]
    fn narrow(&mut self, by: u32, length: u32) {
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

    fn finish(mut self) -> Vec<u8> {
        let is_long = self.length > 2 * SHORTEST;
        let (by, length) = if is_long {
            (SHORTEST, SHORTEST >> 1)
        } else {
            (SHORTEST >> 1, SHORTEST >> 9)
        };
        self.narrow(by, length);
        // Decoders read so far ahead.
        self.bytes.truncate(self.n);
        self.bytes
            .extend([0; 3].iter().take(2 + usize::from(is_long)));
        self.bytes.remove(0);
        self.bytes
    }
}
