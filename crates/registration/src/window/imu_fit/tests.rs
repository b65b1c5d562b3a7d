// SPDX-License-Identifier: MIT OR Apache-2.0

use super::*;
use crate::constraints::shown_noise::ShownNoise;
use crate::constraints::testing::settings;
use crate::{NormalEquations, RowGroup, Solver};
use bentwing_trajectory::{InertialUnit, extend_inertial, so3};
use nalgebra::{UnitQuaternion, Vector3};

const SECONDS: f64 = 5.0;
const RATE_HZ: f64 = 200.0;
const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, 9.81);
/// Of the gyro, rad/s, and of the accelerometer, m/s², per sample of the trajectory.
const NOISE: ImuNoise = ImuNoise {
    gyro: 5e-3,
    accel: 0.1,
};
/// Draws that are averaged: eight half-overlapping means each, in three axes.
const DRAWS: usize = 30;

struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal())
    }
}

/// A spinning IMU on a circle.
fn truth(t: f64) -> (Vector3<f64>, UnitQuaternion<f64>, Vector3<f64>) {
    let p = Vector3::new(2.0 * (1.3 * t).cos(), 2.0 * (1.3 * t).sin(), 0.0);
    (p, so3::exp(&(RATE * t)), -p * 1.3 * 1.3)
}

const RATE: Vector3<f64> = Vector3::new(0.1, 0.2, 1.5);

/// What is wrong with an IMU beyond its stated noise.
#[derive(Clone, Copy)]
struct Fault {
    /// Size of the noise of the gyro and the accelerometer over the stated one.
    noise: [f64; 2],
    /// Error of the rate that lasts, rad/s.
    lasting: f64,
    /// Stamps between which there are no samples.
    gap: [f64; 2],
}

const SOUND: Fault = Fault {
    noise: [1.0, 1.0],
    lasting: 0.0,
    gap: [9.0, 9.0],
};

fn samples(fault: &Fault, random: &mut Random) -> Imu {
    let all = (0..(RATE_HZ * (SECONDS + 0.2)) as usize).map(|k| k as f64 / RATE_HZ - 0.1012);
    let times: Vec<f64> = all
        .filter(|t| !(fault.gap[0]..fault.gap[1]).contains(t))
        .collect();
    let of_sample = (RATE_HZ * 0.01).sqrt();
    let mut noise = |sigma: f64, share: f64| random.vector() * (sigma * share * of_sample);
    let gyro = times
        .iter()
        .map(|_| RATE + RATE.normalize() * fault.lasting + noise(NOISE.gyro, fault.noise[0]))
        .collect();
    let accel = times.iter().map(|&t| {
        let (_, R, a) = truth(t);
        R.inverse() * (a + GRAVITY) + noise(NOISE.accel, fault.noise[1])
    });
    let accel = accel.collect();
    Imu::new(times, gyro, accel)
}

/// Registers poses that are measured every tenth of a second to the `deviation` (rad, m), and
/// compares the result with the IMU.
fn fit(fault: &Fault, deviation: [f64; 2], random: &mut Random) -> ImuFit {
    let imu = samples(fault, random);
    let (start, next) = (truth(0.0), truth(0.01));
    let mut trajectory =
        Trajectory::new(0.0, 0.01, vec![start.0, next.0], vec![start.1, next.1]).unwrap();
    let unit = InertialUnit::ideal();
    extend_inertial(&mut trajectory, &imu, &unit, &GRAVITY, SECONDS);
    let globals = Globals {
        head: bentwing_trajectory::Head {
            T_imu_base: nalgebra::Isometry3::identity(),
            clock: bentwing_trajectory::LidarClock::default(),
            motor: None,
            ranges: bentwing_trajectory::RangeBias::default(),
        },
        unit,
        gravity: GRAVITY,
    };
    let spline = CorrectionSpline::covering(0.0, trajectory.end(), settings().knot_interval);
    let mut equations = NormalEquations::new(spline.n_controls());
    imu::add(
        &mut equations,
        &trajectory,
        &imu,
        &globals,
        &spline,
        &NOISE,
        &ShownNoise::default(),
    );
    for n in (0..trajectory.len()).step_by(10) {
        let [turn, shift] = deviation;
        let (p, R, _) = truth(trajectory.time(n));
        let turned = so3::log(&(R * trajectory.rotations()[n].inverse())) + random.vector() * turn;
        let shifted = p - trajectory.positions()[n] + random.vector() * shift;
        let basis = spline.basis(trajectory.time(n));
        let mut group = RowGroup::new(basis.first..basis.first + 4);
        for (axis, d) in turned.iter().chain(&shifted).enumerate() {
            group.clear_row();
            for (k, w) in basis.weights.iter().enumerate() {
                group.knots_mut()[6 * k + axis] = *w;
            }
            group.add(-d, (if axis < 3 { turn } else { shift }).powi(-2));
        }
        group.flush(&mut equations);
    }
    let factorized = Solver::default()
        .factorize(&equations, 0, &[true; N_GLOBALS])
        .unwrap();
    let step = factorized.solve();
    let at = |n| spline.evaluate(&step.knots, 0.01 * n as f64);
    let corrections: Vec<_> = (0..trajectory.len()).map(at).collect();
    trajectory.correct(&corrections);
    let solved = Solved {
        trajectory: &trajectory,
        globals: &globals,
        spline: &spline,
        factorized: &factorized,
        ties: &[],
    };
    solved.imu_fit(&imu, &NOISE)
}

