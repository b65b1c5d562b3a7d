// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is kept of a sheet: as few bytes as tell where a point beside it most probably is.

use nalgebra::Vector3;

use crate::sheet::Sheet;
use crate::split::Half;
use crate::spots::dot;

/// Less than this cosine between beam and normal tells nothing about a range.
const GRAZING: f32 = 0.05;
/// Points farther from a sheet than this many standard deviations are none of its.
const FARTHEST: f32 = 3.0;

/// A sheet and where it is, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    /// From the origin of the sample.
    middle: [f32; 3],
    axes: [[f32; 3]; 3],
    heights: [f32; 6],
    per_radius: f32,
    /// Variance of the true surface about this one.
    variance: f32,
    /// The side of a plane on which the sheet is: its normal, and its distance from the middle.
    half: [f32; 4],
}

/// What a sheet says of a point: weight, move along the beam and the variance that is left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hypothesis {
    pub weight: f32,
    pub shift: f32,
    pub variance: f32,
}

impl Piece {
    pub(crate) fn of(middle: &Vector3<f64>, sheet: &Sheet, half: Option<&Half>) -> Self {
        let row = |k: usize| [0, 1, 2].map(|a| sheet.axes[(k, a)] as f32);
        let side = half.map_or([0.0; 4], |h| {
            let d = h.direction;
            [d[0], d[1], d[2], h.offset].map(|v| v as f32)
        });
        Self {
            middle: [0, 1, 2].map(|a| middle[a] as f32),
            axes: [0, 1, 2].map(row),
            heights: [0, 1, 2, 3, 4, 5].map(|k| sheet.heights[k] as f32),
            per_radius: 1.0 / sheet.radius as f32,
            variance: (sheet.roughness + sheet.variance) as f32,
            half: side,
        }
    }

    /// Of a point (m, from the origin of the sample) whose range has the standard deviation `sigma`.
    #[inline]
    pub(crate) fn says(&self, at: &[f32; 3], beam: &[f32; 3], sigma: f32) -> Option<Hypothesis> {
        let d = [0, 1, 2].map(|a| at[a] - self.middle[a]);
        let [x, y, z, offset] = self.half;
        if dot(&[x, y, z], &d) < offset {
            return None;
        }
        let [u, v, height] = self.axes.map(|row| dot(&row, &d));
        let (u, v, h) = (u * self.per_radius, v * self.per_radius, &self.heights);
        let share = 1.0 - u * u - v * v;
        if share <= 0.0 {
            return None;
        }
        let off = height - (h[0] + u * (h[1] + h[3] * u + h[4] * v) + v * (h[2] + h[5] * v));
        let du = (h[1] + 2.0 * h[3] * u + h[4] * v) * self.per_radius;
        let dv = (h[2] + h[4] * u + 2.0 * h[5] * v) * self.per_radius;
        let along = self.axes.map(|row| dot(&row, beam));
        // Neither is divided by the length of the normal, so that the move, their ratio, needs none.
        let squared_length = 1.0 + du * du + dv * dv;
        let slope = along[2] - du * along[0] - dv * along[1];
        // A beam from behind has met the other side of something thin.
        if slope > 0.0 || slope * slope < GRAZING * GRAZING * squared_length {
            return None;
        }
        let measured = slope * slope * sigma * sigma;
        let all = measured + self.variance * squared_length;
        let squared = off * off / all;
        if squared > FARTHEST * FARTHEST {
            return None;
        }
        let trust = measured / all;
        Some(Hypothesis {
            weight: share * share * (-0.5 * squared).exp(),
            shift: -trust * off / slope,
            variance: (1.0 - trust) * sigma * sigma,
        })
    }
}
