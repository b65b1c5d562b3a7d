// SPDX-License-Identifier: MIT OR Apache-2.0
//! Extraction of the surfels of one second.
#![allow(missing_docs, reason = "criterion's macros make public items")]

use bentwing_benches::{Scanner, defaults};
use bentwing_surfels::{Points, extract};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn extraction(c: &mut Criterion) {
    let pool = bentwing_benches::one_thread();
    let mut group = c.benchmark_group("surfels");
    for (name, scanner) in [("hokuyo_1s", Scanner::Hokuyo), ("vlp16_1s", Scanner::Vlp16)] {
        let flight = scanner.fly(1.0);
        let settings = defaults::surfels(scanner.sigma());
        group.throughput(Throughput::Elements(flight.points.len() as u64));
        group.bench_function(name, |b| {
            b.iter(|| {
                let points = Points {
                    points: &flight.points,
                    stamps: &flight.stamps,
                    angles: &[],
                };
                pool.install(|| {
                    extract(points, &flight.trajectory, &flight.globals.head, &settings)
                })
            });
        });
    }
    group.finish();
}

criterion_group!(benches, extraction);
criterion_main!(benches);
