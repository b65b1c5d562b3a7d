// SPDX-License-Identifier: MIT OR Apache-2.0
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod constraints;
mod global;
mod globals;
mod health;
pub mod neighbors;
mod placed;
mod robust;
mod settings;
mod state;
mod system;
mod window;

pub use constraints::shown_noise::ShownNoise;
pub use global::{
    Counts, GlobalPosterior, GlobalProblem, GlobalRegistration, Iteration, Piece, PieceResult,
    Plan, register_globally,
};
pub use globals::{GlobalMatrix, GlobalPrior, GlobalVector, Globals, N_GLOBALS, index};
pub use health::Health;
pub use settings::{ImuNoise, Settings};
pub use state::StepSize;
pub use system::{
    NormalEquations, PoseResponse, RowGroup, Solution, SolveError, Solver, System, UNMOVED, follow,
};
pub use window::{
    Fit, FixedView, ImuFit, Initial, Posterior, Problem, Registration, first_equations,
    register_window,
};
