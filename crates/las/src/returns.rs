// SPDX-License-Identifier: MIT OR Apache-2.0
//! What all records of a LAZ chunk have, where only place, intensity and time change.
//!
//! This is what the crate `laz` does with such records, without what it does for all others.

use std::ops::Range;

use crate::arithmetic::{Encoder, Model};
use crate::integers::Integers;
use crate::records::{ONLY_RETURN, SIZE};

/// Layers: places along the ground, heights, four that do not change, intensities and so on, times.
pub(crate) const N_LAYERS: usize = 9;
const PLANE: usize = 0;
const HEIGHT: usize = 1;
const INTENSITY: usize = 4;
const TIME: usize = 8;
/// Of a record: number of the return, and what stays the same between it and the time.
const RETURN: usize = 14;
const SAME: Range<usize> = 15..22;
/// The scanner is the first one.
const SCANNER_BITS: u8 = 0x30;
/// Context of a return that is the first and the last one.
const SINGLE: usize = 3;
/// That the time is another one than that of the record before.
const TIME_CHANGED: u32 = 16;
/// Most bits of a step that have contexts of their own for the coordinates behind.
const MOST_BITS: [u32; 2] = [20, 18];
/// Steps of time are told by how many times they are that of before: up to so many times, or back.
const MOST_TIMES: i32 = 500;
const MOST_TIMES_BACK: i32 = -10;
const N_TIMES: usize = 515;
/// So many steps that are no usual multiple make a new usual one.
const PATIENCE: u32 = 3;

/// The layers of all records behind the first one, if nothing but place, intensity and time changes.
pub(crate) fn layers(rows: &[u8], size: usize) -> Option<[Vec<u8>; N_LAYERS]> {
    let rows = rows.chunks_exact(size);
    let first = rows.clone().next()?;
    let is_alike = |row: &[u8]| row[RETURN] == ONLY_RETURN && row[SAME] == first[SAME];
    if first[SAME.start] & SCANNER_BITS != 0 || !rows.clone().all(is_alike) {
        return None;
    }
    let room = rows.len();
    let mut coder = Coder::new(&Return::of(first), room);
    for row in rows.skip(1) {
        coder.put(&Return::of(row))?;
    }
    Some(coder.finish())
}

/// What changes between records.
#[derive(Clone, Copy, Debug)]
struct Return {
    at: [i32; 3],
    intensity: i32,
    time: i64,
}

impl Return {
    #[inline]
    fn of(row: &[u8]) -> Self {
        let row: &[u8; SIZE] = row[..SIZE].try_into().unwrap_or(&[0; SIZE]);
        let int = |k: usize| i32::from_le_bytes([row[k], row[k + 1], row[k + 2], row[k + 3]]);
        let half = |k: usize| i64::from(int(k) as u32);
        Self {
            at: [int(0), int(4), int(8)],
            intensity: i32::from(u16::from_le_bytes([row[12], row[13]])),
            time: half(22) | half(26) << 32,
        }
    }
}

struct Coder {
    before: Return,
    has_other_time: usize,
    has_other_intensity: bool,
    plane: Encoder,
    height: Encoder,
    intensity: Encoder,
    changes: Vec<Model>,
    steps: [Integers<32>; 2],
    heights: Integers<32>,
    /// Of the steps along both axes, by whether the time changes.
    medians: [[Median; 2]; 2],
    intensities: Integers<16>,
    /// By whether the time changes.
    usual_intensities: [i32; 2],
    times: Times,
}

impl Coder {
    fn new(first: &Return, room: usize) -> Self {
        Self {
            before: *first,
            has_other_time: 0,
            has_other_intensity: false,
            plane: Encoder::new(4 * room),
            height: Encoder::new(2 * room),
            intensity: Encoder::new(2 * room),
            changes: vec![Model::new(128); 2],
            steps: [Integers::new(2), Integers::new(22)],
            heights: Integers::new(20),
            medians: Default::default(),
            intensities: Integers::new(4),
            usual_intensities: [first.intensity; 2],
            times: Times::new(room),
        }
    }

