// SPDX-License-Identifier: MIT OR Apache-2.0
//! Search of the surfels of a window among themselves, level by level.
#![allow(missing_docs, reason = "criterion's macros make public items")]

use bentwing_benches::{Features, Scanner};
use bentwing_registration::neighbors::{Grid, mutual_pairs};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};

fn search(c: &mut Criterion) {
    let pool = bentwing_benches::one_thread();
    let mut group = c.benchmark_group("neighbors");
    for (name, scanner) in [("hokuyo_5s", Scanner::Hokuyo), ("vlp16_5s", Scanner::Vlp16)] {
        let flight = scanner.fly(5.0);
        let search = flight.settings().search();
        for level in [0, 2] {
            let features = Features::of(&flight, level);
            let Features {
                positions,
                normals,
                times,
            } = &features;
            let build = || Grid::new(positions, normals, times, 1.0);
            let grid = build();
            group.throughput(Throughput::Elements(grid.len() as u64));
            group.bench_function(format!("{name}/level_{level}/build"), |b| {
                b.iter_batched(|| (), |()| build(), BatchSize::SmallInput);
            });
            group.bench_function(format!("{name}/level_{level}/mutual"), |b| {
                b.iter(|| {
                    let nearest = pool.install(|| grid.nearest(&grid, &search));
                    mutual_pairs(&nearest, search.k).count()
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, search);
criterion_main!(benches);
