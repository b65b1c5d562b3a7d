// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pairs of surfels that are taken for the same patch of a surface.

#![allow(
    clippy::inline_always,
    reason = "only what is inlined into a dispatched function uses the machine's instructions"
)]

use bentwing_trajectory::Head;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::fixed_view::FixedView;
use crate::constraints::surfel_match::{self, MatchPlane};
use crate::neighbors::{Grid, claimed_pairs, mutual_pairs};
use crate::placed::{Placed, grid_of};
use crate::robust::cauchy_weight;
use crate::{
    GlobalVector, Globals, Health, N_GLOBALS, NormalEquations, RowGroup, Settings, Solution, index,
};

/// What a surfel is matched to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// Another surfel of the window.
    Moving(u32),
    /// A surfel of a fixed view: number of the view, number of the surfel.
    Fixed(u32, u32),
}

/// The surfel of a match, by its index among the placed ones, and what it is matched to.
type Pair = (u32, Target);

/// A match between two observations of a patch.
#[derive(Clone, Copy, Debug)]
pub struct Match {
    pair: Pair,
    plane: MatchPlane,
    group: Group,
}

/// First control points of the two sides; fixed views have none.
type Group = (usize, Option<usize>);

/// Mutual nearest neighbours on every level, within the window and with the fixed views.
pub fn find(placed: &Placed, views: &[&FixedView], settings: &Settings) -> Vec<Match> {
    let levels: Vec<usize> = (0..placed.voxel_sizes.len()).collect();
    let grid = |&l: &usize| grid_of(&placed.surfels[placed.level(l)], placed.voxel_sizes[l]);
    let grids: Vec<Grid> = levels.par_iter().map(grid).collect();
    let in_window = levels.iter().map(|&level| (level, None));
    let in_views = (0u32..)
        .zip(views)
        .flat_map(|(v, &view)| levels.iter().map(move |&level| (level, Some((v, view)))));
    let searches: Vec<_> = in_window.chain(in_views).collect();
    let pairs: Vec<Vec<Pair>> = searches
        .par_iter()
        .map(|&(level, view)| find_on_level(level, view, placed, &grids[level], settings))
        .collect();
    let plane = |&pair: &Pair| {
        let surfel = &placed.surfels[pair.0 as usize];
        let other = match pair.1 {
            Target::Moving(j) => &placed.surfels[j as usize],
            Target::Fixed(v, j) => &views[v as usize].surfels[j as usize],
        };
        let plane = MatchPlane::new(surfel, other, settings.range_sigma);
        let group = group(placed, pair);
        Match { pair, plane, group }
    };
    let mut matches = Vec::new();
    let pairs = pairs.concat();
    let planes = pairs.par_iter().with_min_len(MIN_ROWS_PER_TASK).map(plane);
    planes.collect_into_vec(&mut matches);
    matches
}

/// Pairs of the surfels of one level, which are in `grid`, among themselves or with a view.
fn find_on_level(
    level: usize,
    view: Option<(u32, &FixedView)>,
    placed: &Placed,
    grid: &Grid,
    settings: &Settings,
) -> Vec<Pair> {
    let search = settings.search();
    let first = placed.level_starts[level] as u32;
    let Some((v, view)) = view else {
        let nearest = grid.nearest(grid, &search);
        let moving = mutual_pairs(&nearest, search.k);
        return moving
            .map(|(a, b)| (first + a, Target::Moving(first + b)))
            .collect();
    };
    let Some(fixed) = view.grids.get(level) else {
        return Vec::new();
    };
    let nearest = fixed.nearest(grid, &search);
    let first_fixed = view.level_starts[level] as u32;
    let claimed = claimed_pairs(&nearest, fixed.len()).into_iter();
    claimed
        .map(|(a, b)| (first + a, Target::Fixed(v, first_fixed + b)))
        .collect()
}

/// Rows below which a task is not worth starting.
const MIN_ROWS_PER_TASK: usize = 512;

/// Sums of rows that are held at once; fixed, so that the order of addition does not depend on the
/// number of threads.
const MAX_TASKS: usize = 16;

/// Rows that are summed in one go.
struct RowSum<'a> {
    all: &'a MatchRows<'a>,
    rows: &'a [Match],
    n_controls: usize,
    step: Option<&'a Solution>,
    scale: f64,
}

impl WithSimd for RowSum<'_> {
    type Output = (NormalEquations, Health);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        self.all
            .sum(self.rows, self.n_controls, self.step, self.scale)
    }
}

/// The matches of an outer iteration, ordered by the control points they touch.
pub struct MatchRows<'a> {
    placed: &'a Placed,
    views: &'a [&'a FixedView],
    /// How far the calibration has come since each view was frozen.
    since_views: Vec<GlobalVector>,
    head: &'a Head,
    matches: &'a [Match],
}

