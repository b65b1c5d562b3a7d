// SPDX-License-Identifier: MIT OR Apache-2.0
//! Prediction of state and covariance from one inertial sample to the next.

use bentwing_trajectory::so3;
use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::state::{DIM, Square, State, at};

/// Densities of the inertial noise, and how fast the slow states walk, per √s.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    /// rad/s/√Hz.
    pub gyro: f64,
    /// m/s²/√Hz.
    pub accel: f64,
    /// rad/s²/√Hz.
    pub gyro_bias_walk: f64,
    /// m/s³/√Hz.
    pub accel_bias_walk: f64,
    /// Of the mounts, rad/√s.
    pub rotation_walk: f64,
    /// Of the mounts, m/√s.
    pub translation_walk: f64,
    /// Of both delays, s/√s.
    pub delay_walk: f64,
}

/// One inertial sample: time, s; rate, rad/s; specific force, m/s².
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// s.
    pub time: f64,
    /// rad/s, imu frame.
    pub gyro: Vector3<f64>,
    /// m/s², imu frame.
    pub accel: Vector3<f64>,
}

impl Sample {
    /// The sample on the straight line between this one and a later one.
    #[must_use]
    pub fn towards(&self, later: &Self, time: f64) -> Self {
        let share = (time - self.time) / (later.time - self.time);
        Self {
            time,
            gyro: self.gyro + (later.gyro - self.gyro) * share,
            accel: self.accel + (later.accel - self.accel) * share,
        }
    }
}

/// Rows of the error that the prediction changes: attitude, position, velocity.
const MOVED: usize = 9;
/// What they depend on: themselves, the biases and gravity.
const CAUSES: usize = 17;
/// Derivative of the moved part after a step by the causes before it.
pub(crate) type Transition = SMatrix<f64, MOVED, CAUSES>;

/// The state `dt` after `state` under constant rate and force, and the derivative of the moved part.
pub(crate) fn step(
    state: &State,
    gyro: &Vector3<f64>,
    accel: &Vector3<f64>,
    dt: f64,
) -> (State, Transition) {
    let turn = (gyro - state.gyro_bias) * dt;
    let R = state.pose.R;
    // Over the step the force points where it does in the middle.
    let middle = so3::matrix(&(R * so3::exp(&(0.5 * turn))));
    let force = middle * (accel - state.accel_bias);
    let a = force - state.gravity;
    let mut next = *state;
    next.pose.R = so3::renormalized(R * so3::exp(&turn));
    next.pose.t += state.v * dt + a * (0.5 * dt * dt);
    next.v += a * dt;
    (next, transition(&middle, &force, &state.gravity, dt))
}

fn transition(
    middle: &Matrix3<f64>,
    force: &Vector3<f64>,
    gravity: &Vector3<f64>,
    dt: f64,
) -> Transition {
    let mut F = Transition::zeros();
    let mut set = |r: usize, c: usize, m: &Matrix3<f64>| {
        F.fixed_view_mut::<3, 3>(r, c).copy_from(m);
    };
    let one = Matrix3::identity();
    let (turned, half) = (-so3::hat(force) * dt, 0.5 * dt);
    set(at::ROTATION, at::ROTATION, &one);
    set(at::ROTATION, at::GYRO_BIAS, &(-middle * dt));
    set(at::VELOCITY, at::ROTATION, &turned);
    set(at::VELOCITY, at::VELOCITY, &one);
    set(at::VELOCITY, at::ACCEL_BIAS, &(-middle * dt));
    set(at::POSITION, at::ROTATION, &(turned * half));
    set(at::POSITION, at::POSITION, &one);
    set(at::POSITION, at::VELOCITY, &(one * dt));
    set(at::POSITION, at::ACCEL_BIAS, &(-middle * (dt * half)));
    // The force turns by half of what a bias turns the attitude by over the step.
    let late = so3::hat(force) * middle * (dt * half);
    set(at::VELOCITY, at::GYRO_BIAS, &late);
    set(at::POSITION, at::GYRO_BIAS, &(late * half));
    // v loses g dt, and g turns by δ: −δ × g dt = g × δ dt.
    let pull = so3::hat(gravity) * dt;
    F.fixed_view_mut::<3, 2>(at::VELOCITY, at::GRAVITY)
        .copy_from(&pull.fixed_columns::<2>(0));
    F.fixed_view_mut::<3, 2>(at::POSITION, at::GRAVITY)
        .copy_from(&(pull * half).fixed_columns::<2>(0));
    F
}

