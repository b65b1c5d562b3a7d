// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sorts by digits: numbers of few bits are looked at three times, however many they are.

/// Bits of a digit: as many places as the cache of a core can write to at once.
const DIGIT: u32 = 11;
const N_DIGITS: usize = 1 << DIGIT;

/// Codes in their order, and where each of them was; equal ones stay as they are.
pub(crate) fn in_order(mut codes: Vec<u64>) -> (Vec<u64>, Vec<u32>) {
    let mut order: Vec<u32> = (0..codes.len() as u32).collect();
    let used = codes.iter().fold(0, |bits, code| bits | code);
    let (mut next_codes, mut next_order) = (vec![0; codes.len()], vec![0; codes.len()]);
    for shift in (0..u64::BITS - used.leading_zeros()).step_by(DIGIT as usize) {
        let digit = |code: u64| (code >> shift) as usize % N_DIGITS;
        let mut places = [0_usize; N_DIGITS];
        for &code in &codes {
            places[digit(code)] += 1;
        }
        let mut before = 0;
        for place in &mut places {
            (*place, before) = (before, before + *place);
        }
        for (&code, &at) in codes.iter().zip(&order) {
            let place = &mut places[digit(code)];
            (next_codes[*place], next_order[*place]) = (code, at);
            *place += 1;
        }
        std::mem::swap(&mut codes, &mut next_codes);
        std::mem::swap(&mut order, &mut next_order);
    }
    (codes, order)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn codes_are_sorted_and_equal_ones_stay_in_their_order(
            codes in prop::collection::vec(0..1_u64 << 40, 0..300), few in prop::bool::ANY,
        ) {
            let codes: Vec<u64> = codes.into_iter().map(|c| if few { c % 7 } else { c }).collect();
            let mut expected: Vec<(u64, u32)> = codes.iter().copied().zip(0..).collect();
            expected.sort_unstable();
            let (sorted, order) = in_order(codes);
            let found: Vec<(u64, u32)> = sorted.into_iter().zip(order).collect();
            prop_assert_eq!(found, expected);
        }
    }
}
