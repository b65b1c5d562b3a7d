// SPDX-License-Identifier: MIT OR Apache-2.0
//! The second look: where along its beam each point most probably is.

use std::ops::Range;

use rayon::prelude::*;
use wide::f32x8;

use crate::grid::NONE;
use crate::noise::Noise;
use crate::sample::{Sample, Shot, Sorted};
use crate::spots::LANES;
use crate::surfaces::{Layer, Patch, layers_of, noise_of};

/// Cells per parallel task.
const CHUNK: usize = 256;
/// Moves of more standard deviations are not made.
const FARTHEST: f32 = 3.0;

/// What is known of the points of a sample that were to be refined, in their order.
#[derive(Clone, Debug)]
pub struct Refined {
    /// Along the beam, away from the lidar, m; 0 where a point stays.
    pub moves: Vec<f32>,
    /// Standard deviation that is left along the beam, m.
    pub sigmas: Vec<f32>,
    /// Of the ranges.
    pub noise: Noise,
}

impl Sample {
    /// Where points most probably are whose ranges have this noise, or else the one that their smooth
    /// surfaces show; none where there are no such.
    pub fn refine(self, noise: Option<Noise>) -> Option<Refined> {
        let sorted = self.sorted();
        let noise = noise.or_else(|| noise_of(&sorted))?;
        let layers = layers_of(&sorted, &noise);
        let finest = sorted.levels.first()?;
        let tasks: Vec<Range<usize>> = (0..finest.n_cells())
            .step_by(CHUNK)
            .map(|first| first..(first + CHUNK).min(finest.n_cells()))
            .collect();
        let found: Vec<Vec<(u32, f32, f32)>> = tasks
            .into_par_iter()
            .map(|cells| of_cells(&sorted, &layers, &noise, cells))
            .collect();
        let n_own = sorted.n_own;
        drop((sorted, layers)); // before there is room for the results
        let (mut moves, mut sigmas) = (vec![0.0; n_own], vec![0.0; n_own]);
        for (place, shift, sigma) in found.into_iter().flatten() {
            moves[place as usize] = shift;
            sigmas[place as usize] = sigma;
        }
        Some(Refined {
            moves,
            sigmas,
            noise,
        })
    }
}

/// Places, moves and the deviations that are left of the points of some of the finest cells.
fn of_cells(
    sorted: &Sorted,
    layers: &[Layer],
    noise: &Noise,
    cells: Range<usize>,
) -> Vec<(u32, f32, f32)> {
    let mut found = Vec::new();
    let mut own = vec![NONE; layers.len()];
    let mut shots: Vec<&Shot> = Vec::new();
    for cell in cells {
        let points = sorted.levels[0].points(cell as u32);
        for (level, number) in sorted.levels.iter().zip(&mut own) {
            if *number == NONE || !level.points(*number).contains(&points.start) {
                *number = level.cell_of(points.start);
            }
        }
        shots.clear();
        shots.extend(sorted.shots[points].iter().filter(|s| s.place != NONE));
        for shots in shots.chunks(LANES) {
            let eight = Eight::of(shots, noise);
            let (shift, sigma) = eight.refined(sorted.unit(), layers, &own);
            let results = shift.to_array().into_iter().zip(sigma.to_array());
            found.extend(shots.iter().zip(results).map(|(s, (m, d))| (s.place, m, d)));
        }
    }
    found
}

/// Some points of a cell, side by side; where there are fewer the first one stands again.
struct Eight {
    shots: [Shot; LANES],
    beam: [f32x8; 3],
    sigma: f32x8,
}

impl Eight {
    fn of(shots: &[&Shot], noise: &Noise) -> Self {
        let shots = std::array::from_fn(|k| **shots.get(k).unwrap_or(&shots[0]));
        let beams = shots.map(|s: Shot| s.beam());
        Self {
            shots,
            beam: [0, 1, 2].map(|a| f32x8::new(beams.map(|b| b[a]))),
            sigma: f32x8::new(shots.map(|s| noise.of_step(s.step) as f32)),
        }
    }

    /// Moves and the standard deviations that are left: by the sheets of the smallest cells that know any.
    fn refined(&self, unit: f32, layers: &[Layer], own: &[u32]) -> (f32x8, f32x8) {
        let (mut shift, mut sigma) = (f32x8::ZERO, self.sigma);
        let mut open = f32x8::ZERO.simd_le(f32x8::ZERO);
        for (level, (layer, &own)) in layers.iter().zip(own).enumerate() {
            let Some(patch) = layer.patch(own) else {
                continue;
            };
            let said = self.of_layer(unit, layer, patch, level);
            let known = open & said.weight.simd_gt(f32x8::ZERO);
            let mean = said.shift / said.weight;
            let left = (said.squares / said.weight - mean * mean).fast_max(f32x8::ZERO);
            let moved = known & mean.abs().simd_le(FARTHEST * self.sigma);
            shift = moved.select(mean, shift);
            sigma = moved.select(left.sqrt(), sigma);
            open &= !known;
            if open.none() {
                break;
            }
        }
        (shift, sigma)
    }

    /// What the sheets of one size of cells say: those of the own cell, and of the nearest ones beside it.
    fn of_layer(&self, unit: f32, layer: &Layer, patch: &Patch, level: usize) -> Said {
        let mut said = Said::default();
        let everywhere = f32x8::splat(1.0);
        self.add(unit, layer, patch, everywhere, &mut said);
        for (axis, sides) in patch.beside.iter().enumerate() {
            let upper = self
                .shots
                .map(|s| f32::from(u8::from(s.is_upper(axis, level))));
            let upper = f32x8::new(upper);
            for (number, nearest) in sides.iter().zip([everywhere - upper, upper]) {
                if let Some(beside) = layer.patch(*number) {
                    self.add(unit, layer, beside, nearest, &mut said);
                }
            }
        }
        said
    }

    fn add(&self, unit: f32, layer: &Layer, patch: &Patch, asked: f32x8, said: &mut Said) {
        for piece in layer.pieces(patch) {
            let from = self.shots.map(|s| s.from(&piece.middle));
            let at = [0, 1, 2].map(|a| f32x8::new(from.map(|d| d[a])) * unit);
            let h = piece.says(&at, &self.beam, self.sigma);
            let weight = h.weight * asked;
            said.weight += weight;
            said.shift += weight * h.shift;
            said.squares += weight * (h.variance + h.shift * h.shift);
        }
    }
}

/// Sums of what sheets say: weights, these times moves, and times the squares of where points may be.
#[derive(Default)]
struct Said {
    weight: f32x8,
    shift: f32x8,
    squares: f32x8,
}
