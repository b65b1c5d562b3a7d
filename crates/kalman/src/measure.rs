// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where a feature is in the map, how that follows the state, and what it measures.
//!
//! A feature stamped τ was measured at `t = τ − latency`, a time `dt` before the end of the sweep.
//! The prediction gives the pose then; an error of the state at the end moves it (Fu 2023's second
//! compensation, with velocity and gyro bias kept in):
//! `δr(t) = δr + R dt δb_g`, `δp(t) = δp − dt δv`.

use bentwing_trajectory::so3;
use nalgebra::{Matrix3, SVector, UnitQuaternion, Vector3};

use crate::features::Feature;
use crate::state::{State, Tangent, at};

/// Parts of the state that a feature depends on: all but the accelerometer's bias and gravity.
pub(crate) const SEEN: usize = 26;
/// How a residual depends on them.
pub(crate) type Row = SVector<f64, SEEN>;

/// The place in the state of a column of `Row`.
pub(crate) fn column(i: usize) -> usize {
    if i < at::ACCEL_BIAS {
        i
    } else {
        i + at::BASE_ROTATION - at::ACCEL_BIAS
    }
}

/// The predicted pose at the time of a feature, and how it moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    pub R: UnitQuaternion<f64>,
    pub p: Vector3<f64>,
    /// m/s, map frame.
    pub v: Vector3<f64>,
    /// rad/s, map frame.
    pub omega: Vector3<f64>,
    /// s, from here to the end of the sweep.
    pub dt: f64,
}

/// The motor: its axis, and how fast it turns at a feature.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turning {
    pub axis: Vector3<f64>,
    /// rad/s, in the middle of the sweep.
    pub rate: f64,
    /// rad/s², of the rate.
    pub change: f64,
    /// s, of the middle.
    pub middle: f64,
}

impl Turning {
    /// How fast the motor turns at a time, rad/s.
    fn rate_at(&self, time: f64) -> f64 {
        self.rate + self.change * (time - self.middle)
    }
}

/// A feature in the map, with the levers by which the state moves it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    pub x: Vector3<f64>,
    /// From the IMU, map frame.
    lever: Vector3<f64>,
    /// From the base, imu frame, and its rotations.
    in_base: Vector3<f64>,
    R: Matrix3<f64>,
    R_base: Matrix3<f64>,
    turn: Matrix3<f64>,
    in_turned: Vector3<f64>,
    in_motor: Vector3<f64>,
    v: Vector3<f64>,
    omega: Vector3<f64>,
    dt: f64,
    axis: Vector3<f64>,
    rate: f64,
}

/// Rotations of the mounts as matrices, once for all features.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mounts {
    base: Matrix3<f64>,
    lidar: Matrix3<f64>,
}

impl Mounts {
    pub(crate) fn of(state: &State) -> Self {
        Self {
            base: so3::matrix(&state.base.R),
            lidar: so3::matrix(&state.lidar.R),
        }
    }
}

/// Places a feature by `state`, which differs from the prediction by `error`.
pub(crate) fn place(
    feature: &Feature,
    moment: &Moment,
    turning: &Turning,
    (state, mounts): (&State, &Mounts),
    error: &Tangent,
) -> Placed {
    let part = |i: usize| error.fixed_rows::<3>(i).into_owned();
    let late = error[at::LATENCY];
    let turned =
        part(at::ROTATION) + moment.R * part(at::GYRO_BIAS) * moment.dt - moment.omega * late;
    let R = so3::matrix(&(so3::exp(&turned) * moment.R));
    let p = moment.p + part(at::POSITION) - part(at::VELOCITY) * moment.dt - moment.v * late;
    let in_turned = mounts.lidar * feature.p;
    let rate = turning.rate_at(feature.time);
    let angle = feature.angle - rate * state.encoder_delay;
    let turn = so3::matrix(&so3::exp(&(turning.axis * angle)));
    let in_motor = turn * (in_turned + state.lidar.t);
    let in_base = mounts.base * in_motor;
    let lever = R * (in_base + state.base.t);
    Placed {
        x: lever + p,
        lever,
        in_base,
        R,
        R_base: mounts.base,
        turn,
        in_turned,
        in_motor,
        v: moment.v,
        omega: moment.omega,
        dt: moment.dt,
        axis: turning.axis,
        rate,
    }
}

impl Placed {
    /// Derivative of `n · x` by the state, for a direction `n` in the map.
    pub(crate) fn row(&self, n: &Vector3<f64>) -> Row {
        let about = self.lever.cross(n);
        let in_imu = self.R.tr_mul(n);
        let in_motor = self.R_base.tr_mul(&in_imu);
        let in_turned = self.turn.tr_mul(&in_motor);
        let mut h = Row::zeros();
        let mut set = |i: usize, v: &Vector3<f64>| h.fixed_rows_mut::<3>(i).copy_from(v);
        set(0, &about);
        set(3, n);
        set(6, &(n * -self.dt));
        set(9, &(self.R.tr_mul(&about) * self.dt));
        set(12, &self.in_base.cross(&in_imu));
        set(15, &in_imu);
        set(18, &self.in_turned.cross(&in_turned));
        set(21, &in_turned);
        h[24] = -(n.dot(&self.v) + about.dot(&self.omega));
        h[25] = -self.rate * self.axis.cross(&self.in_motor).dot(&in_motor);
        h
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::{DIM, tests::some_state};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rows_are_the_derivative_of_the_place(
            values in prop::collection::vec(-1.0..1.0_f64, DIM),
            p in prop::collection::vec(-9.0..9.0_f64, 3),
            n in prop::collection::vec(-1.0..1.0_f64, 3),
            angle in -9.0..9.0_f64, far in 0.0..1.0_f64,
        ) {
            let (x0, h) = (some_state(), 1e-6);
            let moment = Moment {
                R: x0.pose.R, p: x0.pose.t, v: Vector3::new(0.6, -1.0, 0.3),
                omega: Vector3::new(0.5, 1.0, -2.0), dt: 0.07,
            };
            let turning = Turning { axis: Vector3::new(0.6, 0.0, 0.8), rate: 6.3, change: 2.0, middle: -0.2 };
            let feature = Feature { p: Vector3::from_vec(p), time: 0.0, angle, variance: 1.0 };
            let d = Tangent::from_vec(values);
            let n = Vector3::from_vec(n);
            // Away from the prediction by something that only moves the mounts and the position.
            let mut away = Tangent::zeros();
            away.fixed_rows_mut::<3>(at::POSITION).fill(0.1 * far);
            away.fixed_rows_mut::<12>(at::BASE_ROTATION).fill(0.05 * far);
            let at_error = |e: &Tangent| {
                let x = x0.plus(&away).plus(e);
                let placed = place(&feature, &moment, &turning, (&x, &Mounts::of(&x)), &x.minus(&x0));
                (n.dot(&placed.x), placed)
            };
            let numeric = (at_error(&(d * h)).0 - at_error(&(d * -h)).0) / (2.0 * h);
            let row = at_error(&Tangent::zeros()).1.row(&n);
            let analytic: f64 = (0..SEEN).map(|i| row[i] * d[column(i)]).sum();
            prop_assert!((numeric - analytic).abs() < 1e-5 * (1.0 + analytic.abs()), "{numeric} {analytic}");
        }
    }
}
