// SPDX-License-Identifier: MIT OR Apache-2.0
//! The sheets in every cell of a sample.

use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::gather::{Bench, Surroundings, UNIT};
use crate::grid::{Level, NONE, beside};
use crate::noise::Noise;
use crate::piece::Piece;
use crate::sample::Sorted;
use crate::sheet::{Room, Sheet};
use crate::split::{Half, Pair, split};
use crate::spots::{Spot, dot, normal_of, partition, single};
use crate::steps::{CHUNK, Near, Steps};

/// Fewer points of one side are no sheet.
const FEWEST_SPOTS: usize = 8;
/// One of so many cells is looked at to learn the noise, and no more cells of a size than about so many.
const NOISE_EVERY: usize = 8;
const MOST_CELLS: usize = 8192;
/// The noise is read where beams meet a sheet at more than this cosine, m.
const NOISE_COSINE: f32 = 0.5;
/// Residuals beyond this many standard deviations of what noise alone would make show a second sheet.
const SUSPICIOUS: f64 = 1.5;

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
    let of_level = |(number, level): (usize, &Level)| {
        let cells = open_cells(level, &open);
        let wider = sorted.levels.get(number + 1);
        let asking = cells_with(level, &cells, sorted.settings.enough);
        let steps =
            wider.map(|wider| Steps::of(sorted, wider, &above(wider, level, &asking), noise));
        let found: Vec<Vec<Found>> = cells
            .par_chunks(CHUNK)
            .map_init(<[Bench; 2]>::default, |[bench, of_step], places| {
                let mut around = level.around(places[0]);
                let of_cell = |&place: &usize| {
                    let (number, around) = (level.in_rows(place), around.of(place));
                    let here = Surroundings::of(sorted, level, number, &around);
                    let point = level.points(number).start;
                    let near = steps.as_ref().and_then(|steps| steps.near(&here, point));
                    let pieces =
                        pieces_of(&here, near.as_ref(), noise, [&mut *bench, &mut *of_step]);
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
    sorted.levels.iter().enumerate().map(of_level).collect()
}

/// Places among the rows of the cells that no smaller ones cover.
fn open_cells(level: &Level, open: &[bool]) -> Vec<usize> {
    let is_open = |&place: &usize| level.points(level.in_rows(place)).any(|i| open[i]);
    (0..level.n_cells()).filter(is_open).collect()
}

/// Of cells by their places among the rows, the numbers of those with so many points in them and around.
fn cells_with(level: &Level, places: &[usize], enough: usize) -> Vec<u32> {
    let found: Vec<Vec<u32>> = places
        .par_chunks(CHUNK)
        .map(|places| {
            let mut around = level.around(places[0]);
            let mut has_enough = |&place: &usize| {
                let near = around.of(place);
                let numbers = near.iter().filter(|&&number| number != NONE);
                numbers.map(|&n| level.points(n).len()).sum::<usize>() >= enough
            };
            let chosen = places.iter().filter(|place| has_enough(place));
            chosen.map(|&place| level.in_rows(place)).collect()
        })
        .collect();
    found.into_iter().flatten().collect()
}

/// The places among the rows of the larger cells in which some smaller ones are.
fn above(larger: &Level, smaller: &Level, numbers: &[u32]) -> Vec<usize> {
    let mut is_asked = vec![false; larger.n_cells()];
    for &number in numbers {
        is_asked[larger.cell_of(smaller.points(number).start) as usize] = true;
    }
    (0..larger.n_cells())
        .filter(|&place| is_asked[larger.in_rows(place) as usize])
        .collect()
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
    let here = Surroundings::of(sorted, level, cell, &around);
    let (spots, room) = here.spots(None, bench)?;
    let normal = normal_of(spots)?;
    let row = single(&normal);
    let [steep, _] = partition(spots, |s| dot(&row, &s.beam) < -NOISE_COSINE);
    if steep.len() < sorted.settings.enough / 2 {
        return None;
    }
    let sheet = Sheet::fit(steep, here.radius(), &normal, room)?;
    let own = level.points(cell);
    let step = sorted.shots[own.start + own.len() / 2].step;
    (sheet.n_passes >= sorted.settings.fewest_passes).then_some((step, sheet.scale.sqrt() * UNIT))
}

fn pieces_of(
    here: &Surroundings,
    near: Option<&Near>,
    noise: &Noise,
    [bench, of_step]: [&mut Bench; 2],
) -> Vec<Piece> {
    let (settings, radius) = (&here.sorted.settings, here.radius());
    let Some((spots, room)) = here.spots(Some(noise), bench) else {
        return Vec::new();
    };
    let mut step = |spots: &mut [Spot], normal: &Vector3<f64>, one: &Sheet, room: &mut Room| {
        near?.planes(spots, normal, one, room, of_step)
    };
    let (n, Some(normal)) = (spots.len(), normal_of(spots)) else {
        return Vec::new();
    };
    // Those that beams meet from behind are of another side.
    let row = single(&normal);
    let sides = partition(spots, |s| dot(&row, &s.beam) <= 0.0);
    let mut pieces = Vec::new();
    for side in sides.into_iter().filter(|side| side.len() >= FEWEST_SPOTS) {
        let own = if side.len() == n {
            Some(normal)
        } else {
            normal_of(side)
        };
        let sheets = own.map_or(Vec::new(), |n| sheets_of(side, radius, &n, &mut step, room));
        for (sheet, half) in sheets {
            if sheet.n_passes >= settings.fewest_passes && sheet.n_points >= FEWEST_SPOTS as f64 {
                pieces.push(Piece::of(here.middle, &sheet, half.as_ref()));
            }
        }
    }
    pieces
}

/// Finds the planes of a step through spots with this normal that one sheet explains.
type Step<'a> = dyn FnMut(&mut [Spot], &Vector3<f64>, &Sheet, &mut Room) -> Option<Pair> + 'a;

/// One sheet, or two where that is more likely or where there is a step; `normal` is a guess.
fn sheets_of(
    spots: &mut [Spot],
    radius: f64,
    normal: &Vector3<f64>,
    step: &mut Step,
    room: &mut Room,
) -> Vec<(Sheet, Option<Half>)> {
    let one = Sheet::fit(spots, radius, normal, room);
    let mut pair = None;
    if one.as_ref().is_none_or(|one| one.excess() > SUSPICIOUS) {
        pair = split(spots, radius, normal, one.as_ref(), room);
    }
    if pair.is_none()
        && let Some(one) = &one
    {
        pair = step(spots, normal, one, room);
    }
    if let Some(pair) = pair {
        return pair.map(|(sheet, half)| (sheet, Some(half))).to_vec();
    }
    let one = one.map(|sheet| sheet.narrower(spots, room).unwrap_or(sheet));
    one.map(|sheet| (sheet, None)).into_iter().collect()
}
