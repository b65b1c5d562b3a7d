// SPDX-License-Identifier: MIT OR Apache-2.0
//! The sheets in every cell of a sample.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::grid::Level;
use crate::noise::Noise;
use crate::piece::Piece;
use crate::sample::{Sample, Sorted};
use crate::sheet::{N_PASSES, Sheet, Spot, normal_of};
use crate::split::{Half, split};

/// Points around a middle are used up to so many edges away, with less and less weight.
const REACH: f64 = 1.5;
/// More points of a cell's surroundings are thinned.
const MOST_SPOTS: usize = 200;
/// Fewer points of one side are no sheet.
const FEWEST_SPOTS: usize = 8;
/// One of so many cells is looked at to learn the noise.
const NOISE_EVERY: usize = 8;
/// The noise is read where beams meet a sheet at more than this cosine, m.
const NOISE_COSINE: f64 = 0.5;
/// Cells per parallel task; fixed, so that results do not depend on the number of threads.
const CHUNK: usize = 64;
/// Residuals beyond this many standard deviations of what noise alone would make show a second sheet.
const SUSPICIOUS: f64 = 1.5;

/// The sheets of the cells of one size, by the numbers of the cells.
#[derive(Clone, Debug)]
pub(crate) struct Layer {
    pub level: Level,
    starts: Vec<u32>,
    pieces: Vec<Piece>,
}

impl Layer {
    #[inline]
    pub(crate) fn of_cell(&self, number: u32) -> &[Piece] {
        let at = number as usize;
        &self.pieces[self.starts[at] as usize..self.starts[at + 1] as usize]
    }
}

/// Surfaces of a part of a map.
#[derive(Clone, Debug)]
pub struct Surfaces {
    pub(crate) origin: [f64; 3],
    pub(crate) layers: Vec<Layer>,
    pub(crate) noise: Noise,
}

impl Surfaces {
    /// The noise of the ranges.
    pub fn noise(&self) -> &Noise {
        &self.noise
    }
}

impl Sample {
    /// Finds the surfaces of points whose ranges have this noise, or else the one that their smooth
    /// surfaces show; none where there are no such.
    pub fn fit(self, noise: Option<Noise>) -> Option<Surfaces> {
        let sorted = self.sorted();
        let noise = noise.or_else(|| noise_of(&sorted))?;
        let mut covered = vec![false; sorted.shots.len()];
        let mut layers = Vec::new();
        for level in &sorted.levels {
            let cells: Vec<u32> = (0..level.n_cells() as u32)
                .filter(|&c| level.points(c).any(|i| !covered[i]))
                .collect();
            let found: Vec<Vec<Piece>> = cells
                .par_iter()
                .with_min_len(CHUNK)
                .map_init(Vec::new, |spots, &c| {
                    pieces_of(&sorted, level, c, &noise, spots)
                })
                .collect();
            let mut layer = Layer {
                level: Level::default(),
                starts: vec![0; level.n_cells() + 1],
                pieces: Vec::new(),
            };
            let mut own = cells.iter().zip(found).peekable();
            for number in 0..level.n_cells() as u32 {
                if own.peek().is_some_and(|(c, _)| **c == number)
                    && let Some((_, pieces)) = own.next()
                {
                    if !pieces.is_empty() {
                        covered[level.points(number)].fill(true);
                    }
                    layer.pieces.extend(pieces);
                }
                layer.starts[number as usize + 1] = layer.pieces.len() as u32;
            }
            layers.push(layer);
        }
        for (layer, level) in layers.iter_mut().zip(sorted.levels) {
            layer.level = level;
        }
        Some(Surfaces {
            origin: sorted.origin,
            layers,
            noise,
        })
    }
}

fn noise_of(sorted: &Sorted) -> Option<Noise> {
    let mut found = Vec::new();
    for level in &sorted.levels {
        let cells: Vec<u32> = (0..level.n_cells() as u32).step_by(NOISE_EVERY).collect();
        let of_level: Vec<Option<(u8, f64)>> = cells
            .par_iter()
            .with_min_len(CHUNK)
            .map_init(Vec::new, |spots, &c| residual(sorted, level, c, spots))
            .collect();
        found.extend(of_level.into_iter().flatten());
    }
    Noise::of(&found, sorted.settings.most_noise)
}

