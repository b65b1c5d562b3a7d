// SPDX-License-Identifier: MIT OR Apache-2.0
//! The slow states that are estimated along with the trajectory.

use std::ops::Range;

use bentwing_trajectory::{Head, InertialUnit, MotorErrors, so3};
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

/// Number of global states.
pub const N_GLOBALS: usize = 57;
/// A vector of all global states or their corrections.
pub type GlobalVector = [f64; N_GLOBALS];
/// A matrix over all global states.
pub type GlobalMatrix = nalgebra::SMatrix<f64, N_GLOBALS, N_GLOBALS>;

/// Where each global state stands in a [`GlobalVector`].
pub mod index {
    use std::ops::Range;

    /// Those of a motor, which stand first: heads without one leave them out.
    pub const MOTOR: Range<usize> = 0..15;
    /// Those that inertial samples depend on.
    pub const INERTIAL: Range<usize> = 25..57;

    /// Added to every encoder angle, rad.
    pub const ENCODER_ZERO: usize = 0;
    /// Rotation of the lidar about two axes perpendicular to the motor's, rad, motor frame.
    pub const MOTOR_TILT: Range<usize> = 1..3;
    /// Translation of the lidar perpendicular to the motor's axis, m, motor frame.
    pub const MOTOR_OFFSET: Range<usize> = 3..5;
    /// Of the cosine and the sine of the encoder's angle, added to it, rad.
    pub const ECCENTRICITY: Range<usize> = 5..7;
    /// Of cosine and sine of the encoder's angle and of twice that: how the shaft leans about the first
    /// axis across it, and about the second, rad.
    pub const WOBBLE: Range<usize> = 7..15;
    /// Lidar stamps minus IMU clock at the epoch of the lidar's clock, s.
    pub const LATENCY: usize = 15;
    /// How much faster than the IMU's clock the lidar's runs, s/s.
    pub const LATENCY_RATE: usize = 16;
    /// `R_imu_base ← Exp(θ) R_imu_base`, rad, imu frame.
    pub const EXTRINSIC_ROTATION: Range<usize> = 17..20;
    /// Translation of `T_imu_base`, m, imu frame.
    pub const EXTRINSIC_TRANSLATION: Range<usize> = 20..23;
    /// By how much all ranges are too long, m.
    pub const RANGE_OFFSET: usize = 23;
    /// The same per `r tan θ`, rad.
    pub const RANGE_GRAZING: usize = 24;
    /// Gyro bias, rad/s.
    pub const GYRO_BIAS: Range<usize> = 25..28;
    /// Accelerometer bias, m/s².
    pub const ACCEL_BIAS: Range<usize> = 28..31;
    /// Rotation of gravity about the x and y axes of the map, rad.
    pub const GRAVITY: Range<usize> = 31..33;
    /// Share of its rate that is added to each axis of the gyro.
    pub const GYRO_SCALE: Range<usize> = 33..36;
    /// How axes of the gyro lean, rad: the pair across the main axis, and the main one to both.
    pub const GYRO_MISALIGNMENT: Range<usize> = 36..39;
    /// Row by row, rad/s per m/s².
    pub const G_SENSITIVITY: Range<usize> = 39..48;
    /// Share of its force that is added to each axis of the accelerometer.
    pub const ACCEL_SCALE: Range<usize> = 48..51;
    /// How axes of the accelerometer lean, rad: to y and z of x, x and z of y, x and y of z.
    pub const ACCEL_MISALIGNMENT: Range<usize> = 51..57;

    /// Those that a head with or without a motor has.
    pub fn used(has_motor: bool) -> Range<usize> {
        let first = if has_motor { MOTOR.start } else { MOTOR.end };
        first..super::N_GLOBALS
    }

    /// Those of them that place a surfel: rows of matches within a window concern no others.
    pub fn placing(has_motor: bool) -> Range<usize> {
        used(has_motor).start..INERTIAL.start
    }
}

/// Places of [`index::ACCEL_MISALIGNMENT`] in the matrix.
pub(crate) const OFF_DIAGONAL: [(usize, usize); 6] =
    [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)];

/// Values of the global states.
#[derive(Clone, Debug)]
pub struct Globals {
    /// Latency, extrinsics and motor.
    pub head: Head,
    /// How the IMU answers.
    pub unit: InertialUnit,
    /// m/s², map frame, pointing up.
    pub gravity: Vector3<f64>,
}

