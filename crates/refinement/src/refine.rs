// SPDX-License-Identifier: MIT OR Apache-2.0
//! The second look: where along its beam each point most probably is.

use std::ops::Range;

use rayon::prelude::*;

use crate::grid::NONE;
use crate::noise::Noise;
use crate::sample::{Sample, Shot, Sorted};
use crate::surfaces::{Layer, layers_of, noise_of};

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
        let (mut moves, mut sigmas) = (vec![0.0; sorted.n_own], vec![0.0; sorted.n_own]);
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
    for cell in cells {
        let points = sorted.levels[0].points(cell as u32);
        for (level, number) in sorted.levels.iter().zip(&mut own) {
            if *number == NONE || !level.points(*number).contains(&points.start) {
                *number = level.cell_of(points.start);
            }
        }
        for shot in sorted.shots[points].iter().filter(|s| s.place != NONE) {
            let sigma = noise.of_step(shot.step) as f32;
            let mut of_layers = (0..layers.len()).filter_map(|k| {
                let edge = sorted.levels[k].edge as f32;
                of_layer(&layers[k], own[k], shot, edge, sigma)
            });
            found.push(match of_layers.next() {
                Some((shift, variance)) if shift.abs() <= FARTHEST * sigma => {
                    (shot.place, shift, variance.sqrt())
                }
                _ => (shot.place, 0.0, sigma),
            });
        }
    }
    found
}

/// Move and the variance that is left, by the sheets of one size of cells.
fn of_layer(layer: &Layer, own: u32, shot: &Shot, edge: f32, sigma: f32) -> Option<(f32, f32)> {
    let patch = layer.patch(own)?;
    let nearest = [0, 1, 2].map(|axis| {
        let scaled = shot.at[axis] / edge;
        patch.beside[axis][usize::from(scaled - scaled.floor() > 0.5)]
    });
    let others = nearest.into_iter().filter_map(|number| layer.patch(number));
    let pieces = std::iter::once(patch)
        .chain(others)
        .flat_map(|p| layer.pieces(p));
    let (mut sum, mut shift, mut squares) = (0.0, 0.0, 0.0);
    for h in pieces.filter_map(|piece| piece.says(&shot.at, &shot.beam, sigma)) {
        sum += h.weight;
        shift += h.weight * h.shift;
        squares += h.weight * (h.variance + h.shift * h.shift);
    }
    if sum <= 0.0 {
        return None;
    }
    let mean = shift / sum;
    Some((mean, (squares / sum - mean * mean).max(0.0)))
}
