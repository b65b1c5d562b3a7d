// SPDX-License-Identifier: MIT OR Apache-2.0
//! Our side of `kernels.py`: writes the data of every case into a folder and names the cases; then
//! runs the one that is asked for, line by line, and answers with its time in seconds.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, BufRead, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use bentwing_benches::{Features, Flight, Scanner, chain, defaults, npy, one_thread, prior};
use bentwing_registration::neighbors::Grid;
use bentwing_registration::{NormalEquations, Solver, System};
use bentwing_surfels::{Points, extract, place_points};

/// Names of the cases, and the work of each.
type Cases = BTreeMap<String, Box<dyn FnMut() + Send>>;

type Failure = Box<dyn std::error::Error + Send + Sync>;

fn main() -> Result<(), Failure> {
    let folder = std::env::args()
        .nth(1)
        .ok_or("expected a folder for the data")?;
    let pool = one_thread();
    let mut cases = pool.install(|| prepare(Path::new(&folder)))?;
    let mut answers = io::stdout().lock();
    let names: Vec<&str> = cases.keys().map(String::as_str).collect();
    writeln!(answers, "{}", names.join(" "))?;
    for name in io::stdin().lock().lines() {
        let work = cases.get_mut(&name?).ok_or("no such case")?;
        let seconds = pool.install(|| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        });
        writeln!(answers, "{seconds}")?;
        answers.flush()?;
    }
    Ok(())
}

fn prepare(folder: &Path) -> Result<Cases, Failure> {
    let mut cases = Cases::new();
    for (name, scanner) in [("hokuyo", Scanner::Hokuyo), ("vlp16", Scanner::Vlp16)] {
        let flight = scanner.fly(5.0);
        neighbors(
            &mut cases,
            folder,
            &format!("{name}_5s"),
            Features::of(&flight, 0),
        )?;
        surfels(&mut cases, folder, &format!("{name}_5s"), flight)?;
    }
    // So long a stay in one place that every patch is seen many times.
    let stay = Features::of(&Scanner::Hokuyo.fly(25.0), 0);
    for (name, n) in [("20k", 20_000), ("200k", 200_000)] {
        neighbors(&mut cases, folder, name, stay.repeated(n))?;
    }
    for seconds in [5.0, 10.0, 20.0, 30.0, 40.0] {
        solve(
            &mut cases,
            folder,
            "window",
            Scanner::Hokuyo.fly(seconds).equations(),
        )?;
    }
    for n_controls in [1000, 5000] {
        solve(&mut cases, folder, "trajectory", chain(n_controls, 0.05))?;
    }
    Ok(cases)
}

/// A folder of its own for the data of a case.
fn folder_of(folder: &Path, case: &str) -> io::Result<std::path::PathBuf> {
    let path = folder.join(case);
    fs::create_dir_all(&path)?;
    Ok(path)
}

/// Features, their times, and the lists that our search finds.
fn neighbors(
    cases: &mut Cases,
    folder: &Path,
    name: &str,
    features: Features,
) -> Result<(), Failure> {
    let case = format!("neighbors/{name}");
    let folder = folder_of(folder, &case)?;
    npy::write(&folder.join("features.npy"), &features.rows(), 6)?;
    npy::write(&folder.join("times.npy"), &features.times, 0)?;
    // Of the settings only the noise, which the search does not know, depends on the scanner.
    let search = defaults::registration(0.0).search();
    let k = search.k;
    let find = move || {
        let Features {
            positions,
            normals,
            times,
        } = &features;
        let grid = Grid::new(positions, normals, times, 1.0);
        grid.nearest(&grid, &search)
    };
    let found = find();
    let mut lists = vec![u32::MAX; found.len() * k];
    for (i, list) in lists.chunks_exact_mut(k).enumerate() {
        list[..found.of(i).len()].copy_from_slice(found.of(i));
    }
    npy::write(&folder.join("found.npy"), &lists, k)?;
    cases.insert(case, Box::new(move || drop(find())));
    Ok(())
}

/// Points as they are placed in the map.
fn surfels(cases: &mut Cases, folder: &Path, name: &str, flight: Flight) -> Result<(), Failure> {
    let case = format!("surfels/{name}");
    let folder = folder_of(folder, &case)?;
    let (trajectory, head) = (&flight.trajectory, &flight.globals.head);
    let placed = place_points(&flight.points, &flight.stamps, &[], trajectory, head);
    npy::write(&folder.join("points.npy"), placed.as_flattened(), 3)?;
    let settings = defaults::surfels(flight.settings().range_sigma);
    let work = move || {
        let points = Points {
            points: &flight.points,
            stamps: &flight.stamps,
            angles: &[],
        };
        drop(extract(
            points,
            &flight.trajectory,
            &flight.globals.head,
            &settings,
        ));
    };
    cases.insert(case, Box::new(work));
    Ok(())
}

/// A system, its solution, and the time without and with the analysis of its structure.
fn solve(
    cases: &mut Cases,
    folder: &Path,
    name: &str,
    equations: NormalEquations,
) -> Result<(), Failure> {
    const CLAMPED: usize = 3;
    let frozen = prior().frozen;
    let system = System::new(&equations, CLAMPED, &frozen)?;
    let case = format!("solve/{name}_{}", system.right.len());
    let folder = folder_of(folder, &case)?;
    let index = |values: &[usize]| values.iter().map(|&v| v as i32).collect::<Vec<_>>();
    npy::write(&folder.join("starts.npy"), &index(&system.column_starts), 0)?;
    npy::write(&folder.join("rows.npy"), &index(&system.rows), 0)?;
    npy::write(&folder.join("values.npy"), &system.values, 0)?;
    npy::write(&folder.join("right.npy"), &system.right, 0)?;
    let equations = Arc::new(equations);
    let step = move |solver: &mut Solver| {
        let factorized = solver.factorize(&equations, CLAMPED, &frozen);
        factorized.map(|f| f.solve())
    };
    let solution = step(&mut Solver::default())?;
    let knots = solution.knots[CLAMPED..].as_flattened().iter();
    let globals = solution.globals.iter().zip(frozen).filter(|(_, f)| !f);
    let x: Vec<f64> = knots.chain(globals.map(|(g, _)| g)).copied().collect();
    npy::write(&folder.join("solution.npy"), &x, 0)?;
    for (kind, limit) in [
        ("", None),
        ("/dense", Some(usize::MAX)),
        ("/sparse", Some(0)),
    ] {
        if limit == Some(usize::MAX) && x.len() > 4000 {
            continue;
        }
        let mut kept = Solver::default();
        kept.dense_limit = limit;
        let again = step.clone();
        let work = move || drop(again(&mut kept));
        cases.insert(format!("{case}{kind}"), Box::new(work));
    }
    let work = move || drop(step(&mut Solver::default()));
    cases.insert(format!("{case}/anew"), Box::new(work));
    Ok(())
}