/// Root mean square and correlation over many draws, gyro and accelerometer.
fn averaged(fault: &Fault, deviation: [f64; 2]) -> [Fit; 2] {
    let mut random = Random(11);
    let draws: Vec<ImuFit> = (0..DRAWS)
        .map(|_| fit(fault, deviation, &mut random))
        .collect();
    let gyro: Vec<Fit> = draws.iter().filter_map(|d| d.gyro).collect();
    let accel: Vec<Fit> = draws.iter().filter_map(|d| d.accel).collect();
    [gyro, accel].map(|fits| {
        assert_eq!(fits.len(), DRAWS);
        let mean = |of: fn(&Fit) -> f64| fits.iter().map(of).sum::<f64>() / DRAWS as f64;
        Fit {
            rms: mean(|f| f.rms * f.rms).sqrt(),
            correlation: mean(|f| f.correlation),
        }
    })
}

/// Poses as exact as a lidar in a hall, and ten times worse.
const EXACT: [f64; 2] = [3e-4, 2e-3];
const VAGUE: [f64; 2] = [3e-3, 2e-2];
const USELESS: [f64; 2] = [1.0, 10.0];

#[test]
fn noise_as_stated_has_unit_size_and_no_correlation_however_much_the_lidar_knows() {
    for deviation in [EXACT, VAGUE] {
        for (sensor, fit) in averaged(&SOUND, deviation).iter().enumerate() {
            // Half of the 720 means are independent, and of the vague ones a fifth of each: a root mean
            // square of 72 is known to 8 %. The correlation of the 90 rows is known to 4 %.
            assert!(
                (fit.rms - 1.0).abs() < 0.15,
                "{sensor} {deviation:?} {fit:?}"
            );
            assert!(
                fit.correlation.abs() < 0.15,
                "{sensor} {deviation:?} {fit:?}"
            );
        }
    }
}

#[test]
fn noise_three_times_as_large_as_stated_shows_in_the_sensor_that_has_it() {
    let loud = |noise| averaged(&Fault { noise, ..SOUND }, EXACT);
    let [gyro, accel] = loud([3.0, 1.0]);
    assert!(gyro.rms > 2.5 && gyro.rms < 3.3, "{gyro:?}");
    assert!(accel.rms < 1.2, "{accel:?}");
    let [gyro, accel] = loud([1.0, 3.0]);
    assert!(accel.rms > 2.3 && accel.rms < 3.3, "{accel:?}");
    assert!(gyro.rms < 1.2, "{gyro:?}");
}

#[test]
fn an_error_that_lasts_is_large_and_correlated() {
    let lasting = 3.0 * NOISE.gyro;
    let [gyro, _] = averaged(&Fault { lasting, ..SOUND }, EXACT);
    // Means over a second see it √(2/3 · 100) times as well as samples do.
    assert!(gyro.rms > 5.0, "{gyro:?}");
    assert!(gyro.correlation > 0.5, "{gyro:?}");
}

#[test]
fn where_nothing_contradicts_the_imu_nothing_is_said() {
    let alone = fit(&SOUND, USELESS, &mut Random(3));
    assert_eq!(alone.gyro, None);
    assert_eq!(alone.accel, None);
}

#[test]
fn stretches_without_samples_are_left_out() {
    let mut random = Random(5);
    let gap = Fault {
        gap: [2.0, 2.6],
        ..SOUND
    };
    let some = fit(&gap, EXACT, &mut random);
    assert!(some.gyro.unwrap().rms < 2.0, "{some:?}");
    let all = Fault {
        gap: [-1.0, 9.0],
        ..SOUND
    };
    assert_eq!(fit(&all, EXACT, &mut random), ImuFit::default());
}