impl Globals {
    /// Applies a correction.
    pub fn correct(&mut self, delta: &GlobalVector) {
        let three = |r: Range<usize>| Vector3::from_column_slice(&delta[r]);
        let head = &mut self.head;
        head.clock.latency += delta[index::LATENCY];
        head.clock.rate += delta[index::LATENCY_RATE];
        head.ranges.offset += delta[index::RANGE_OFFSET];
        head.ranges.grazing += delta[index::RANGE_GRAZING];
        let base = &mut head.T_imu_base;
        base.rotation = so3::turned(&three(index::EXTRINSIC_ROTATION), &base.rotation);
        base.translation =
            Translation3::from(base.translation.vector + three(index::EXTRINSIC_TRANSLATION));
        correct_unit(&mut self.unit, delta);
        let [gx, gy] = [delta[index::GRAVITY.start], delta[index::GRAVITY.start + 1]];
        self.gravity = so3::exp(&Vector3::new(gx, gy, 0.0)) * self.gravity;
        if let Some(motor) = &mut head.motor {
            motor.zero += delta[index::ENCODER_ZERO];
            correct_motor_errors(&mut motor.errors, delta);
            let [u, v] = so3::orthogonal_pair(&motor.axis);
            let pair = |r: Range<usize>| u * delta[r.start] + v * delta[r.start + 1];
            let lidar = &mut motor.T_motor_lidar;
            lidar.rotation = so3::turned(&pair(index::MOTOR_TILT), &lidar.rotation);
            lidar.translation =
                Translation3::from(lidar.translation.vector + pair(index::MOTOR_OFFSET));
        }
    }

    /// The correction that leads from `earlier` to here.
    pub fn moved_from(&self, earlier: &Self) -> GlobalVector {
        let mut delta = [0.0; N_GLOBALS];
        let mut set = |place: Range<usize>, v: Vector3<f64>| {
            let n = place.len();
            delta[place].copy_from_slice(&v.as_slice()[..n]);
        };
        let turn = |a: UnitQuaternion<f64>, b: UnitQuaternion<f64>| so3::log(&(a * b.inverse()));
        let shift =
            |a: &Isometry3<f64>, b: &Isometry3<f64>| a.translation.vector - b.translation.vector;
        let (a, b) = (&self.head.T_imu_base, &earlier.head.T_imu_base);
        set(index::EXTRINSIC_ROTATION, turn(a.rotation, b.rotation));
        set(index::EXTRINSIC_TRANSLATION, shift(a, b));
        set(
            index::GRAVITY,
            turn_about_x_and_y(&earlier.gravity, &self.gravity),
        );
        unit_moved(&self.unit, &earlier.unit, &mut delta);
        let (now, then) = (&self.head.clock, &earlier.head.clock);
        delta[index::LATENCY] = now.latency - then.latency;
        delta[index::LATENCY_RATE] = now.rate - then.rate;
        let (now, then) = (&self.head.ranges, &earlier.head.ranges);
        delta[index::RANGE_OFFSET] = now.offset - then.offset;
        delta[index::RANGE_GRAZING] = now.grazing - then.grazing;
        if let (Some(now), Some(then)) = (&self.head.motor, &earlier.head.motor) {
            delta[index::ENCODER_ZERO] = now.zero - then.zero;
            motor_errors_moved(&now.errors, &then.errors, &mut delta);
            let (a, b) = (&now.T_motor_lidar, &then.T_motor_lidar);
            let (tilt, offset) = (turn(a.rotation, b.rotation), shift(a, b));
            for (k, u) in so3::orthogonal_pair(&now.axis).iter().enumerate() {
                delta[index::MOTOR_TILT.start + k] = u.dot(&tilt);
                delta[index::MOTOR_OFFSET.start + k] = u.dot(&offset);
            }
        }
        delta
    }
}

fn correct_motor_errors(errors: &mut MotorErrors, delta: &GlobalVector) {
    let of_turn = errors.eccentricity.iter_mut();
    let of_lean = errors.wobble.as_flattened_mut().iter_mut();
    let states = delta[index::ECCENTRICITY]
        .iter()
        .chain(&delta[index::WOBBLE]);
    for (to, d) in of_turn.chain(of_lean).zip(states) {
        *to += d;
    }
}

