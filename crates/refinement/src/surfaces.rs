// SPDX-License-Identifier: MIT OR Apache-2.0
//! The sheets in every cell of a sample.

use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::grid::{Level, N_AROUND, NONE, beside};
use crate::noise::Noise;
use crate::piece::Piece;
use crate::sample::{Shot, Sorted};
use crate::sheet::{Room, Sheet};
use crate::split::{Half, split};
use crate::spots::{NO_SPOT, Spot, dot, normal_of, partition, single};

/// Points around a middle are used up to so many edges away, with less and less weight.
const REACH: f64 = 1.5;
/// More points of a cell's surroundings are thinned.
const MOST_SPOTS: usize = 200;
/// Fewer points of one side are no sheet.
const FEWEST_SPOTS: usize = 8;
/// One of so many cells is looked at to learn the noise, and no more cells of a size than about so many.
const NOISE_EVERY: usize = 8;
const MOST_CELLS: usize = 8192;
/// The noise is read where beams meet a sheet at more than this cosine, m.
const NOISE_COSINE: f32 = 0.5;
/// Cells per parallel task; fixed, so that results do not depend on the number of threads.
const CHUNK: usize = 64;
/// Residuals beyond this many standard deviations of what noise alone would make show a second sheet.
const SUSPICIOUS: f64 = 1.5;

/// Where a task puts the spots of one cell after the other.
struct Bench {
    spots: [Spot; MOST_SPOTS],
    room: Room,
}

impl Default for Bench {
    fn default() -> Self {
        Self {
            spots: [NO_SPOT; MOST_SPOTS],
            room: Room::default(),
        }
    }
}

/// The sheets of the cells of one size.
#[derive(Clone, Debug)]
pub(crate) struct Layer {
    /// By the number of the cell, which of the patches is its own.
    slots: Vec<u32>,
    patches: Vec<Patch>,
    pieces: Vec<Piece>,
}

/// What a cell has.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    pieces: Range<u32>,
    /// Along each axis the cells at the lower and the upper side.
    pub beside: [[u32; 2]; 3],
}

/// What was found in a cell, and what is around.
struct Found {
    number: u32,
    pieces: Vec<Piece>,
    beside: [[u32; 2]; 3],
}

impl Layer {
    fn of(level: &Level, found: impl Iterator<Item = Found>) -> Self {
        let mut layer = Self {
            slots: vec![NONE; level.n_cells()],
            patches: Vec::new(),
            pieces: Vec::new(),
        };
        for cell in found {
            let first = layer.pieces.len() as u32;
            layer.slots[cell.number as usize] = layer.patches.len() as u32;
            layer.pieces.extend(cell.pieces);
            layer.patches.push(Patch {
                pieces: first..layer.pieces.len() as u32,
                beside: cell.beside,
            });
        }
        layer
    }

    /// What a cell has, if it has a sheet.
    #[inline]
    pub(crate) fn patch(&self, number: u32) -> Option<&Patch> {
        let slot = *self.slots.get(number as usize)?;
        self.patches.get(slot as usize)
    }

    #[inline]
    pub(crate) fn pieces(&self, patch: &Patch) -> &[Piece] {
        &self.pieces[patch.pieces.start as usize..patch.pieces.end as usize]
    }
}

/// The sheets of all sizes of cells; those that smaller ones cover have none.
pub(crate) fn layers_of(sorted: &Sorted, noise: &Noise) -> Vec<Layer> {
    let mut open = wanted(sorted);
    let of_level = |level: &Level| {
        let cells: Vec<usize> = (0..level.n_cells())
            .filter(|&place| level.points(level.in_rows(place)).any(|i| open[i]))
            .collect();
        let found: Vec<Vec<Found>> = cells
            .par_chunks(CHUNK)
            .map_init(Bench::default, |bench, places| {
                let mut around = level.around(places[0]);
                let of_cell = |&place: &usize| {
                    let (number, around) = (level.in_rows(place), around.of(place));
                    let pieces = pieces_of(sorted, level, number, &around, noise, bench);
                    let beside = beside(&around);
                    (!pieces.is_empty()).then_some(Found {
                        number,
                        pieces,
                        beside,
                    })
                };
                places.iter().filter_map(of_cell).collect()
            })
            .collect();
        for cell in found.iter().flatten() {
            open[level.points(cell.number)].fill(false);
        }
        Layer::of(level, found.into_iter().flatten())
    };
    sorted.levels.iter().map(of_level).collect()
}

/// Whether each point is in or beside one of the largest cells that have a point to be refined: no other
/// sheet says anything of such a point.
fn wanted(sorted: &Sorted) -> Vec<bool> {
    let mut wanted = vec![sorted.shots.len() == sorted.n_own; sorted.shots.len()];
    let Some(level) = sorted.levels.last().filter(|_| !wanted.contains(&true)) else {
        return wanted;
    };
    let n = level.n_cells() as u32;
    let has_own = |number| {
        sorted.shots[level.points(number)]
            .iter()
            .any(|s| s.place != NONE)
    };
    let own: Vec<bool> = (0..n).map(has_own).collect();
    let mut around = level.around(0);
    for place in 0..level.n_cells() {
        let near = around.of(place);
        if near.iter().any(|&c| c != NONE && own[c as usize]) {
            wanted[level.points(level.in_rows(place))].fill(true);
        }
    }
    wanted
}

/// The noise of the ranges as the smooth surfaces show it.
pub(crate) fn noise_of(sorted: &Sorted) -> Option<Noise> {
    let mut found = Vec::new();
    for level in &sorted.levels {
        let every = (level.n_cells() / MOST_CELLS).max(NOISE_EVERY);
        let places: Vec<usize> = (0..level.n_cells()).step_by(every).collect();
        let of_level: Vec<Option<(u8, f64)>> = places
            .par_iter()
            .with_min_len(CHUNK)
            .map_init(Bench::default, |bench, &place| {
                residual(sorted, level, place, bench)
            })
            .collect();
        found.extend(of_level.into_iter().flatten());
    }
    Noise::of(&found, sorted.settings.most_noise)
}

