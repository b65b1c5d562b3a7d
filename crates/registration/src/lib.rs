// SPDX-License-Identifier: MIT OR Apache-2.0
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod bend;
mod constraints;
mod fixed_view;
mod global;
mod globals;
mod health;
mod matches;
mod normal_equations;
mod placed;
mod response;
mod robust;
mod rows;
mod settings;
mod solve;
mod step;
mod uncertainty;
mod window;

pub use fixed_view::FixedView;
pub use global::{
    Counts, GlobalProblem, GlobalRegistration, Iteration, Piece, PieceResult, Plan,
    register_globally,
};
pub use globals::{GlobalPrior, Globals, N_GLOBALS, index};
pub use health::Health;
pub use normal_equations::NormalEquations;
pub use response::{PoseResponse, UNMOVED, follow};
pub use rows::RowGroup;
pub use settings::{ImuNoise, Settings};
pub use solve::{Solution, SolveError, Solver, System};
pub use step::StepSize;
pub use uncertainty::Posterior;
pub use window::{Initial, Problem, Registration, first_equations, register_window};

/// A vector of all global states or their corrections.
pub type GlobalVector = [f64; N_GLOBALS];
/// A matrix over all global states.
pub type GlobalMatrix = nalgebra::SMatrix<f64, N_GLOBALS, N_GLOBALS>;
