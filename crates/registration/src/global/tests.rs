// SPDX-License-Identifier: MIT OR Apache-2.0
//! A room seen again and again along a trajectory that has drifted: the truth is exact.

use std::f64::consts::TAU;
use std::sync::Arc;

use bentwing_surfels::SurfelSet;
use bentwing_trajectory::{Head, InertialUnit, LidarClock, RangeBias, Sight, Trajectory, so3};
use nalgebra::{DMatrix, Isometry3, Matrix3, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::*;
use crate::constraints::shown_noise::ShownNoise;
use crate::constraints::testing::{Scene, settings};
use crate::placed::place;
use crate::{GlobalMatrix, GlobalPrior, Globals, index};

/// Seconds of a lap, and what the room measures, m.
const LAP: f64 = 20.0;
const ROOM: [f64; 3] = [9.0, 7.0, 3.0];

/// Position and rotation at `t` of a flight in laps with a spinning head.
fn pose(t: f64) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let (s, c) = (TAU * t / LAP).sin_cos();
    let p = Vector3::new(4.5 + 2.0 * c, 3.5 + 1.5 * s, 1.5 + 0.4 * (0.9 * t).sin());
    (
        p,
        so3::exp(&(Vector3::z() * 3.0 * t)) * so3::exp(&(Vector3::x() * 0.2 * s)),
    )
}

fn trajectory(from: f64, to: f64, drift: impl Fn(f64) -> Vector3<f64>) -> Trajectory {
    let n = ((to - from) / 0.01).round() as u32;
    let sample = |i: u32| {
        let t = from + 0.01 * f64::from(i);
        let (p, R) = pose(t);
        let d = drift(t - from);
        (p + d, so3::exp(&(Vector3::new(0.02, -0.05, 0.3) * d.x)) * R)
    };
    let (positions, rotations) = (0..=n).map(sample).unzip();
    Trajectory::new(from, 0.01, positions, rotations).unwrap()
}

/// Patches of the walls seen between two times, from the true poses.
fn chunk(from: f64, to: f64, head: &Head) -> Arc<SurfelSet> {
    let mut set = SurfelSet {
        voxel_sizes: vec![0.8],
        level_starts: vec![0],
        ..SurfelSet::default()
    };
    let n = ((to - from) * 240.0) as u32;
    let mut seed = (from * 1e3) as u32 + 17;
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / f64::from(1u32 << 24)
    };
    for i in 0..n {
        let t = from + (to - from) * (f64::from(i) + 0.5) / f64::from(n);
        let (axis, side) = (
            (random() * 3.0) as usize,
            f64::from(u8::from(random() > 0.5)),
        );
        let mut point = Vector3::from_fn(|k, _| random() * ROOM[k]);
        point[axis] = side * ROOM[axis];
        let mut normal = Vector3::zeros();
        normal[axis] = 1.0 - 2.0 * side;
        let (p, R) = pose(t);
        let (R_imu_lidar, t_imu_lidar) = head.lidar_in_imu(0.0);
        let R_lidar_map = (R.to_rotation_matrix().into_inner() * R_imu_lidar).transpose();
        let flat = Matrix3::from_diagonal(&Vector3::from_element(0.02))
            - normal * normal.transpose() * 0.02;
        let mean = R_lidar_map * (point - p - R * t_imu_lidar);
        let sight = Sight::of(&mean, &(R_lidar_map * normal));
        set.means.push(mean + sight.ray * head.ranges.error(&sight));
        set.covariances
            .push(R_lidar_map * flat * R_lidar_map.transpose());
        set.normals.push(R_lidar_map * normal);
        set.stamps.push(t + head.clock.latency);
        set.angles.push(0.0);
        set.n_points.push(20);
    }
    set.level_starts.push(set.len());
    Arc::new(set)
}

