// SPDX-License-Identifier: MIT OR Apache-2.0
//! The matches of two stretches, and their rows.

#![allow(
    clippy::inline_always,
    reason = "only what is inlined into a dispatched function uses the machine's instructions"
)]

use std::ops::Range;

use bentwing_voxels::{VoxelKey, voxel_of};
use pulp::{Simd, WithSimd};

use super::bend;
use super::chunk::Laid;
use super::joint::{Joint, placing_stand_ins};
use super::scatter::Pulls;
use crate::constraints::surfel_match::{self, MatchPlane};
use crate::neighbors::{Search, claimed_pairs};
use crate::placed::PlacedSurfel;
use crate::robust::cauchy_weight;
use crate::state::State;
use crate::{Health, NormalEquations, RowGroup, Settings, index};

/// A surfel of the one stretch, one of the other, and their plane.
#[derive(Clone, Copy, Debug)]
pub struct LinkMatch {
    i: u32,
    j: u32,
    plane: MatchPlane,
    /// What the bend of their surface adds to `nᵀ (μ_i − μ_j)`, m.
    offset: f64,
}

impl LinkMatch {
    /// The match of surfel `i` of `a` with surfel `j` of `b`.
    pub fn between(a: &Laid, i: usize, b: &Laid, j: usize, range_sigma: f64) -> Self {
        let (surfel, other) = (&a.placed.surfels[i], &b.placed.surfels[j]);
        let bend = bend::between(&a.searched.bends[i], &b.searched.bends[j]);
        Self {
            i: i as u32,
            j: j as u32,
            plane: MatchPlane::new(surfel, other, range_sigma),
            offset: bend::depth(&bend, &surfel.covariance) - bend::depth(&bend, &other.covariance),
        }
    }

    /// Its normal, its weight and what the bend adds to its residual.
    #[cfg(test)]
    pub fn plane_at(&self, a: &Laid) -> (nalgebra::Vector3<f64>, f64, f64) {
        let surfel = &a.placed.surfels[self.i as usize];
        let plane = &self.plane;
        (plane.normal(surfel), plane.information, self.offset)
    }
}

/// Two stretches, or one with itself, that are matched.
pub struct Link {
    pub a: usize,
    pub b: usize,
    /// Pieces of the two.
    pub pieces: [usize; 2],
    /// Whether they are the same or follow each other.
    pub is_near: bool,
    pub matches: Vec<LinkMatch>,
}

impl Link {
    /// Nearest neighbours that found each other, on every level.
    pub fn find(&self, a: &Laid, b: &Laid, settings: &Settings) -> Vec<LinkMatch> {
        let levels = 0..a.searched.grids.len().min(b.searched.grids.len());
        let pairs: Vec<_> = levels.map(|l| self.pairs(a, b, l, settings)).collect();
        // Exactly as much as is needed: there are millions of matches.
        let mut found = Vec::with_capacity(pairs.iter().map(Vec::len).sum());
        for (level, pairs) in pairs.iter().enumerate() {
            let first = [a, b].map(|laid| laid.placed.level_starts[level]);
            found.extend(pairs.iter().map(|&(i, j)| {
                let (i, j) = (first[0] + i as usize, first[1] + j as usize);
                LinkMatch::between(a, i, b, j, settings.range_sigma)
            }));
        }
        found
    }

    fn pairs(&self, a: &Laid, b: &Laid, level: usize, settings: &Settings) -> Vec<(u32, u32)> {
        if self.a == self.b {
            return a.searched.own_pairs[level].clone();
        }
        let search = Search {
            // Of every other visit the best counterpart.
            k: 1,
            // Pieces may have clocks of their own.
            min_time_gap: if self.pieces[0] == self.pieces[1] {
                settings.min_match_gap as f32
            } else {
                -1.0
            },
            ..settings.search()
        };
        let nearest = b.searched.grids[level].nearest(&a.searched.grids[level], &search);
        claimed_pairs(&nearest, b.searched.grids[level].len())
    }
}

/// Where the control points of a link stand in equations that hold no others.
struct Places {
    /// Control point of the first surfel's piece that is the first one.
    first: usize,
    /// What to add to a control point of the second surfel's piece.
    second: isize,
    /// Where the global states of the second surfel's piece stand, if it is another one.
    stand_in: Option<usize>,
    /// Control points in the whole system.
    controls: Vec<usize>,
}

impl Places {
    fn new(link: &Link, laid: [&Laid; 2], joint: &Joint, stand_ins: Range<usize>) -> Self {
        let [(a, a_end), (b, b_end)] = laid.map(range);
        let [p, q] = link.pieces;
        let mut controls: Vec<usize>;
        let (first, second);
        if p == q && b <= a_end {
            first = a.min(b);
            second = -(first as isize);
            controls = (first..a_end.max(b_end))
                .map(|k| joint.control(p, k))
                .collect();
        } else {
            first = a;
            second = (a_end - a) as isize - b as isize;
            controls = (a..a_end).map(|k| joint.control(p, k)).collect();
            controls.extend((b..b_end).map(|k| joint.control(q, k)));
        }
        let stand_in = (p != q).then_some(controls.len());
        if p != q {
            controls.extend(stand_ins.map(|s| joint.stand_in(q) + s));
        }
        Self {
            first,
            second,
            stand_in,
            controls,
        }
    }

    fn of_first(&self, surfel: &PlacedSurfel) -> usize {
        surfel.basis.first - self.first
    }

    fn of_second(&self, surfel: &PlacedSurfel) -> usize {
        surfel.basis.first.wrapping_add_signed(self.second)
    }
}

