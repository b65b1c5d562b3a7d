// SPDX-License-Identifier: MIT OR Apache-2.0
//! Registration of a window, its parts, and the crossover of dense and sparse solution.
#![allow(missing_docs, reason = "criterion's macros make public items")]

use bentwing_benches::{Scanner, one_thread, prior};
use bentwing_registration::{FixedView, Initial, Problem, Settings, Solver, register_window};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};

const WINDOW: f64 = 5.0; // s

/// One outer iteration with one solution and with three, whose difference is what two accumulations
/// of the normal equations with their solutions cost; and everything until it converges.
fn window(c: &mut Criterion) {
    let pool = one_thread();
    let mut group = c.benchmark_group("registration");
    group.sample_size(10);
    for (name, scanner) in [("hokuyo_5s", Scanner::Hokuyo), ("vlp16_5s", Scanner::Vlp16)] {
        let flight = scanner.fly(WINDOW);
        let sets = flight.surfels();
        let first: Vec<_> = sets[..2].iter().map(AsRef::as_ref).collect();
        let view = FixedView::freeze(&first, 0.0, 1.5, &flight.trajectory, &[], &flight.globals);
        let defaults = flight.settings();
        let iterations = |max_outer, n_inner| Settings {
            max_outer,
            n_inner,
            ..defaults.clone()
        };
        for (part, settings) in [
            ("1x1", iterations(1, 1)),
            ("1x3", iterations(1, 3)),
            ("whole", defaults.clone()),
        ] {
            let prior = prior();
            group.bench_function(format!("{name}/{part}"), |b| {
                b.iter(|| {
                    let problem = Problem {
                        trajectory: flight.trajectory.clone(),
                        responses: &[],
                        sets: &sets,
                        views: &[&view],
                        imu: Some(&flight.imu),
                        globals: flight.globals.clone(),
                        prior: &prior,
                        initial: Initial::Joined,
                    };
                    pool.install(|| register_window(&problem, &settings))
                        .is_ok()
                });
            });
        }
    }
    group.finish();
}

/// Factorization and solution by the number of unknowns; above the crossover sparse wins.
fn solution(c: &mut Criterion) {
    let mut group = c.benchmark_group("solve");
    group.sample_size(10);
    let frozen = prior().frozen;
    for seconds in [5.0, 10.0, 20.0, 40.0] {
        let equations = Scanner::Hokuyo.fly(seconds).equations();
        let n_free = frozen.iter().filter(|f| !**f).count();
        let n_unknowns = 6 * (equations.n_controls() - 3) + n_free;
        for (name, limit) in [("dense", usize::MAX), ("sparse", 0)] {
            let mut solver = Solver::default();
            solver.dense_limit = Some(limit);
            group.bench_function(BenchmarkId::new(name, n_unknowns), |b| {
                b.iter(|| {
                    solver
                        .factorize(&equations, 3, &frozen)
                        .map(|f| f.solve())
                        .is_ok()
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, window, solution);
criterion_main!(benches);
