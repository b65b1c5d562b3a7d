// SPDX-License-Identifier: MIT OR Apache-2.0
//! The points around a place, as sheets are fitted to them.

use crate::grid::{Level, N_AROUND, NONE};
use crate::noise::Noise;
use crate::sample::{Shot, Sorted};
use crate::sheet::Room;
use crate::spots::{NO_SPOT, Spot, dot};

/// Points around a middle are used up to so many edges away, with less and less weight.
const REACH: f64 = 1.5;
/// More points of a cell's surroundings are thinned.
const MOST_SPOTS: usize = 200;
/// More of them are thinned where a step is looked for.
const MOST_OF_STEP: usize = 400;
/// Of a range where the noise is not known, m.
pub(crate) const UNIT: f64 = 0.002;

/// Where a task puts the spots of one cell after the other.
pub(crate) struct Bench {
    spots: [Spot; MOST_OF_STEP],
    pub room: Room,
}

impl Default for Bench {
    fn default() -> Self {
        Self {
            spots: [NO_SPOT; MOST_OF_STEP],
            room: Room::default(),
        }
    }
}

/// A place and what is around it.
pub(crate) struct Surroundings<'a> {
    pub sorted: &'a Sorted,
    pub level: &'a Level,
    /// The cells that have points.
    pub around: &'a [u32; N_AROUND],
    /// Units of the map.
    pub middle: [i32; 3],
}

impl<'a> Surroundings<'a> {
    /// Those of the middle of a cell's points.
    pub(crate) fn of(
        sorted: &'a Sorted,
        level: &'a Level,
        cell: u32,
        around: &'a [u32; N_AROUND],
    ) -> Self {
        let middle = middle_of(&sorted.shots[level.points(cell)]);
        Self {
            sorted,
            level,
            around,
            middle,
        }
    }

    /// Within which points are used, m.
    pub(crate) fn radius(&self) -> f64 {
        REACH * self.level.edge
    }

    /// The points within the radius, and the room for what is computed of them; none where they are too few.
    pub(crate) fn spots<'b>(
        &self,
        noise: Option<&Noise>,
        bench: &'b mut Bench,
    ) -> Option<(&'b mut [Spot], &'b mut Room)> {
        self.gather(noise, MOST_SPOTS, bench)
    }

    /// More of the same, for a step.
    pub(crate) fn more_spots<'b>(
        &self,
        noise: Option<&Noise>,
        bench: &'b mut Bench,
    ) -> Option<(&'b mut [Spot], &'b mut Room)> {
        self.gather(noise, MOST_OF_STEP, bench)
    }

    fn gather<'b>(
        &self,
        noise: Option<&Noise>,
        most: usize,
        bench: &'b mut Bench,
    ) -> Option<(&'b mut [Spot], &'b mut Room)> {
        let Self { sorted, level, .. } = self;
        let around = self.around.iter().filter(|&&c| c != NONE);
        let total: usize = around.clone().map(|&c| level.points(c).len()).sum();
        if total < sorted.settings.enough {
            return None;
        }
        let Bench { spots, room } = bench;
        let unit = sorted.unit();
        let reach = (self.radius() * self.radius()) as f32;
        let mut n = 0;
        let every = total.div_ceil(most);
        let mut skipped = 0;
        for &cell in around {
            let points = level.points(cell);
            for shot in sorted.shots[points.clone()]
                .iter()
                .skip(skipped)
                .step_by(every)
            {
                let at = shot.from(&self.middle).map(|c| c * unit);
                spots[n] = Spot {
                    at,
                    beam: shot.beam(),
                    sigma: noise.map_or(UNIT, |n| n.of_step(shot.step)) as f32,
                    pass: shot.pass,
                };
                // Whether it is near is as good as random: a branch would be guessed wrong.
                n += usize::from(dot(&at, &at) < reach);
            }
            // As if the points of all cells were one behind the other.
            skipped = (skipped + every - points.len() % every) % every;
        }
        let enough = n * every.min(2) >= sorted.settings.enough / 2;
        enough.then_some((&mut spots[..n], room))
    }
}

/// Of some shots, at least one.
fn middle_of(shots: &[Shot]) -> [i32; 3] {
    let first = shots[0].at;
    let sum = shots.iter().fold([0_i64; 3], |sum, shot| {
        [0, 1, 2].map(|a| sum[a] + i64::from(shot.at[a].wrapping_sub(first[a])))
    });
    [0, 1, 2].map(|a| first[a].wrapping_add((sum[a] / shots.len() as i64) as i32))
}
