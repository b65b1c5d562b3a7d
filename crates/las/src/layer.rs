// SPDX-License-Identifier: MIT OR Apache-2.0
//! The extra bytes of a LAZ chunk, layer after layer.
//!
//! A layer has an encoder and a model of its own. The crate `laz` goes from point to point through all
//! layers, whose models together are larger than the nearest cache, and waits at each symbol for the end
//! of the one before. Here few layers are done side by side, so that the processor works at one while
//! another waits.

use std::array::from_fn;

use crate::arithmetic::{Encoder, Model};

/// Layers side by side.
const TOGETHER: usize = 4;

/// The layers of the last bytes, from `from` on, of all rows of `size` bytes behind the first one; empty
/// for a byte that all rows have in common.
pub(crate) fn layers(rows: &[u8], size: usize, from: usize) -> Vec<Vec<u8>> {
    let n = (rows.len() / size).saturating_sub(1);
    let mut symbols = vec![vec![0; n]; size - from];
    for (i, pair) in rows.windows(2 * size).step_by(size).enumerate() {
        for (k, of_layer) in symbols.iter_mut().enumerate() {
            of_layer[i] = pair[size + from + k].wrapping_sub(pair[from + k]);
        }
    }
    let mut layers = vec![Vec::new(); symbols.len()];
    let changing: Vec<(&[u8], &mut Vec<u8>)> = symbols
        .iter()
        .zip(&mut layers)
        .filter(|(symbols, _)| symbols.iter().any(|&symbol| symbol != 0))
        .map(|(symbols, layer)| (symbols.as_slice(), layer))
        .collect();
    let mut changing = changing.into_iter().peekable();
    while changing.peek().is_some() {
        let mut some: Vec<_> = changing.by_ref().take(TOGETHER).collect();
        let none: &[u8] = &[];
        let symbols: [&[u8]; TOGETHER] = from_fn(|k| some.get(k).map_or(none, |one| one.0));
        let coded = match some.len() {
            TOGETHER => side_by_side(symbols).to_vec(),
            _ => symbols.map(|one| side_by_side([one])).concat(),
        };
        for ((_, layer), bytes) in some.iter_mut().zip(coded) {
            **layer = bytes;
        }
    }
    layers
}

/// Layers of as many symbols each.
fn side_by_side<const N: usize>(symbols: [&[u8]; N]) -> [Vec<u8>; N] {
    let n = symbols.iter().map(|s| s.len()).min().unwrap_or(0);
    let symbols = symbols.map(|s| &s[..n]);
    let mut coders: [(Model, Encoder); N] = from_fn(|_| (Model::new(256), Encoder::new(2 * n)));
    for i in 0..n {
        for (own, (model, encoder)) in symbols.iter().zip(&mut coders) {
            encoder.put(model, u32::from(own[i]));
        }
    }
    coders.map(|(_, encoder)| encoder.finish())
}