/// Writes the errors of a motor into the correction that leads from `earlier` to `now`.
fn motor_errors_moved(now: &MotorErrors, earlier: &MotorErrors, delta: &mut GlobalVector) {
    let flat = |e: &MotorErrors| {
        let wobble = e.wobble.as_flattened().iter();
        e.eccentricity
            .iter()
            .chain(wobble)
            .copied()
            .collect::<Vec<_>>()
    };
    let states = index::ECCENTRICITY.chain(index::WOBBLE);
    for ((g, a), b) in states.zip(flat(now)).zip(flat(earlier)) {
        delta[g] = a - b;
    }
}

fn correct_unit(unit: &mut InertialUnit, delta: &GlobalVector) {
    let three = |r: Range<usize>| Vector3::from_column_slice(&delta[r]);
    unit.gyro_bias += three(index::GYRO_BIAS);
    unit.accel_bias += three(index::ACCEL_BIAS);
    for axis in 0..3 {
        unit.gyro[(axis, axis)] += delta[index::GYRO_SCALE.start + axis];
        unit.accel[(axis, axis)] += delta[index::ACCEL_SCALE.start + axis];
    }
    unit.misalign(&three(index::GYRO_MISALIGNMENT));
    unit.g_sensitivity += Matrix3::from_row_slice(&delta[index::G_SENSITIVITY]);
    for (place, d) in OFF_DIAGONAL.iter().zip(&delta[index::ACCEL_MISALIGNMENT]) {
        unit.accel[*place] += d;
    }
}

/// Writes the states of the unit into the correction that leads from `earlier` to `unit`.
fn unit_moved(unit: &InertialUnit, earlier: &InertialUnit, delta: &mut GlobalVector) {
    let (gyro, accel) = (unit.gyro - earlier.gyro, unit.accel - earlier.accel);
    let forces = unit.g_sensitivity - earlier.g_sensitivity;
    let mut set = |place: Range<usize>, v: &[f64]| delta[place].copy_from_slice(v);
    set(
        index::GYRO_BIAS,
        (unit.gyro_bias - earlier.gyro_bias).as_slice(),
    );
    set(
        index::ACCEL_BIAS,
        (unit.accel_bias - earlier.accel_bias).as_slice(),
    );
    set(index::GYRO_SCALE, gyro.diagonal().as_slice());
    set(
        index::GYRO_MISALIGNMENT,
        &unit.misalignments().map(|p| gyro[p[0]]),
    );
    set(index::G_SENSITIVITY, forces.transpose().as_slice());
    set(index::ACCEL_SCALE, accel.diagonal().as_slice());
    set(index::ACCEL_MISALIGNMENT, &OFF_DIAGONAL.map(|p| accel[p]));
}

/// The rotation about x and y that turns the direction of `from` to that of `to`.
///
/// The shortest rotation turns a little about z as well; what it misses is turned again. Gravity is
/// within degrees of z, where that converges in a few steps.
fn turn_about_x_and_y(from: &Vector3<f64>, to: &Vector3<f64>) -> Vector3<f64> {
    let (from, to) = (from.normalize(), to.normalize());
    let mut found = Vector3::zeros();
    for _ in 0..20 {
        let turned = so3::exp(&found) * from;
        let step = turned.cross(&to);
        found += Vector3::new(step.x, step.y, 0.0);
    }
    found
}

/// What is known of the global states before a registration.
#[derive(Clone, Debug)]
pub struct GlobalPrior {
    /// Information matrix about its mean.
    pub information: GlobalMatrix,
    /// Correction that leads from the mean to the values the registration starts from.
    pub offset: GlobalVector,
    /// States that are not estimated at all.
    pub frozen: [bool; N_GLOBALS],
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraints::testing::Scene;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_way_back_is_the_correction(
            scene in Scene::any(), delta in prop::collection::vec(-0.3..0.3_f64, N_GLOBALS),
        ) {
            let delta: GlobalVector = delta.try_into().unwrap();
            let mut corrected = scene.globals.clone();
            corrected.correct(&delta);
            let found = corrected.moved_from(&scene.globals);
            for i in 0..N_GLOBALS {
                prop_assert!((found[i] - delta[i]).abs() < 1e-9, "state {i}");
            }
        }
    }
}
