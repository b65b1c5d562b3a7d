// SPDX-License-Identifier: MIT OR Apache-2.0
//! The registration of a flight as one window.

use bentwing_registration::{
    GlobalMatrix, GlobalPrior, Initial, N_GLOBALS, NormalEquations, Problem, first_equations, index,
};

use crate::Flight;

/// A head without motor, whose states do not exist, with clocks that run alike and an IMU whose answer
/// is known.
pub fn prior() -> GlobalPrior {
    GlobalPrior {
        information: GlobalMatrix::from_diagonal_element(1e5),
        offset: [0.0; N_GLOBALS],
        frozen: std::array::from_fn(|g| {
            index::MOTOR.contains(&g)
                || [
                    index::LATENCY_RATE,
                    index::RANGE_OFFSET,
                    index::RANGE_GRAZING,
                ]
                .contains(&g)
                || g >= index::GYRO_SCALE.start
        }),
    }
}

impl Flight {
    /// The normal equations of the whole flight.
    pub fn equations(&self) -> NormalEquations {
        let (sets, prior) = (self.surfels(), prior());
        let problem = Problem {
            trajectory: self.trajectory.clone(),
            sets: &sets,
            responses: &[],
            views: &[],
            imu: Some(&self.imu),
            globals: self.globals.clone(),
            prior: &prior,
            initial: Initial::Joined,
        };
        first_equations(&problem, &self.settings())
    }
}