    /// None where the time is too far from that before.
    #[inline]
    fn put(&mut self, now: &Return) -> Option<()> {
        let before = std::mem::replace(&mut self.before, *now);
        let is_other = usize::from(now.time != before.time);
        self.plane.put(
            &mut self.changes[self.has_other_time],
            is_other as u32 * TIME_CHANGED,
        );
        self.has_other_time = is_other;
        let [of_x, of_y] = &mut self.steps;
        let medians = &mut self.medians[is_other];
        let step = |axis: usize| now.at[axis].wrapping_sub(before.at[axis]);
        of_x.put(&mut self.plane, medians[0].value(), step(0), 1);
        medians[0].add(step(0));
        let context = 1 + (of_x.latest & !1).min(MOST_BITS[0]) as usize;
        of_y.put(&mut self.plane, medians[1].value(), step(1), context);
        medians[1].add(step(1));
        let n_bits = u32::midpoint(of_x.latest, of_y.latest);
        let context = 1 + (n_bits & !1).min(MOST_BITS[1]) as usize;
        self.heights
            .put(&mut self.height, before.at[2], now.at[2], context);
        let usual = &mut self.usual_intensities[is_other];
        self.intensities
            .put(&mut self.intensity, *usual, now.intensity, SINGLE);
        *usual = now.intensity;
        self.has_other_intensity |= now.intensity != before.intensity;
        if is_other == 1 {
            let step = i32::try_from(now.time.wrapping_sub(before.time)).ok()?;
            self.times.put(step);
        }
        Some(())
    }

    fn finish(self) -> [Vec<u8>; N_LAYERS] {
        let mut layers: [Vec<u8>; N_LAYERS] = Default::default();
        layers[PLANE] = self.plane.finish();
        layers[HEIGHT] = self.height.finish();
        if self.has_other_intensity {
            layers[INTENSITY] = self.intensity.finish();
        }
        if self.times.has_any {
            layers[TIME] = self.times.encoder.finish();
        }
        layers
    }
}

/// Steps of time, in the last places of the numbers.
struct Times {
    has_any: bool,
    encoder: Encoder,
    multiples: Model,
    first: Model,
    steps: Integers<32>,
    usual: i32,
    n_unusual: u32,
}

impl Times {
    fn new(room: usize) -> Self {
        Self {
            has_any: false,
            encoder: Encoder::new(4 * room),
            multiples: Model::new(N_TIMES),
            first: Model::new(5),
            steps: Integers::new(9),
            usual: 0,
            n_unusual: 0,
        }
    }

    #[inline]
    fn put(&mut self, step: i32) {
        self.has_any = true;
        if self.usual == 0 {
            self.encoder.put(&mut self.first, 0);
            self.steps.put(&mut self.encoder, 0, step, 0);
            (self.usual, self.n_unusual) = (step, 0);
            return;
        }
        let times = nearest(step as f32 / self.usual as f32);
        let taken = times.clamp(MOST_TIMES_BACK, MOST_TIMES);
        let symbol = if taken < 0 { MOST_TIMES - taken } else { taken };
        self.encoder.put(&mut self.multiples, symbol as u32);
        let context = match taken {
            1 => 1,
            2..10 => 2,
            10..MOST_TIMES => 3,
            MOST_TIMES => 4,
            0 => 7,
            MOST_TIMES_BACK => 6,
            _ => 5,
        };
        let expected = taken.wrapping_mul(self.usual);
        self.steps.put(&mut self.encoder, expected, step, context);
        match context {
            1 => self.n_unusual = 0,
            4 | 6 | 7 => {
                self.n_unusual += 1;
                if self.n_unusual > PATIENCE {
                    (self.usual, self.n_unusual) = (step, 0);
                }
            }
            _ => {}
        }
    }
}

fn nearest(value: f32) -> i32 {
    (value + 0.5_f32.copysign(value)) as i32
}

/// About the median of the latest five values: in turn the largest and the smallest goes.
#[derive(Clone, Debug)]
struct Median {
    /// In order.
    values: [i32; 5],
    drops_largest: bool,
}

impl Default for Median {
    fn default() -> Self {
        Self {
            values: [0; 5],
            drops_largest: true,
        }
    }
}

impl Median {
    #[inline]
    fn value(&self) -> i32 {
        self.values[2]
    }

    #[inline]
    fn add(&mut self, value: i32) {
        let v = &mut self.values;
        if self.drops_largest {
            self.drops_largest = value < v[2];
            v[4] = value;
            for k in (0..4).rev() {
                (v[k], v[k + 1]) = (v[k].min(v[k + 1]), v[k].max(v[k + 1]));
            }
        } else {
            self.drops_largest = v[2] >= value;
            v[0] = value;
            for k in 0..4 {
                (v[k], v[k + 1]) = (v[k].min(v[k + 1]), v[k].max(v[k + 1]));
            }
        }
    }
}