fn globals() -> Globals {
    Globals {
        head: Head {
            T_imu_base: Isometry3::new(Vector3::new(0.05, 0.0, -0.1), Vector3::new(0.0, 1.5, 0.1)),
            clock: LidarClock::late_by(0.002),
            motor: None,
            ranges: RangeBias::default(),
        },
        unit: InertialUnit::ideal(),
        gravity: Vector3::z() * 9.8,
    }
}

fn prior() -> GlobalPrior {
    GlobalPrior {
        information: GlobalMatrix::identity() * 1e4,
        offset: [0.0; N_GLOBALS],
        frozen: [true; N_GLOBALS],
    }
}

/// A piece without an IMU, of which all free states are asked.
fn lidar_alone<'a>(
    trajectory: Trajectory,
    chunks: &'a [Arc<SurfelSet>],
    globals: Globals,
    prior: &'a GlobalPrior,
) -> Piece<'a> {
    Piece {
        trajectory,
        chunks,
        imu: None,
        shown_noise: ShownNoise::default(),
        globals,
        prior,
        optional: [false; N_GLOBALS],
        doubted: [false; N_GLOBALS],
    }
}

fn plan() -> Plan {
    Plan {
        n_visits: 4,
        min_overlap: 0.15,
        n_held: 64,
        posterior_interval: 0.5,
    }
}

fn of_global() -> Settings {
    Settings {
        knot_interval: 1.0,
        n_inner: 1,
        max_outer: 12,
        max_match_distance: 0.6,
        min_translation: 2e-4,
        min_rotation: 1e-4,
        motion_accel_density: 1.5,
        ..settings()
    }
}

/// Stretches of five seconds.
fn chunks(from: f64, to: f64, head: &Head) -> Vec<Arc<SurfelSet>> {
    let n = ((to - from) / 5.0).round() as u32;
    let at = |i: u32| from + 5.0 * f64::from(i);
    (0..n).map(|i| chunk(at(i), at(i + 1), head)).collect()
}

