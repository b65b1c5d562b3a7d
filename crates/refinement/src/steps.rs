// SPDX-License-Identifier: MIT OR Apache-2.0
//! Steps that cells have too few points to tell from a slope, while the larger surroundings show them.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::gather::{Bench, Surroundings};
use crate::grid::{Level, NONE};
use crate::noise::Noise;
use crate::sample::Sorted;
use crate::sheet::{Room, Sheet};
use crate::split::{Half, Pair, best_line, gain, line_between};
use crate::spots::{Spot, dot, normal_of, partition, single};
use crate::step::{certain_step, planes_beside};

/// Cells per parallel task; fixed, so that results do not depend on the number of threads.
pub(crate) const CHUNK: usize = 64;
/// Residuals that are larger by fewer standard deviations show no step.
const DOUBTFUL: f64 = 1.0;
/// A step is looked for where it is less likely than one sheet by no more than so many parameters, in a cell
/// as in one of half the size: by the points of both it shows better.
const UNLIKELY: f64 = -3.0;
/// Where the line of a likely step passes a cell of half the size within so many of its radii.
const NEAR: f64 = 1.5;

/// The likely steps in cells.
pub(crate) struct Steps<'a> {
    level: &'a Level,
    noise: &'a Noise,
    /// By the number of the cell, which of the steps is its own.
    slots: Vec<u32>,
    likely: Vec<Likely>,
}

/// A step that a cell may have.
struct Likely {
    /// Of the cell, among the rows.
    place: usize,
    /// From where its line is told, units of the map.
    middle: [i32; 3],
    line: Half,
}

impl<'a> Steps<'a> {
    /// Those of some cells, by their places among the rows.
    pub(crate) fn of(sorted: &Sorted, level: &'a Level, cells: &[usize], noise: &'a Noise) -> Self {
        let found: Vec<Vec<Likely>> = cells
            .par_chunks(CHUNK)
            .map_init(Bench::default, |bench, places| {
                let mut around = level.around(places[0]);
                let likely_step = |&place: &usize| {
                    let around = around.of(place);
                    let here = Surroundings::of(sorted, level, level.in_rows(place), &around);
                    let line = likely_line(&here, noise, bench)?;
                    let middle = here.middle;
                    Some(Likely {
                        place,
                        middle,
                        line,
                    })
                };
                places.iter().filter_map(likely_step).collect()
            })
            .collect();
        let likely: Vec<Likely> = found.into_iter().flatten().collect();
        let mut slots = vec![NONE; level.n_cells()];
        for (slot, step) in likely.iter().enumerate() {
            slots[level.in_rows(step.place) as usize] = slot as u32;
        }
        Self {
            level,
            noise,
            slots,
            likely,
        }
    }

    /// The likely step near the middle of a smaller cell, to which this point belongs.
    pub(crate) fn near<'b>(
        &'b self,
        smaller: &'b Surroundings<'b>,
        point: usize,
    ) -> Option<Near<'b>> {
        let slot = self.slots[self.level.cell_of(point) as usize];
        let step = self.likely.get(slot as usize)?;
        let unit = smaller.sorted.unit();
        let line = step.line.seen_from(&step.middle, &smaller.middle, unit);
        (line.offset.abs() < NEAR * smaller.radius()).then_some(Near {
            steps: self,
            place: step.place,
            line,
            smaller,
        })
    }
}

/// A likely step near the middle of a smaller cell.
pub(crate) struct Near<'a> {
    steps: &'a Steps<'a>,
    place: usize,
    /// As seen from the middle of the smaller cell.
    line: Half,
    smaller: &'a Surroundings<'a>,
}

impl Near<'_> {
    /// The planes of the step through the spots of the smaller cell on the side of this normal, where the
    /// larger surroundings are certain of it, and one sheet is not much likelier.
    pub(crate) fn planes(
        &self,
        spots: &mut [Spot],
        normal: &Vector3<f64>,
        one: &Sheet,
        room: &mut Room,
        bench: &mut Bench,
    ) -> Option<Pair> {
        let radius = self.smaller.radius();
        let about = planes_beside(self.line, spots, radius, normal, room)?;
        if gain(&about, one) < UNLIKELY {
            return None;
        }
        let line = self.certain(normal, bench)?;
        planes_beside(line, spots, radius, normal, room)
    }

    /// The line of the step by the points within the reach of the larger cell, from the middle of the smaller.
    fn certain(&self, normal: &Vector3<f64>, bench: &mut Bench) -> Option<Half> {
        let Steps { level, noise, .. } = self.steps;
        let around = level.around(self.place).of(self.place);
        let here = Surroundings {
            level,
            around: &around,
            ..*self.smaller
        };
        let (spots, room) = here.more_spots(Some(noise), bench)?;
        let row = single(normal);
        let [side, _] = partition(spots, |s| dot(&row, &s.beam) <= 0.0);
        let line = certain_step(self.line, side, here.radius(), normal, room)?;
        (line.offset.abs() < self.smaller.radius()).then_some(line)
    }
}

fn likely_line(here: &Surroundings, noise: &Noise, bench: &mut Bench) -> Option<Half> {
    let (spots, room) = here.spots(Some(noise), bench)?;
    let (normal, radius) = (normal_of(spots)?, here.radius());
    let line = best_line(spots, radius, &normal)?;
    let one = Sheet::fit(spots, radius, &normal, room)?;
    if !one.is_bent() && one.excess() < DOUBTFUL {
        return None;
    }
    let pair = planes_beside(line, spots, radius, &normal, room)?;
    if gain(&pair, &one) < UNLIKELY {
        return None;
    }
    Some(line_between(spots, radius, &pair, &normal, room).unwrap_or(line))
}