/// Step of the range of a cell's points and the standard deviation of their residuals along the beams.
fn residual(sorted: &Sorted, level: &Level, cell: u32, spots: &mut Vec<Spot>) -> Option<(u8, f64)> {
    let (_, radius) = gather(sorted, level, cell, None, spots)?;
    let normal = normal_of(spots)?;
    spots.retain(|s| s.beam.dot(&normal) < -NOISE_COSINE);
    if spots.len() < sorted.settings.enough / 2 {
        return None;
    }
    let sheet = Sheet::fit(spots, radius, &normal)?;
    let own = level.points(cell);
    let step = sorted.shots[own.start + own.len() / 2].step;
    (sheet.n_passes >= sorted.settings.fewest_passes).then_some((step, sheet.scale.sqrt() * UNIT))
}

/// Of a range where the noise is not known, m.
const UNIT: f64 = 0.002;

/// The points around the middle of a cell's points; the middle, and the radius within which they are.
fn gather(
    sorted: &Sorted,
    level: &Level,
    cell: u32,
    noise: Option<&Noise>,
    spots: &mut Vec<Spot>,
) -> Option<(Vector3<f64>, f64)> {
    let own = level.points(cell);
    let place = |i: usize| Vector3::from(sorted.shots[i].at.map(f64::from));
    let middle = own.clone().fold(Vector3::zeros(), |sum, i| sum + place(i)) / own.len() as f64;
    let radius = REACH * level.edge;
    let around: Vec<u32> = level
        .around(level.cell_of(&place(own.start).into()))
        .collect();
    let total: usize = around.iter().map(|&c| level.points(c).len()).sum();
    if total < sorted.settings.enough {
        return None;
    }
    spots.clear();
    let every = total.div_ceil(MOST_SPOTS);
    let mut skipped = 0;
    for cell in around {
        let points = level.points(cell);
        for i in (points.start + skipped..points.end).step_by(every) {
            let (shot, at) = (&sorted.shots[i], place(i) - middle);
            if at.norm_squared() < radius * radius {
                spots.push(Spot {
                    at,
                    beam: Vector3::from(shot.beam.map(f64::from)),
                    sigma: noise.map_or(UNIT, |n| n.of_step(shot.step)),
                    pass: (usize::from(shot.pass) % N_PASSES) as u8,
                });
            }
        }
        // As if the points of all cells were one behind the other.
        skipped = (skipped + every - points.len() % every) % every;
    }
    (spots.len() * every.min(2) >= sorted.settings.enough / 2).then_some((middle, radius))
}

fn pieces_of(
    sorted: &Sorted,
    level: &Level,
    cell: u32,
    noise: &Noise,
    spots: &mut Vec<Spot>,
) -> Vec<Piece> {
    let Some((middle, radius)) = gather(sorted, level, cell, Some(noise), spots) else {
        return Vec::new();
    };
    let Some(normal) = normal_of(spots) else {
        return Vec::new();
    };
    // Those that beams meet from behind are of another side.
    spots.sort_by_key(|s| s.beam.dot(&normal) > 0.0);
    let n_front = spots.partition_point(|s| s.beam.dot(&normal) <= 0.0);
    let (front, back) = spots.split_at(n_front);
    let mut pieces = Vec::new();
    for side in [front, back] {
        if side.len() < FEWEST_SPOTS {
            continue;
        }
        for (sheet, half) in sheets_of(side, radius) {
            if sheet.n_passes >= sorted.settings.fewest_passes
                && sheet.n_points >= FEWEST_SPOTS as f64
            {
                pieces.push(Piece::of(&middle, &sheet, half.as_ref()));
            }
        }
    }
    pieces
}

/// One sheet, or two where that is more likely.
fn sheets_of(spots: &[Spot], radius: f64) -> Vec<(Sheet, Option<Half>)> {
    let Some(normal) = normal_of(spots) else {
        return Vec::new();
    };
    let one = Sheet::fit(spots, radius, &normal);
    if one.as_ref().is_none_or(is_suspicious)
        && let Some(pair) = split(spots, radius, &normal, one.as_ref())
    {
        return pair.map(|(sheet, half)| (sheet, Some(half))).to_vec();
    }
    one.map(|sheet| (sheet, None)).into_iter().collect()
}

fn is_suspicious(sheet: &Sheet) -> bool {
    sheet.mean_cost() > 1.0 + SUSPICIOUS * (2.0 / sheet.n_points.max(1.0)).sqrt()
}
