// SPDX-License-Identifier: MIT OR Apache-2.0
//! The points from which surfaces are found.

use rayon::prelude::*;

use crate::grid::{Level, NONE, code_of};
use crate::noise::step_of;
use crate::radix::in_order;
use crate::sheet::N_PASSES;

/// How surfaces are found.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Edge of the smallest cells, m.
    pub edge: f64,
    /// Sizes of cells, each twice as large as the one before.
    pub n_levels: u32,
    /// Points around a cell's middle that make it large enough.
    pub enough: usize,
    /// Fewer effective points of a sheet, counted by passes, move nothing.
    pub fewest_passes: f64,
    /// No noise of a range is larger, m.
    pub most_noise: f64,
}

/// Units of places to an edge of the smallest cells, in bits.
const FINE: u32 = 12;
/// Units of the directions of beams.
const TURN: f32 = 32767.0;
/// What a sum with it ends in is the nearest whole number.
const WHOLE: f64 = 6_755_399_441_055_744.0;
/// A shot as words: its place, its beam, and the step of its range and its pass.
pub const N_WORDS: usize = 5;

/// A point of a sample in few bytes, as most of the time goes into fetching them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shot {
    /// Units of the map's axes. They wrap around, 50 km apart or more.
    pub at: [i32; 3],
    beam: [i16; 3],
    /// Of the range.
    pub step: u8,
    pub pass: u8,
    /// Among those that are refined; `NONE` where it only tells where others are.
    pub place: u32,
}

impl Shot {
    fn of(words: &[u32; N_WORDS], place: u32) -> Self {
        let [x, y, z, xy, rest] = *words;
        Self {
            at: [x as i32, y as i32, z as i32],
            beam: [xy as i16, (xy >> 16) as i16, rest as i16],
            step: (rest >> 16) as u8,
            pass: (rest >> 24) as u8,
            place,
        }
    }

    /// Direction from the lidar.
    #[inline]
    pub(crate) fn beam(&self) -> [f32; 3] {
        self.beam.map(|c| f32::from(c) * (1.0 / TURN))
    }

    /// From a place, units.
    #[inline]
    pub(crate) fn from(&self, place: &[i32; 3]) -> [f32; 3] {
        [0, 1, 2].map(|a| self.at[a].wrapping_sub(place[a]) as f32)
    }

    /// Whether it is in the upper half of its cell of a level along an axis.
    #[inline]
    pub(crate) fn is_upper(&self, axis: usize, level: usize) -> bool {
        self.at[axis] >> (FINE as usize - 1 + level) & 1 == 1
    }
}

/// Points (m, map frame) with the unit directions of their beams, the beams' lengths (m) and times (s), as
/// samples take them, for cells of which the smallest have this edge (m), and passes of this length (s).
pub fn words_of(
    points: &[[f64; 3]],
    beams: &[[f32; 3]],
    ranges: &[f32],
    times: &[f64],
    (edge, pass_length): (f64, f64),
) -> Vec<[u32; N_WORDS]> {
    let per_unit = f64::from(1 << FINE) / edge;
    let whole = |value: f64| (value + WHOLE).to_bits() as u32;
    let words = |i: usize| {
        let [x, y, z] = points[i].map(|c| whole(c * per_unit));
        let [bx, by, bz] = beams[i].map(|c| whole(f64::from(c * TURN)) & 0xFFFF);
        let pass = (times[i] / pass_length).floor() as i64 as u32 % N_PASSES as u32;
        let step = u32::from(step_of(ranges[i]));
        [x, y, z, bx | by << 16, bz | step << 16 | pass << 24]
    };
    (0..points.len()).map(words).collect()
}

/// Points of a part of a map, in any order.
#[derive(Clone, Debug)]
pub struct Sample {
    settings: Settings,
    shots: Vec<Shot>,
    n_own: u32,
}

/// Points by their cells.
#[derive(Clone, Debug)]
pub(crate) struct Sorted {
    pub settings: Settings,
    pub shots: Vec<Shot>,
    pub levels: Vec<Level>,
    pub n_own: usize,
}

impl Sample {
    /// A sample without points.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            shots: Vec::new(),
            n_own: 0,
        }
    }

    /// Adds points as `words_of` has them, and whether each is to be refined or only tells where others are.
    pub fn add(&mut self, points: &[[u32; N_WORDS]], own: &[bool]) {
        self.shots.reserve(points.len());
        for (words, &own) in points.iter().zip(own) {
            let place = if own { self.n_own } else { NONE };
            self.n_own += u32::from(own);
            self.shots.push(Shot::of(words, place));
        }
    }

    pub(crate) fn sorted(self) -> Sorted {
        let settings = self.settings;
        // Wherever a part begins, its cells of all sizes are those of the map; before the first one is another.
        let largest = FINE + settings.n_levels - 1;
        let low = self.shots.iter().fold([i32::MAX; 3], |low, s| {
            [0, 1, 2].map(|a| low[a].min(s.at[a]))
        });
        let first = low.map(|c| ((c >> largest) - 1) << largest);
        let code =
            |s: &Shot| code_of([0, 1, 2].map(|a| (s.at[a].wrapping_sub(first[a]) as u32) >> FINE));
        let (codes, order) = in_order(self.shots.par_iter().map(code).collect());
        let shots = order.par_iter().map(|&i| self.shots[i as usize]).collect();
        drop((self.shots, order));
        let levels = (0..settings.n_levels)
            .map(|l| Level::of(&codes, settings.edge, l))
            .collect();
        Sorted {
            settings,
            shots,
            levels,
            n_own: self.n_own as usize,
        }
    }
}

impl Sorted {
    /// Of a unit of places, m.
    pub(crate) fn unit(&self) -> f32 {
        (self.settings.edge / f64::from(1 << FINE)) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn words_keep_a_shot(
            at in prop::array::uniform3(-20_000.0..20_000.0_f64),
            beam in prop::array::uniform3(-1.0..1.0_f32),
            range in 0.1..200.0_f32,
            time in -10.0..1e5_f64,
        ) {
            let edge = 0.05;
            let words = words_of(&[at], &[beam], &[range], &[time], (edge, 0.25));
            let shot = Shot::of(&words[0], 7);
            for axis in 0..3 {
                let unit = edge / f64::from(1 << FINE);
                let off = at[axis] - f64::from(shot.at[axis]) * unit;
                prop_assert!(off.abs() <= 0.5001 * unit);
                prop_assert!((shot.beam()[axis] - beam[axis]).abs() <= 0.51 / TURN);
                let share = (f64::from(shot.at[axis]) * unit / edge).rem_euclid(1.0);
                prop_assert_eq!(shot.is_upper(axis, 0), share >= 0.5);
            }
            prop_assert_eq!(shot.step, step_of(range));
            let pass = (time / 0.25).floor().rem_euclid(N_PASSES as f64);
            prop_assert_eq!(f64::from(shot.pass), pass);
            prop_assert_eq!(shot.place, 7);
        }
    }
}