fn worst(found: &Trajectory, truth: &Trajectory) -> f64 {
    let pairs = found.positions().iter().zip(truth.positions());
    pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// Grows to 12 cm, with a turn, and comes back half the way.
fn slow_drift(t: f64) -> Vector3<f64> {
    Vector3::new(0.06, -0.1, 0.02) * (0.5 - 0.5 * (0.045 * t).cos())
}

#[test]
fn a_slow_drift_is_taken_out_of_laps_through_a_room() -> Result<(), SolveError> {
    let (globals, prior) = (globals(), prior());
    let (truth, drifted) = (
        trajectory(0.0, 60.0, |_| Vector3::zeros()),
        trajectory(0.0, 60.0, slow_drift),
    );
    let chunks = chunks(0.0, 60.0, &globals.head);
    let piece = lidar_alone(drifted.clone(), &chunks, globals, &prior);
    let problem = GlobalProblem {
        pieces: vec![piece],
        plan: plan(),
    };
    let found = register_globally(&problem, &of_global())?;
    assert!(worst(&drifted, &truth) > 0.08);
    let left = worst(&found.pieces[0].trajectory, &truth);
    assert!(left < 2e-3, "{left} m are left of the drift");
    assert!(found.converged, "{:?}", found.iterations);
    assert!(found.iterations[1].n_far > 1000);
    let stds = |at: &[f64]| -> Vec<f64> {
        let variances = found.posterior.at(0, at);
        variances.iter().map(|c| c[(3, 3)].sqrt()).collect()
    };
    let times: Vec<f64> = (0..12).map(|k| 5.0 * f64::from(k)).collect();
    let together = stds(&times);
    // The first pose is held to 0.1 mm; what is known of others does not depend on the company.
    assert!(together[0] < 1.01e-4, "{together:?}");
    assert!(
        together[1..].iter().all(|s| (1e-4..0.02).contains(s)),
        "{together:?}"
    );
    assert!((stds(&times[9..10])[0] / together[9] - 1.0).abs() < 1e-9);
    // As seen from the first pose, which is held, a pose is as certain as it is.
    let [first, last] = [times[0], times[9]];
    let piece = &found.pieces[0].trajectory;
    let since = found
        .posterior
        .since(0, piece, &[[first, last], [last, last]]);
    assert!(
        (since[0][(3, 3)].sqrt() / together[9] - 1.0).abs() < 0.05,
        "{since:?}"
    );
    assert!(since[1].norm() < 1e-12, "{since:?}");
    Ok(())
}

#[test]
fn a_second_piece_with_its_own_latency_joins_the_first() -> Result<(), SolveError> {
    let (first, mut second) = (globals(), globals());
    let mut prior_of_second = prior();
    prior_of_second.frozen[index::LATENCY] = false;
    let (a, b) = (
        chunks(0.0, 20.0, &first.head),
        chunks(40.0, 60.0, &second.head),
    );
    // What the registration is told is wrong by four milliseconds.
    second.head.clock.latency -= 0.004;
    let shifted = trajectory(40.0, 60.0, |_| Vector3::new(0.08, -0.05, 0.03));
    let (held, prior_of_first) = (trajectory(0.0, 20.0, |_| Vector3::zeros()), prior());
    let problem = GlobalProblem {
        pieces: vec![
            lidar_alone(held, &a, first, &prior_of_first),
            lidar_alone(shifted, &b, second, &prior_of_second),
        ],
        plan: plan(),
    };
    let found = register_globally(&problem, &of_global())?;
    let latency = found.pieces[1].globals.head.clock.latency;
    assert!((latency - 0.002).abs() < 2e-4, "latency {latency} s");
    let left = worst(
        &found.pieces[1].trajectory,
        &trajectory(40.0, 60.0, |_| Vector3::zeros()),
    );
    assert!(left < 2e-3, "{left} m between the pieces");
    let of_latency = (index::LATENCY, index::LATENCY);
    assert!(found.pieces[1].covariance[of_latency] > 0.0);
    assert!(found.pieces[0].covariance[of_latency] == 0.0);
    Ok(())
}

/// What a flight of 40 s finds if its ranges are wrong by `truth`, with optional states or without.
fn flown(truth: RangeBias, is_asked: bool) -> Result<GlobalRegistration, SolveError> {
    let globals = globals();
    let seen = Head {
        ranges: truth,
        ..globals.head
    };
    let chunks = chunks(0.0, 40.0, &seen);
    let mut prior = prior();
    let mut optional = [false; N_GLOBALS];
    for (g, std) in [(index::RANGE_OFFSET, 0.02), (index::RANGE_GRAZING, 7e-4)] {
        prior.information[(g, g)] = f64::powi(std, -2);
        prior.frozen[g] = !is_asked;
        optional[g] = is_asked;
    }
    let problem = GlobalProblem {
        pieces: vec![Piece {
            optional,
            ..lidar_alone(trajectory(0.0, 40.0, slow_drift), &chunks, globals, &prior)
        }],
        plan: plan(),
    };
    register_globally(&problem, &of_global())
}

#[test]
fn ranges_that_are_too_long_show_and_are_taken_back() -> Result<(), SolveError> {
    let truth = RangeBias {
        offset: 0.025,
        grazing: 1.5e-3,
    };
    let exact = trajectory(0.0, 40.0, |_| Vector3::zeros());
    let blind = worst(&flown(truth, false)?.pieces[0].trajectory, &exact);
    let found = flown(truth, true)?;
    let piece = &found.pieces[0];
    let ranges = piece.globals.head.ranges;
    assert!(found.converged);
    assert!((ranges.offset - truth.offset).abs() < 1e-3, "{ranges:?}");
    assert!((ranges.grazing - truth.grazing).abs() < 2e-4, "{ranges:?}");
    let left = worst(&piece.trajectory, &exact);
    assert!(left < 0.3 * blind, "{left} m instead of {blind} m");
    let variance = piece.covariance[(index::RANGE_OFFSET, index::RANGE_OFFSET)];
    assert!((1e-8..4e-6).contains(&variance), "{variance}");
    Ok(())
}

#[test]
fn states_that_do_not_show_change_no_bit() -> Result<(), SolveError> {
    let asked = flown(RangeBias::default(), true)?;
    let unasked = flown(RangeBias::default(), false)?;
    let [a, b] = [&asked, &unasked].map(|f| &f.pieces[0]);
    assert_eq!(a.trajectory.positions(), b.trajectory.positions());
    assert_eq!(a.globals.head.ranges, RangeBias::default());
    assert_eq!(a.covariance, b.covariance);
    assert_eq!(asked.iterations.len(), unasked.iterations.len());
    Ok(())
}

#[test]
fn states_that_are_doubted_stay_as_they_are_and_make_others_no_more_certain()
-> Result<(), SolveError> {
    let globals = globals();
    let chunks = chunks(0.0, 40.0, &globals.head);
    let (offset, grazing) = (index::RANGE_OFFSET, index::RANGE_GRAZING);
    let mut prior = prior();
    prior.frozen[offset] = false;
    for (g, std) in [(offset, 0.02), (grazing, 7e-4)] {
        prior.information[(g, g)] = f64::powi(std, -2);
    }
    let run = |is_doubted: bool| {
        let mut doubted = [false; N_GLOBALS];
        doubted[grazing] = is_doubted;
        let problem = GlobalProblem {
            pieces: vec![Piece {
                doubted,
                ..lidar_alone(
                    trajectory(0.0, 40.0, slow_drift),
                    &chunks,
                    globals.clone(),
                    &prior,
                )
            }],
            plan: plan(),
        };
        register_globally(&problem, &of_global())
    };
    let (known, doubted) = (run(false)?, run(true)?);
    let [a, b] = [&known, &doubted].map(|f| &f.pieces[0]);
    assert_eq!(a.trajectory.positions(), b.trajectory.positions());
    assert_eq!(a.globals.head.ranges, b.globals.head.ranges);
    let std = |piece: &PieceResult, g: usize| piece.covariance[(g, g)].sqrt();
    let (before, after) = (std(a, offset), std(b, offset));
    assert!(after > 1.1 * before, "{after} m after {before} m");
    assert_eq!(std(a, grazing), 0.0);
    // More certain than before, as the walls show it.
    assert!(
        (1e-6..6e-4).contains(&std(b, grazing)),
        "{}",
        std(b, grazing)
    );
    Ok(())
}

#[test]
fn neither_threads_nor_what_is_held_change_a_bit() -> Result<(), SolveError> {
    let (globals, prior) = (globals(), prior());
    let chunks = chunks(0.0, 40.0, &globals.head);
    let run = |threads: usize, n_held: usize| {
        let piece = lidar_alone(
            trajectory(0.0, 40.0, slow_drift),
            &chunks,
            globals.clone(),
            &prior,
        );
        let problem = GlobalProblem {
            pieces: vec![piece],
            plan: Plan { n_held, ..plan() },
        };
        let settings = Settings {
            max_outer: 3,
            ..of_global()
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap()
            .install(|| register_globally(&problem, &settings))
    };
    let bits = |found: &GlobalRegistration| -> Vec<[u64; 3]> {
        let positions = found.pieces[0].trajectory.positions().iter();
        positions
            .map(|p| [p.x, p.y, p.z].map(f64::to_bits))
            .collect()
    };
    let one = bits(&run(1, 64)?);
    assert!(one == bits(&run(2, 64)?));
    assert!(one == bits(&run(4, 3)?));
    Ok(())
}

#[test]
fn a_stretch_is_matched_with_few_others_however_often_it_is_seen() {
    let (globals, prior) = (globals(), prior());
    let chunks = chunks(0.0, 60.0, &globals.head);
    let piece = lidar_alone(
        trajectory(0.0, 60.0, |_| Vector3::zeros()),
        &chunks,
        globals,
        &prior,
    );
    let plan = Plan {
        n_visits: 2,
        ..plan()
    };
    let problem = GlobalProblem {
        pieces: vec![piece],
        plan,
    };
    let states = [problem.pieces[0].state(&of_global())];
    let counts = Gatherer::new(&problem, &states, &of_global()).counts();
    // Twelve stretches; all of them see the whole room.
    assert!(counts.n_far_links >= 12, "{counts:?}");
    assert!(counts.n_far_links <= 2 * 12, "{counts:?}");
    assert_eq!(counts.n_links - counts.n_far_links, 12 + 11);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// The row of a match between two pieces, or of one with itself, as it stands in the whole system.
    #[test]
    fn rows_between_pieces_agree_with_central_differences(
        one in Scene::any(), two in Scene::any(), same in any::<bool>(), j in 0..8_usize,
    ) {
        let set = Scene::surfels();
        let mut known = prior();
        known.frozen = [false; N_GLOBALS];
        let chunks = [Arc::new(set.clone())];
        let piece = |scene: &Scene| lidar_alone(scene.trajectory.clone(), &chunks, scene.globals.clone(), &known);
        let pieces = [piece(&one), piece(&two)];
        let states: Vec<State<'_>> =
            pieces.iter().map(|p| p.state(&settings())).collect();
        let joint = Joint::new(&states);
        let other = usize::from(!same);
        let at = |p: usize| chunk::Chunk { piece: p, surfels: chunks[0].clone() };
        let laid = [chunk::Laid::new(&at(0), &states, Some(&settings())), chunk::Laid::new(&at(other), &states, Some(&settings()))];
        let found = link::LinkMatch::between(&laid[0], 2, &laid[1], j, 0.01);
        let link = link::Link {
            a: 0, b: 1, pieces: [0, other], is_near: false, matches: vec![found],
        };
        let (n, information, offset) = found.plane_at(&laid[0]);
        let apart = laid[0].placed.surfels[2].mean - laid[1].placed.surfels[j].mean;
        let residual = n.dot(&apart) + offset;
        prop_assume!(residual.abs() > 1e-3);
        let part = gather::equations_of(link::LinkSum {
            link: &link, matches: &link.matches, laid: [&laid[0], &laid[1]], states: &states,
            joint: &joint, scale: 1e12, judged: false,
        });
        let mut equations = NormalEquations::new(joint.n_controls());
        joint.add(&mut equations, &part.equations, &part.controls, 0);
        let row = |u: usize| equations.knot_gradient(u / 6)[u % 6] / (information * residual);
        let along = |u: usize, size: f64| {
            let mean = |p: usize, i: usize| {
                let state = &states[p];
                let mut controls = vec![[0.0; 6]; state.spline.n_controls()];
                let mut delta = [0.0; N_GLOBALS];
                let k = (u / 6).checked_sub(joint.control(p, 0)).filter(|&k| k < controls.len());
                if let Some(k) = k.filter(|_| u / 6 < joint.stand_in(0)) {
                    controls[k][u % 6] = size;
                }
                if let Some(g) = u.checked_sub(6 * joint.stand_in(p)).filter(|&g| g < N_GLOBALS) {
                    delta[g] = size;
                }
                let mut globals = state.globals.clone();
                globals.correct(&delta);
                let moved = place(&set, i, &state.trajectory, &globals);
                let d = state.spline.evaluate(&controls, moved.time);
                let turn = so3::exp(&Vector3::new(d[0], d[1], d[2]));
                moved.mean - moved.lever + turn * moved.lever + Vector3::new(d[3], d[4], d[5])
            };
            n.dot(&(mean(0, 2) - mean(other, j)))
        };
        let n_unknowns = 6 * joint.n_controls();
        let analytic = DMatrix::from_fn(n_unknowns, 1, |u, _| row(u));
        let step = 1e-4;
        let numeric = DMatrix::from_fn(n_unknowns, 1, |u, _| (along(u, step) - along(u, -step)) / (2.0 * step));
        let scale = numeric.amax().max(1.0);
        for u in 0..n_unknowns {
            let (a, b) = (analytic[u], numeric[u]);
            prop_assert!((a - b).abs() < 1e-5 * scale, "unknown {u}: {a} against {b}");
        }
    }
}