impl<'a> MatchRows<'a> {
    /// The rows of `matches`, which are sorted.
    pub fn new(
        placed: &'a Placed,
        views: &'a [&'a FixedView],
        globals: &'a Globals,
        matches: &'a mut [Match],
    ) -> Self {
        // A changed latency moves a few surfels to other control points.
        for m in &mut *matches {
            m.group = group(placed, m.pair);
        }
        // Views in the order of their surfels, whose poses' responses are large.
        matches.par_sort_unstable_by_key(|m| (m.group, m.pair.1, m.pair.0));
        Self {
            placed,
            views,
            since_views: views
                .iter()
                .map(|v| globals.moved_from(&v.globals))
                .collect(),
            head: &globals.head,
            matches,
        }
    }

    /// Adds the rows, weighted by their residuals after `step`, if there was one.
    pub fn add(
        &self,
        equations: &mut NormalEquations,
        step: Option<&Solution>,
        scale: f64,
    ) -> Health {
        let n_rows = self.matches.len().div_ceil(MAX_TASKS);
        let tasks = self.matches.par_chunks(n_rows.max(MIN_ROWS_PER_TASK));
        let n_controls = equations.n_controls();
        let arch = Arch::new();
        let sums: Vec<_> = tasks
            // The widest instructions of the machine; the order of operations is the same.
            .map(|rows| {
                arch.dispatch(RowSum {
                    all: self,
                    rows,
                    n_controls,
                    step,
                    scale,
                })
            })
            .collect();
        let mut health = Health::default();
        for (part, part_health) in &sums {
            equations.merge(part);
            health.merge(part_health);
        }
        health
    }

    #[inline(always)]
    fn sum(
        &self,
        rows: &[Match],
        n_controls: usize,
        step: Option<&Solution>,
        scale: f64,
    ) -> (NormalEquations, Health) {
        let mut equations = NormalEquations::new(n_controls);
        let has_motor = self.head.motor.is_some();
        let placing = index::placing(has_motor);
        let (mut sum, mut health) = (RowGroup::of([], placing.clone()), Health::default());
        for rows in rows.chunk_by(|a, b| a.group == b.group) {
            let (first, other) = rows[0].group;
            // The poses of a view follow all of them.
            let globals = other.map_or_else(|| index::used(has_motor), |_| placing.clone());
            let controls = (first..first + 4).chain(other.into_iter().flat_map(|f| f..f + 4));
            sum.reset(controls, globals);
            for row in rows {
                self.add_row(row, &mut sum, &mut health, step, scale);
            }
            sum.flush(&mut equations);
        }
        (equations, health)
    }

    #[inline(always)]
    fn add_row(
        &self,
        row: &Match,
        sum: &mut RowGroup,
        health: &mut Health,
        step: Option<&Solution>,
        scale: f64,
    ) {
        let (i, target) = row.pair;
        let surfel = &self.placed.surfels[i as usize];
        let n = &row.plane.normal(surfel);
        let first = sum.first_global();
        sum.globals_mut().fill(0.0);
        surfel_match::write_knots(&mut sum.knots_mut()[..24], surfel, n, 1.0);
        surfel_match::add_globals(sum.globals_mut(), first, self.head, surfel, n, 1.0);
        let mut residual = n.dot(&surfel.mean);
        match target {
            Target::Moving(j) => {
                let other = &self.placed.surfels[j as usize];
                surfel_match::write_knots(&mut sum.knots_mut()[24..], other, n, -1.0);
                surfel_match::add_globals(sum.globals_mut(), first, self.head, other, n, -1.0);
                residual -= n.dot(&other.mean);
            }
            Target::Fixed(v, j) => {
                let view = self.views[v as usize];
                let other = &view.surfels[j as usize];
                let mut globals = [0.0; N_GLOBALS];
                surfel_match::add_globals(&mut globals, 0, self.head, other, n, -1.0);
                view.add_pose_response(&mut globals, j as usize, n, -1.0);
                residual -= n.dot(&other.mean);
                let since = &self.since_views[v as usize];
                let entries = globals.into_iter().zip(since).skip(first);
                for (to, (g, moved)) in sum.globals_mut().iter_mut().zip(entries) {
                    *to += g;
                    residual += g * moved;
                }
            }
        }
        let change = step.map_or(0.0, |s| sum.predict(&s.knots, &s.globals));
        let x = (residual + change) * row.plane.information.sqrt();
        let w = cauchy_weight(x, scale);
        sum.add(residual, w * row.plane.information);
        let is_fixed = matches!(target, Target::Fixed(..));
        health.add(is_fixed, x, w, n, &surfel.lever);
    }
}

fn group(placed: &Placed, pair: Pair) -> Group {
    let first = |surfel: u32| placed.surfels[surfel as usize].basis.first;
    match pair {
        (i, Target::Moving(j)) => (first(i), Some(first(j))),
        (i, Target::Fixed(..)) => (first(i), None),
    }
}
