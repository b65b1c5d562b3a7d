// SPDX-License-Identifier: MIT OR Apache-2.0
//! The points from which surfaces are found.

use rayon::prelude::*;

use crate::grid::{Level, NONE, code_of};
use crate::noise::step_of;
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
    /// What is measured within this time shares the error of the trajectory, s.
    pub pass: f64,
}

/// A point of a sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shot {
    /// From the first point of the sample, m.
    pub at: [f32; 3],
    pub beam: [f32; 3],
    /// Of the range.
    pub step: u8,
    pub pass: u8,
    /// Among those that are refined; `NONE` where it only tells where others are.
    pub place: u32,
}

/// Points of a part of a map, in any order.
#[derive(Clone, Debug)]
pub struct Sample {
    settings: Settings,
    origin: Option<[f64; 3]>,
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
            origin: None,
            shots: Vec::new(),
            n_own: 0,
        }
    }

    /// Adds points (m, map frame) with the unit directions of their beams, the beams' lengths (m) and
    /// times (s), and whether each is to be refined or only tells where others are.
    pub fn add(
        &mut self,
        points: &[[f64; 3]],
        beams: &[[f32; 3]],
        ranges: &[f32],
        times: &[f64],
        own: &[bool],
    ) {
        let Some(first) = points.first() else { return };
        // Wherever a part begins, its cells are those of the map.
        let largest = self.settings.edge * f64::from(1_u32 << (self.settings.n_levels - 1));
        let origin = *self
            .origin
            .get_or_insert_with(|| first.map(|c| (c / largest).floor() * largest));
        self.shots.reserve(points.len());
        for (i, p) in points.iter().enumerate() {
            let place = if own[i] { self.n_own } else { NONE };
            self.n_own += u32::from(own[i]);
            self.shots.push(Shot {
                at: [0, 1, 2].map(|a| (p[a] - origin[a]) as f32),
                beam: beams[i],
                step: step_of(ranges[i]),
                pass: ((times[i] / self.settings.pass).floor() as i64).rem_euclid(N_PASSES as i64)
                    as u8,
                place,
            });
        }
    }

    pub(crate) fn sorted(self) -> Sorted {
        let edge = self.settings.edge;
        let code = |s: &Shot| code_of(s.at.map(|c| (f64::from(c) / edge).floor() as i64));
        let mut order: Vec<(u64, u32)> = self
            .shots
            .par_iter()
            .enumerate()
            .map(|(i, s)| (code(s), i as u32))
            .collect();
        order.par_sort_unstable();
        let shots = order
            .par_iter()
            .map(|&(_, i)| self.shots[i as usize])
            .collect();
        drop(self.shots);
        let codes: Vec<u64> = order.into_iter().map(|(code, _)| code).collect();
        let levels = (0..self.settings.n_levels)
            .map(|l| Level::of(&codes, edge, l))
            .collect();
        Sorted {
            settings: self.settings,
            shots,
            levels,
            n_own: self.n_own as usize,
        }
    }
}