/// `P ← F P Fᵀ + Q dt`; F is the identity but for the moved rows.
pub(crate) fn spread(P: &mut Square, F: &Transition, noise: &Noise, dt: f64) {
    let rows: SMatrix<f64, MOVED, DIM> = F * P.fixed_rows::<CAUSES>(0);
    let block: SMatrix<f64, MOVED, MOVED> = rows.fixed_columns::<CAUSES>(0) * F.transpose();
    P.fixed_rows_mut::<MOVED>(0).copy_from(&rows);
    P.fixed_columns_mut::<MOVED>(0).copy_from(&rows.transpose());
    let even = 0.5 * (block + block.transpose());
    P.fixed_view_mut::<MOVED, MOVED>(0, 0).copy_from(&even);
    let mut add = |first: usize, n: usize, density: f64| {
        for i in first..first + n {
            P[(i, i)] += density * density * dt;
        }
    };
    add(at::ROTATION, 3, noise.gyro);
    add(at::VELOCITY, 3, noise.accel);
    add(at::GYRO_BIAS, 3, noise.gyro_bias_walk);
    add(at::ACCEL_BIAS, 3, noise.accel_bias_walk);
}

/// Adds the walks of the mounts and delays over `dt`, where they are not known exactly.
pub(crate) fn walk(P: &mut Square, noise: &Noise, dt: f64) {
    let mut add = |first: usize, n: usize, density: f64| {
        for i in first..first + n {
            if P[(i, i)] > 0.0 {
                P[(i, i)] += density * density * dt;
            }
        }
    };
    add(at::BASE_ROTATION, 3, noise.rotation_walk);
    add(at::BASE_TRANSLATION, 3, noise.translation_walk);
    add(at::LATENCY, 2, noise.delay_walk);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::{Tangent, tests::some_state};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_transition_is_the_derivative_of_the_step(
            values in prop::collection::vec(-1.0..1.0_f64, CAUSES),
            w in prop::collection::vec(-6.0..6.0_f64, 3),
            f in prop::collection::vec(-15.0..15.0_f64, 3),
        ) {
            let (x, dt, h) = (some_state(), 0.005, 1e-5);
            let (gyro, accel) = (Vector3::from_vec(w), Vector3::from_vec(f));
            let mut d = Tangent::zeros();
            d.fixed_rows_mut::<CAUSES>(0).copy_from_slice(&values);
            let (next, F) = step(&x, &gyro, &accel, dt);
            let ahead = step(&x.plus(&(d * h)), &gyro, &accel, dt).0.minus(&next);
            let behind = step(&x.plus(&(d * -h)), &gyro, &accel, dt).0.minus(&next);
            let numeric = ((ahead - behind) / (2.0 * h)).fixed_rows::<MOVED>(0).into_owned();
            let analytic = F * d.fixed_rows::<CAUSES>(0);
            prop_assert!((numeric - analytic).norm() < 1e-4, "{}", (numeric - analytic).norm());
        }
    }

    #[test]
    fn the_covariance_follows_the_whole_transition() {
        let noise = Noise {
            gyro: 1e-3,
            accel: 2e-2,
            gyro_bias_walk: 1e-5,
            accel_bias_walk: 1e-4,
            rotation_walk: 0.0,
            translation_walk: 0.0,
            delay_walk: 0.0,
        };
        let L = Square::from_fn(|i, j| {
            if j <= i {
                ((i * 7 + j * 3) % 11) as f64 * 0.1
            } else {
                0.0
            }
        });
        let mut P = L * L.transpose();
        let before = P;
        let (_, F) = step(
            &some_state(),
            &Vector3::new(1.0, 2.0, 3.0),
            &Vector3::z(),
            0.01,
        );
        spread(&mut P, &F, &noise, 0.01);
        let mut whole = Square::identity();
        whole.fixed_view_mut::<MOVED, CAUSES>(0, 0).copy_from(&F);
        let mut expected = whole * before * whole.transpose();
        for (first, density) in [(0, 1e-3), (6, 2e-2), (9, 1e-5), (12, 1e-4_f64)] {
            for i in first..first + 3 {
                expected[(i, i)] += density * density * 0.01;
            }
        }
        assert!((P - expected).norm() < 1e-12 * expected.norm());
    }
}
