// SPDX-License-Identifier: MIT OR Apache-2.0
//! The second look: where along its beam each point most probably is.

use rayon::prelude::*;

use crate::surfaces::{Layer, Surfaces};

/// Points per parallel task.
const CHUNK: usize = 2048;
/// Moves of more standard deviations are not made.
const FARTHEST: f32 = 3.0;

/// What is known of some points, in their order.
#[derive(Clone, Debug, Default)]
pub struct Refined {
    /// Along the beam, away from the lidar, m; 0 where a point stays.
    pub moves: Vec<f32>,
    /// Standard deviation that is left along the beam, m.
    pub sigmas: Vec<f32>,
}

impl Surfaces {
    /// Where points (m, map frame) are, measured by beams of these unit directions and lengths.
    pub fn refine(&self, points: &[[f64; 3]], beams: &[[f32; 3]], ranges: &[f32]) -> Refined {
        let rows: Vec<(f32, f32)> = points
            .par_iter()
            .zip_eq(beams)
            .zip_eq(ranges)
            .with_min_len(CHUNK)
            .map(|((p, beam), &range)| self.refine_one(p, beam, range))
            .collect();
        let (moves, sigmas) = rows.into_iter().unzip();
        Refined { moves, sigmas }
    }

    fn refine_one(&self, point: &[f64; 3], beam: &[f32; 3], range: f32) -> (f32, f32) {
        let at = [0, 1, 2].map(|a| (point[a] - self.origin[a]) as f32);
        let sigma = self.noise.sigma(range) as f32;
        let mut layers = self.layers.iter();
        match layers.find_map(|layer| of_layer(layer, &at, beam, sigma)) {
            Some((shift, variance)) if shift.abs() <= FARTHEST * sigma => (shift, variance.sqrt()),
            _ => (0.0, sigma),
        }
    }
}

/// Move and the variance that is left, by the sheets of one size of cells.
fn of_layer(layer: &Layer, at: &[f32; 3], beam: &[f32; 3], sigma: f32) -> Option<(f32, f32)> {
    let p = at.map(f64::from);
    let own = layer.level.number(layer.level.cell_of(&p))?;
    if layer.of_cell(own).is_empty() {
        return None;
    }
    let cells = layer.level.beside(&p).into_iter().flatten();
    let pieces = layer
        .of_cell(own)
        .iter()
        .chain(cells.flat_map(|number| layer.of_cell(number)));
    let (mut sum, mut shift, mut squares) = (0.0, 0.0, 0.0);
    for h in pieces.filter_map(|piece| piece.says(at, beam, sigma)) {
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
