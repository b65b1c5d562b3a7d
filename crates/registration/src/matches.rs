// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pairs of surfels that are taken for the same patch of a surface.

use bentwing_neighbors::{Grid, Search, claimed_pairs, mutual_pairs};
use bentwing_trajectory::Head;
use rayon::prelude::*;

use crate::constraints::surfel_match::{self, MatchPlane};
use crate::fixed_view::FixedView;
use crate::placed::{Placed, PlacedSurfel};
use crate::robust::cauchy_weight;
use crate::rows::RowGroup;
use crate::solve::Solution;
use crate::{Health, NormalEquations, Settings};

/// Features are searched within cells of this size, in voxels.
const CELL: f32 = 1.0;

/// What a surfel is matched to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// Another surfel of the window.
    Moving(u32),
    /// A surfel of a fixed view: number of the view, number of the surfel.
    Fixed(u32, u32),
}

/// A match between two observations of a patch.
#[derive(Clone, Copy, Debug)]
pub struct Match {
    /// The surfel, by its index among the placed ones.
    pub surfel: u32,
    /// What it is matched to.
    pub target: Target,
}

/// The search grid of placed surfels of one level.
pub fn grid_of(surfels: &[PlacedSurfel], voxel_size: f64) -> Grid {
    let positions: Vec<[f32; 3]> = surfels
        .iter()
        .map(|s| (s.mean / voxel_size).cast::<f32>().into())
        .collect();
    let normals: Vec<[f32; 3]> = surfels
        .iter()
        .map(|s| s.normal.cast::<f32>().into())
        .collect();
    let times: Vec<f64> = surfels.iter().map(|s| s.time).collect();
    Grid::new(&positions, &normals, &times, CELL)
}

/// Mutual nearest neighbours on every level, within the window and with the fixed views.
pub fn find(placed: &Placed, views: &[&FixedView], settings: &Settings) -> Vec<Match> {
    let search = Search {
        k: settings.n_neighbors,
        max_distance: settings.max_match_distance as f32,
        min_time_gap: settings.min_match_gap as f32,
    };
    let mut matches = Vec::new();
    for (level, &size) in placed.voxel_sizes.iter().enumerate() {
        let first = placed.level_starts[level] as u32;
        let grid = grid_of(&placed.surfels[placed.level(level)], size);
        let nearest = grid.nearest(&grid, &search);
        matches.extend(mutual_pairs(&nearest).map(|(a, b)| Match {
            surfel: first + a,
            target: Target::Moving(first + b),
        }));
        for (v, view) in (0u32..).zip(views) {
            let Some(fixed) = view.grids.get(level) else {
                continue;
            };
            let nearest = fixed.nearest(&grid, &search);
            let first_fixed = view.level_starts[level] as u32;
            let pairs = claimed_pairs(&nearest, fixed.len());
            matches.extend(pairs.into_iter().map(|(a, b)| Match {
                surfel: first + a,
                target: Target::Fixed(v, first_fixed + b),
            }));
        }
    }
    matches
}

/// Rows per parallel task.
const ROWS_PER_TASK: usize = 512;

/// Tasks whose sums are held at once.
const TASKS_AT_ONCE: usize = 64;

/// The matches of an outer iteration with their planes, grouped by the control points they touch.
pub struct Linearization<'a> {
    placed: &'a Placed,
    head: &'a Head,
    /// Sorted by group.
    rows: Vec<(Group, Match, MatchPlane)>,
}

/// First control points of the two sides; fixed views have none.
type Group = (usize, Option<usize>);

impl<'a> Linearization<'a> {
    /// Computes the planes of `matches`.
    pub fn new(
        placed: &'a Placed,
        views: &[&FixedView],
        matches: &[Match],
        head: &'a Head,
        settings: &Settings,
    ) -> Self {
        let plane = |m: Match| {
            let surfel = &placed.surfels[m.surfel as usize];
            let (mean, covariance, other) = match m.target {
                Target::Moving(j) => {
                    let other = &placed.surfels[j as usize];
                    (&other.mean, &other.covariance, Some(other.basis.first))
                }
                Target::Fixed(v, j) => {
                    let (view, j) = (views[v as usize], j as usize);
                    (&view.means[j], &view.covariances[j], None)
                }
            };
            let plane = MatchPlane::new(surfel, mean, covariance, settings.range_sigma);
            ((surfel.basis.first, other), m, plane)
        };
        let chunks = matches.par_chunks(ROWS_PER_TASK);
        let rows: Vec<Vec<_>> = chunks
            .map(|c| c.iter().map(|&m| plane(m)).collect())
            .collect();
        let mut rows: Vec<_> = rows.into_iter().flatten().collect();
        rows.sort_by_key(|&(group, m, _)| (group, m.surfel, m.target));
        Self { placed, head, rows }
    }

    /// Adds the rows, weighted by their residuals after `step`.
    pub fn add(&self, equations: &mut NormalEquations, step: &Solution, scale: f64) -> Health {
        let mut tasks = Vec::new();
        for group in self.rows.chunk_by(|a, b| a.0 == b.0) {
            tasks.extend(group.chunks(ROWS_PER_TASK));
        }
        let mut health = Health::default();
        for batch in tasks.chunks(TASKS_AT_ONCE) {
            let sums: Vec<(RowGroup, Health)> = batch
                .par_iter()
                .map(|rows| self.sum(rows, step, scale))
                .collect();
            for (group, part) in sums {
                group.flush(equations);
                health.merge(&part);
            }
        }
        health
    }

    /// Sums rows of one group.
    fn sum(
        &self,
        rows: &[(Group, Match, MatchPlane)],
        step: &Solution,
        scale: f64,
    ) -> (RowGroup, Health) {
        let (first, other) = rows[0].0;
        let controls = (first..first + 4).chain(other.into_iter().flat_map(|f| f..f + 4));
        let mut group = RowGroup::new(controls.collect());
        let mut health = Health::default();
        for (_, m, plane) in rows {
            let n = &plane.normal;
            let surfel = &self.placed.surfels[m.surfel as usize];
            group.globals_mut().fill(0.0);
            surfel_match::write_knots(&mut group.knots_mut()[..24], surfel, n, 1.0);
            surfel_match::add_globals(group.globals_mut(), self.head, surfel, n, 1.0);
            if let Target::Moving(j) = m.target {
                let other = &self.placed.surfels[j as usize];
                surfel_match::write_knots(&mut group.knots_mut()[24..], other, n, -1.0);
                surfel_match::add_globals(group.globals_mut(), self.head, other, n, -1.0);
            }
            let after = plane.residual + group.predict(&step.knots, &step.globals);
            let x = after * plane.information.sqrt();
            let w = cauchy_weight(x, scale);
            group.add(plane.residual, w * plane.information);
            health.add(other.is_none(), x, w, n, &surfel.lever);
        }
        (group.summed(), health)
    }
}
