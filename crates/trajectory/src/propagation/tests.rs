// SPDX-License-Identifier: MIT OR Apache-2.0

use super::*;
use nalgebra::{Matrix3, UnitQuaternion};

const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, 9.81);

/// A spinning IMU on a circular path: position, attitude and acceleration are analytic.
fn truth(t: f64) -> (Vector3<f64>, UnitQuaternion<f64>, Vector3<f64>) {
    let w = 1.3;
    let p = Vector3::new(2.0 * (w * t).cos(), 2.0 * (w * t).sin(), 0.0);
    (p, so3::exp(&(RATE * t)), -p * w * w)
}

const RATE: Vector3<f64> = Vector3::new(0.1, 0.0, 6.0);

/// What `unit` reads of the flight: the inverse of what it stands for.
fn read_by(unit: &InertialUnit) -> Imu {
    let times: Vec<f64> = (0..1300).map(|k| f64::from(k) * 0.005 - 0.0512).collect();
    let scaled = |m: Matrix3<f64>| (Matrix3::identity() + m).try_inverse().unwrap();
    let read = |t: f64| {
        let (_, R, a) = truth(t);
        let force = R.inverse() * (a + GRAVITY);
        let f = scaled(unit.accel) * (force + unit.accel_bias + unit.accel * unit.reference);
        let felt = RATE + unit.g_sensitivity * (f - unit.reference);
        (scaled(unit.gyro) * felt + unit.gyro_bias, f)
    };
    let (gyro, accel) = times.iter().map(|&t| read(t)).unzip();
    Imu::new(times, gyro, accel)
}

/// Position and attitude, m and rad, by which the samples of `read` lead off the path in 5 s, taken
/// as `taken` means them.
fn astray(read: &InertialUnit, taken: &InertialUnit) -> (f64, f64) {
    let imu = read_by(read);
    let (p0, p1) = (truth(0.0), truth(0.01));
    let mut trajectory = Trajectory::new(0.0, 0.01, vec![p0.0, p1.0], vec![p0.1, p1.1]).unwrap();
    let n_blind = extend_inertial(&mut trajectory, &imu, taken, &GRAVITY, 5.0);
    assert_eq!(n_blind, 0);
    assert!((trajectory.end() - 5.0).abs() < 1e-9);
    let shift = (trajectory.positions()[500] - truth(5.0).0).norm();
    (shift, trajectory.rotations()[500].angle_to(&truth(5.0).1))
}

fn biased() -> InertialUnit {
    InertialUnit {
        gyro_bias: Vector3::new(0.01, -0.02, 0.03),
        accel_bias: Vector3::new(0.1, 0.05, -0.07),
        ..InertialUnit::ideal()
    }
}

fn consumer() -> InertialUnit {
    InertialUnit {
        gyro: Matrix3::new(0.01, 0.006, 0.0, 0.006, -0.008, 0.0, 0.004, -0.007, 0.012),
        g_sensitivity: Matrix3::new(1.0, -2.0, 0.5, 0.7, 1.5, -1.0, 2.0, 0.3, -0.4) * 1e-4,
        accel: Matrix3::new(
            0.01, 0.003, -0.004, 0.005, 0.007, 0.006, -0.002, 0.008, -0.009,
        ),
        reference: Vector3::new(0.3, -0.2, 9.7),
        ..biased()
    }
}

/// What remains is the linear interpolation of the force.
const EXACT: (f64, f64) = (5e-3, 2e-6);

#[test]
fn noiseless_samples_reproduce_a_circular_flight_whatever_the_unit_is_like() {
    for unit in [InertialUnit::ideal(), biased(), consumer()] {
        let (shift, turn) = astray(&unit, &unit);
        assert!(shift < EXACT.0 && turn < EXACT.1, "{shift} m, {turn} rad");
    }
}

#[test]
fn each_error_of_a_unit_leads_astray_where_it_is_not_known() {
    let unit = consumer();
    let without = [
        InertialUnit {
            gyro: Matrix3::zeros(),
            ..unit.clone()
        },
        InertialUnit {
            g_sensitivity: Matrix3::zeros(),
            ..unit.clone()
        },
        InertialUnit {
            accel: Matrix3::zeros(),
            ..unit.clone()
        },
    ];
    for taken in &without {
        let (shift, turn) = astray(&unit, taken);
        assert!(
            shift > 10.0 * EXACT.0 || turn > 10.0 * EXACT.1,
            "{shift} m, {turn} rad"
        );
    }
}

#[test]
fn a_steady_turn_about_the_main_axis_is_felt_by_that_axis_alone() {
    for main_axis in 0..3 {
        let mut unit = InertialUnit {
            main_axis,
            ..InertialUnit::ideal()
        };
        unit.misalign(&Vector3::new(0.1, 0.2, 0.3));
        let mut spin = Vector3::zeros();
        spin[main_axis] = 6.0;
        assert_eq!(unit.gyro * spin, Vector3::zeros());
        assert!(
            (unit.gyro - Matrix3::zeros())
                .iter()
                .filter(|v| **v != 0.0)
                .count()
                == 4
        );
    }
}
