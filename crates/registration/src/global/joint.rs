// SPDX-License-Identifier: MIT OR Apache-2.0
//! One system for several pieces, each with global states of its own.
//!
//! The control points of all pieces come first. The global states of a piece stand behind them as if
//! they were control points: the system is one sparse matrix of 6×6 blocks, whatever the number of
//! pieces, and the solver's order keeps its fill low.

use std::ops::Range;

use crate::state::State;
use crate::system::normal_equations::Block;
use crate::system::solve::Factorized;
use crate::{GlobalMatrix, N_GLOBALS, NormalEquations, Solution, index};

/// Control points that the global states of a piece fill.
pub const N_STAND_INS: usize = N_GLOBALS.div_ceil(6);

/// Those of them with the states that matches concern.
pub fn placing_stand_ins(has_motor: bool) -> Range<usize> {
    let states = index::placing(has_motor);
    states.start / 6..states.end.div_ceil(6)
}

/// Where the unknowns of each piece stand.
pub struct Joint {
    /// First control point of each piece, and of the stand-ins.
    first: Vec<usize>,
}

impl Joint {
    pub fn new(states: &[State<'_>]) -> Self {
        let mut first = vec![0];
        for state in states {
            first.push(first[first.len() - 1] + state.spline.n_controls());
        }
        Self { first }
    }

    fn n_pieces(&self) -> usize {
        self.first.len() - 1
    }

    /// Control points of all pieces and their stand-ins.
    pub fn n_controls(&self) -> usize {
        self.stand_in(self.n_pieces())
    }

    /// Unknowns that are estimated.
    pub fn n_unknowns(&self, states: &[State<'_>]) -> usize {
        let active = states
            .iter()
            .map(|s| s.frozen.iter().filter(|f| !*f).count());
        6 * self.first[self.n_pieces()] + active.sum::<usize>()
    }

    /// Control point `k` of a piece.
    pub fn control(&self, piece: usize, k: usize) -> usize {
        self.first[piece] + k
    }

    /// First stand-in of a piece.
    pub fn stand_in(&self, piece: usize) -> usize {
        self.first[self.n_pieces()] + N_STAND_INS * piece
    }

    /// Adds equations of one piece.
    pub fn add_piece(&self, to: &mut NormalEquations, piece: usize, equations: &NormalEquations) {
        let controls: Vec<usize> = (0..equations.n_controls())
            .map(|k| self.control(piece, k))
            .collect();
        self.add(to, equations, &controls, piece);
    }

    /// Adds equations whose control point `k` is `controls[k]` here and whose global states are those
    /// of a piece.
    pub fn add(
        &self,
        to: &mut NormalEquations,
        from: &NormalEquations,
        controls: &[usize],
        piece: usize,
    ) {
        for ((row, column), block) in from.blocks() {
            to.add_block(controls[row], controls[column], row == column, block);
        }
        let first = self.stand_in(piece);
        for (k, &control) in controls.iter().enumerate() {
            let arrow = from.arrow(k);
            for p in 0..N_STAND_INS {
                to.add_block(first + p, control, false, &arrow_block(arrow, p));
            }
            let gradient = to.knot_gradient_mut(control).iter_mut();
            for (g, v) in gradient.zip(from.knot_gradient(k)) {
                *g += v;
            }
        }
        for p in 0..N_STAND_INS {
            for q in 0..=p {
                let block = corner_block(from.corner(), p, q);
                to.add_block(first + p, first + q, p == q, &block);
            }
            let gradient = to.knot_gradient_mut(first + p).iter_mut();
            for (g, v) in gradient.zip(&from.global_gradient[6 * p..]) {
                *g += v;
            }
        }
        to.cost += from.cost;
    }

    /// Takes what is not estimated out of the equations: what is frozen, and what fills up the
    /// stand-ins.
    pub fn freeze(&self, equations: &mut NormalEquations, states: &[State<'_>]) {
        let first = self.stand_in(0);
        let frozen = |control: usize, i: usize| {
            let place = 6 * (control - first) + i;
            let (piece, state) = (place / (6 * N_STAND_INS), place % (6 * N_STAND_INS));
            states[piece].frozen.get(state).copied().unwrap_or(true)
        };
        for ((row, column), block) in equations.blocks_mut() {
            for (c, entries) in block.iter_mut().enumerate() {
                for (r, entry) in entries.iter_mut().enumerate() {
                    let out =
                        (row >= first && frozen(row, r)) || (column >= first && frozen(column, c));
                    if out {
                        *entry = f64::from(u8::from(row == column && r == c));
                    }
                }
            }
        }
        for control in first..self.n_controls() {
            for i in (0..6).filter(|&i| frozen(control, i)) {
                equations.knot_gradient_mut(control)[i] = 0.0;
            }
        }
    }

    /// The parts of a solution that concern each piece.
    pub fn split(&self, solution: &Solution) -> Vec<Solution> {
        let part = |piece: usize| {
            let mut globals = [0.0; N_GLOBALS];
            let stand_ins = &solution.knots[self.stand_in(piece)..self.stand_in(piece + 1)];
            globals.copy_from_slice(&stand_ins.as_flattened()[..N_GLOBALS]);
            Solution {
                knots: solution.knots[self.first[piece]..self.first[piece + 1]].to_vec(),
                globals,
            }
        };
        (0..self.n_pieces()).map(part).collect()
    }

    /// Covariance of the global states of a piece; zero where frozen.
    pub fn covariance(
        &self,
        factorized: &Factorized,
        piece: usize,
        state: &State<'_>,
    ) -> GlobalMatrix {
        let all = factorized.covariance(self.stand_in(piece)..self.stand_in(piece + 1), &[]);
        let frozen = state.frozen;
        GlobalMatrix::from_fn(|r, c| {
            if frozen[r] || frozen[c] {
                0.0
            } else {
                all[(r, c)]
            }
        })
    }
}

/// The block between stand-in `p` and a control point with this arrow.
fn arrow_block(arrow: &[[f64; 6]; N_GLOBALS], p: usize) -> Block {
    let entry = |r: usize, c: usize| arrow.get(6 * p + r).map_or(0.0, |column| column[c]);
    std::array::from_fn(|c| std::array::from_fn(|r| entry(r, c)))
}

/// The block between the stand-ins `p` and `q`.
fn corner_block(corner: &GlobalMatrix, p: usize, q: usize) -> Block {
    let entry = |r: usize, c: usize| corner.get((6 * p + r, 6 * q + c)).copied().unwrap_or(0.0);
    std::array::from_fn(|c| std::array::from_fn(|r| entry(r, c)))
}