/// The control points that move a stretch.
fn range(laid: &Laid) -> (usize, usize) {
    let firsts = laid.placed.surfels.iter().map(|s| s.basis.first);
    let (low, high) = firsts.fold((usize::MAX, 0), |(low, high), f| (low.min(f), high.max(f)));
    (low.min(high), high + 4)
}

/// The rows of a link that are summed in one go.
pub struct LinkSum<'a> {
    pub link: &'a Link,
    pub matches: &'a [LinkMatch],
    pub laid: [&'a Laid; 2],
    pub states: &'a [State<'a>],
    pub joint: &'a Joint,
    pub scale: f64,
    /// Whether it is asked what the matches pull.
    pub judged: bool,
}

/// Equations of a link, their control points in the whole system, and its health.
pub struct LinkEquations {
    pub equations: NormalEquations,
    pub controls: Vec<usize>,
    pub health: Health,
    /// What the matches pull, if it was asked for.
    pub pulls: Pulls,
}

impl WithSimd for LinkSum<'_> {
    type Output = LinkEquations;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        self.sum()
    }
}

impl LinkSum<'_> {
    #[inline(always)]
    fn sum(&self) -> LinkEquations {
        let (states, held) = (index::placing(self.has_motor()), self.stand_ins());
        let places = Places::new(self.link, self.laid, self.joint, held.clone());
        let mut equations = NormalEquations::new(places.controls.len());
        let (mut rows, mut health) = (RowGroup::of([], states.clone()), Health::default());
        let group = |m: &LinkMatch| {
            let [s, t] = self.surfels(m);
            (places.of_first(s), places.of_second(t))
        };
        let mut ordered: Vec<_> = self.matches.iter().map(|m| (group(m), m)).collect();
        ordered.sort_by_key(|&(group, _)| group);
        for of_group in ordered.chunk_by(|a, b| a.0 == b.0) {
            let (first, second) = of_group[0].0;
            let stand_ins = places.stand_in.into_iter().flat_map(|s| s..s + held.len());
            let controls = (first..first + 4).chain(second..second + 4);
            rows.reset(controls.chain(stand_ins), states.clone());
            for (_, m) in of_group {
                self.add_row(m, &mut rows, &mut health);
            }
            rows.flush(&mut equations);
        }
        LinkEquations {
            pulls: if self.judged {
                self.pulls()
            } else {
                Pulls::new()
            },
            equations,
            controls: places.controls,
            health,
        }
    }

    /// Whether a lidar of the two is turned by a motor.
    fn has_motor(&self) -> bool {
        let mut pieces = self.link.pieces.into_iter();
        pieces.any(|p| self.states[p].globals.head.motor.is_some())
    }

    /// The stand-ins, of those of a piece, with the states that its matches concern.
    fn stand_ins(&self) -> Range<usize> {
        placing_stand_ins(self.has_motor())
    }

    /// What the matches pull at each control point, patch by patch of the coarsest voxels.
    fn pulls(&self) -> Pulls {
        let edge = self.laid[0].placed.voxel_sizes.last().copied();
        let mut pulls = Pulls::new();
        for m in self.matches {
            let [surfel, other] = self.surfels(m);
            let n = &m.plane.normal(surfel);
            let mut row = [0.0; 48];
            surfel_match::write_knots(&mut row[..24], surfel, n, 1.0);
            surfel_match::write_knots(&mut row[24..], other, n, -1.0);
            let residual = n.dot(&(surfel.mean - other.mean)) + m.offset;
            let w = cauchy_weight(residual * m.plane.information.sqrt(), self.scale);
            let middle = 0.5 * (surfel.mean + other.mean);
            let patch = VoxelKey::new(voxel_of(&middle.into(), edge.unwrap_or(1.0)));
            let sides = [surfel, other].into_iter().zip(self.link.pieces);
            let controls = sides
                .flat_map(|(s, p)| (0..4).map(move |k| self.joint.control(p, s.basis.first + k)));
            for (entries, control) in row.chunks_exact(6).zip(controls) {
                let sum = pulls.entry((patch, control)).or_default();
                for (to, entry) in sum.iter_mut().zip(entries) {
                    *to += w * m.plane.information * residual * entry;
                }
            }
        }
        pulls
    }

    #[inline(always)]
    fn surfels(&self, m: &LinkMatch) -> [&PlacedSurfel; 2] {
        let [a, b] = self.laid;
        [
            &a.placed.surfels[m.i as usize],
            &b.placed.surfels[m.j as usize],
        ]
    }

    #[inline(always)]
    fn add_row(&self, m: &LinkMatch, rows: &mut RowGroup, health: &mut Health) {
        let [surfel, other] = self.surfels(m);
        let heads = self.link.pieces.map(|p| &self.states[p].globals.head);
        let n = &m.plane.normal(surfel);
        let first = rows.first_global();
        rows.globals_mut().fill(0.0);
        surfel_match::write_knots(&mut rows.knots_mut()[..24], surfel, n, 1.0);
        surfel_match::add_globals(rows.globals_mut(), first, heads[0], surfel, n, 1.0);
        surfel_match::write_knots(&mut rows.knots_mut()[24..48], other, n, -1.0);
        if self.link.pieces[0] == self.link.pieces[1] {
            surfel_match::add_globals(rows.globals_mut(), first, heads[1], other, n, -1.0);
        } else {
            let stand_ins = &mut rows.knots_mut()[48..];
            stand_ins.fill(0.0);
            surfel_match::add_globals(
                stand_ins,
                6 * self.stand_ins().start,
                heads[1],
                other,
                n,
                -1.0,
            );
        }
        let residual = n.dot(&(surfel.mean - other.mean)) + m.offset;
        let x = residual * m.plane.information.sqrt();
        let w = cauchy_weight(x, self.scale);
        rows.add(residual, w * m.plane.information);
        health.add(false, x, w, n, &surfel.lever);
    }
}
