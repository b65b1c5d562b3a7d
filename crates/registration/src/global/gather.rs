// SPDX-License-Identifier: MIT OR Apache-2.0
//! Finds the matches of all links and adds their rows, some links at a time.

use std::collections::BTreeSet;

use pulp::Arch;
use rayon::prelude::*;

use super::chunk::{Chunk, Holder};
use super::joint::Joint;
use super::link::{Link, LinkEquations, LinkMatch, LinkSum};
use super::overlap::{follow, links};
use super::problem::{Counts, GlobalProblem};
use super::scatter::Scatter;
use crate::state::State;
use crate::{Health, NormalEquations, Settings};

/// Links that are worked on side by side; fixed, so that nothing depends on the number of threads.
const WAVE: usize = 32;

/// The stretches of all pieces, what is matched with what, and the matches.
pub struct Gatherer {
    chunks: Vec<Chunk>,
    links: Vec<Link>,
    n_held: usize,
    settings: Settings,
    /// Whether the matches are to be found anew.
    stale: bool,
}

impl Gatherer {
    pub fn new(problem: &GlobalProblem<'_>, states: &[State<'_>], settings: &Settings) -> Self {
        let of_piece = problem.pieces.iter().enumerate().flat_map(|(piece, p)| {
            let filled = p.chunks.iter().filter(|s| !s.is_empty());
            filled.map(move |s| Chunk {
                piece,
                surfels: s.clone(),
            })
        });
        let chunks: Vec<Chunk> = of_piece.collect();
        let link = |(a, b): (usize, usize)| Link {
            a,
            b,
            pieces: [chunks[a].piece, chunks[b].piece],
            is_near: follow(&chunks, a, b),
            matches: Vec::new(),
        };
        let links = links(&chunks, states, &problem.plan);
        Self {
            links: links.into_iter().map(link).collect(),
            chunks,
            n_held: problem.plan.n_held,
            settings: settings.clone(),
            stale: true,
        }
    }

    pub fn counts(&self) -> Counts {
        Counts {
            n_unknowns: 0,
            n_links: self.links.len(),
            n_far_links: self.links.iter().filter(|l| !l.is_near).count(),
            n_surfels: self.chunks.iter().map(|c| c.surfels.len()).sum(),
        }
    }

    /// Finds the matches anew when they are needed next.
    pub fn match_again(&mut self) {
        self.stale = true;
    }

    /// Adds the rows of all matches; returns how they fit and how many are between stretches that do
    /// not follow each other.
    pub fn add(
        &mut self,
        equations: &mut NormalEquations,
        joint: &Joint,
        states: &[State<'_>],
        scale: f64,
    ) -> (Health, usize) {
        let (mut health, mut n_far) = (Health::default(), 0);
        self.each(states, joint, scale, false, |link, part| {
            let piece = link.pieces[0];
            joint.add(equations, &part.equations, &part.controls, piece);
            health.merge(&part.health);
            n_far += if link.is_near {
                0
            } else {
                part.health.n_moving
            };
        });
        (health, n_far)
    }

    /// Adds the rows of all matches; returns how they fit, and how much they scatter beside what their
    /// weights say.
    pub fn judge(
        &mut self,
        equations: &mut NormalEquations,
        joint: &Joint,
        states: &[State<'_>],
        scale: f64,
    ) -> (Health, f64) {
        let (mut health, mut scatter) = (Health::default(), Scatter::new());
        self.each(states, joint, scale, true, |link, mut part| {
            joint.add(equations, &part.equations, &part.controls, link.pieces[0]);
            health.merge(&part.health);
            let poses = (0..part.controls.len()).filter(|&k| part.controls[k] < joint.stand_in(0));
            let diagonals = poses.map(|k| part.equations.diagonal(k));
            scatter.add(std::mem::take(&mut part.pulls), diagonals);
        });
        (health, scatter.dispersion())
    }

    fn each(
        &mut self,
        states: &[State<'_>],
        joint: &Joint,
        scale: f64,
        judged: bool,
        mut take: impl FnMut(&Link, LinkEquations),
    ) {
        let (chunks, settings, stale) = (&self.chunks, &self.settings, self.stale);
        let mut holder = Holder::new(self.n_held, stale.then_some(settings));
        for wave in self.links.chunks_mut(WAVE) {
            let needed: BTreeSet<usize> = wave.iter().flat_map(|l| [l.a, l.b]).collect();
            holder.provide(&needed, chunks, states);
            let holder = &holder;
            let sums: Vec<Option<(Option<Vec<LinkMatch>>, LinkEquations)>> = wave
                .par_iter()
                .map(|link| {
                    let laid = [holder.get(link.a)?, holder.get(link.b)?];
                    let found = stale.then(|| link.find(laid[0], laid[1], settings));
                    let matches = found.as_deref().unwrap_or(&link.matches);
                    let sum = LinkSum {
                        link,
                        matches,
                        laid,
                        states,
                        joint,
                        scale,
                        judged,
                    };
                    let equations = equations_of(sum);
                    Some((found, equations))
                })
                .collect();
            for (link, sum) in wave.iter_mut().zip(sums) {
                let Some((found, equations)) = sum else {
                    continue;
                };
                if let Some(matches) = found {
                    link.matches = matches;
                }
                take(link, equations);
            }
        }
        self.stale = false;
    }
}

/// The rows of a link, summed.
pub(super) fn equations_of(sum: LinkSum<'_>) -> LinkEquations {
    // The widest instructions of the machine; the order of operations is the same.
    Arch::new().dispatch(sum)
}