/// Step of the range of a cell's points and the standard deviation of their residuals along the beams.
fn residual(sorted: &Sorted, level: &Level, place: usize, bench: &mut Bench) -> Option<(u8, f64)> {
    let cell = level.in_rows(place);
    let around = level.around(place).of(place);
    let (_, radius, n) = gather(sorted, level, cell, &around, None, &mut bench.spots)?;
    let spots = &mut bench.spots[..n];
    let normal = normal_of(spots)?;
    let row = single(&normal);
    let [steep, _] = partition(spots, |s| dot(&row, &s.beam) < -NOISE_COSINE);
    if steep.len() < sorted.settings.enough / 2 {
        return None;
    }
    let sheet = Sheet::fit(steep, radius, &normal, &mut bench.room)?;
    let own = level.points(cell);
    let step = sorted.shots[own.start + own.len() / 2].step;
    (sheet.n_passes >= sorted.settings.fewest_passes).then_some((step, sheet.scale.sqrt() * UNIT))
}

/// Of a range where the noise is not known, m.
const UNIT: f64 = 0.002;

/// The points around the middle of a cell's points; the middle (units of the map), and the radius (m) within
/// which they are, and their number.
fn gather(
    sorted: &Sorted,
    level: &Level,
    cell: u32,
    around: &[u32; N_AROUND],
    noise: Option<&Noise>,
    spots: &mut [Spot; MOST_SPOTS],
) -> Option<([i32; 3], f64, usize)> {
    let around = around.iter().filter(|&&c| c != NONE);
    let total: usize = around.clone().map(|&c| level.points(c).len()).sum();
    if total < sorted.settings.enough {
        return None;
    }
    let middle = middle_of(&sorted.shots[level.points(cell)]);
    let (unit, radius) = (sorted.unit(), REACH * level.edge);
    let most = (radius * radius) as f32;
    let mut n = 0;
    let every = total.div_ceil(MOST_SPOTS);
    let mut skipped = 0;
    for &cell in around {
        let points = level.points(cell);
        for shot in sorted.shots[points.clone()]
            .iter()
            .skip(skipped)
            .step_by(every)
        {
            let at = shot.from(&middle).map(|c| c * unit);
            spots[n] = Spot {
                at,
                beam: shot.beam(),
                sigma: noise.map_or(UNIT, |n| n.of_step(shot.step)) as f32,
                pass: shot.pass,
            };
            // Whether it is near is as good as random: a branch would be guessed wrong.
            n += usize::from(dot(&at, &at) < most);
        }
        // As if the points of all cells were one behind the other.
        skipped = (skipped + every - points.len() % every) % every;
    }
    (n * every.min(2) >= sorted.settings.enough / 2).then_some((middle, radius, n))
}

/// Of some shots, at least one.
fn middle_of(shots: &[Shot]) -> [i32; 3] {
    let first = shots[0].at;
    let sum = shots.iter().fold([0_i64; 3], |sum, shot| {
        [0, 1, 2].map(|a| sum[a] + i64::from(shot.at[a].wrapping_sub(first[a])))
    });
    [0, 1, 2].map(|a| first[a].wrapping_add((sum[a] / shots.len() as i64) as i32))
}

fn pieces_of(
    sorted: &Sorted,
    level: &Level,
    cell: u32,
    around: &[u32; N_AROUND],
    noise: &Noise,
    bench: &mut Bench,
) -> Vec<Piece> {
    let Bench { spots, room } = bench;
    let Some((middle, radius, n)) = gather(sorted, level, cell, around, Some(noise), spots) else {
        return Vec::new();
    };
    let Some(normal) = normal_of(&spots[..n]) else {
        return Vec::new();
    };
    // Those that beams meet from behind are of another side.
    let row = single(&normal);
    let sides = partition(&mut spots[..n], |s| dot(&row, &s.beam) <= 0.0);
    let mut pieces = Vec::new();
    for side in sides.into_iter().filter(|side| side.len() >= FEWEST_SPOTS) {
        let own = if side.len() == n {
            Some(normal)
        } else {
            normal_of(side)
        };
        for (sheet, half) in own.map_or(Vec::new(), |normal| sheets_of(side, radius, &normal, room))
        {
            if sheet.n_passes >= sorted.settings.fewest_passes
                && sheet.n_points >= FEWEST_SPOTS as f64
            {
                pieces.push(Piece::of(middle, &sheet, half.as_ref()));
            }
        }
    }
    pieces
}

/// One sheet, or two where that is more likely; `normal` is a guess.
fn sheets_of(
    spots: &mut [Spot],
    radius: f64,
    normal: &Vector3<f64>,
    room: &mut Room,
) -> Vec<(Sheet, Option<Half>)> {
    let one = Sheet::fit(spots, radius, normal, room);
    if one.as_ref().is_none_or(is_suspicious)
        && let Some(pair) = split(spots, radius, normal, one.as_ref(), room)
    {
        return pair.map(|(sheet, half)| (sheet, Some(half))).to_vec();
    }
    let one = one.map(|sheet| sheet.narrower(spots, room).unwrap_or(sheet));
    one.map(|sheet| (sheet, None)).into_iter().collect()
}

fn is_suspicious(sheet: &Sheet) -> bool {
    sheet.mean_cost() > 1.0 + SUSPICIOUS * (2.0 / sheet.n_points.max(1.0)).sqrt()
}
