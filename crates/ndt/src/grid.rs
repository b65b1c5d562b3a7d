// SPDX-License-Identifier: MIT OR Apache-2.0
//! One level of voxels.

use bentwing_surfels::Moments;
use bentwing_surfels::voxel::key;
use nalgebra::Vector3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::gaussian::{Gaussian, Shape};

/// Cells per parallel task; fixed, so that results do not depend on the number of threads.
const CHUNK: usize = 512;
/// After so many points a cell begins anew, keeping these until as many have come again: what it
/// says stays recent, and a crowded place does not outweigh what is seen there now.
const GENERATION: u32 = 400;

/// What was seen in one voxel for some time.
#[derive(Clone, Copy, Debug)]
struct Seen {
    moments: Moments,
    /// Sum of the unit directions from the points to the lidar.
    facing: Vector3<f64>,
}

impl Seen {
    fn of(p: [f64; 3], to_lidar: &Vector3<f64>) -> Self {
        Self {
            moments: Moments::of_point(p, 0.0, 0.0),
            facing: *to_lidar,
        }
    }
}

/// Points seen in one voxel.
#[derive(Clone, Debug)]
struct Cell {
    key: u64,
    middle: Vector3<f64>,
    before: Option<Seen>,
    now: Seen,
}

impl Cell {
    fn add(&mut self, p: [f64; 3], to_lidar: &Vector3<f64>) {
        if self.now.moments.n() >= GENERATION {
            self.before = Some(self.now);
            self.now = Seen::of(p, to_lidar);
        } else {
            self.now.moments.add_point(p, 0.0, 0.0);
            self.now.facing += to_lidar;
        }
    }

    fn gaussian(&self, size: f64, shape: &Shape) -> Option<Gaussian> {
        let mut all = self.now;
        if let Some(before) = &self.before {
            all.moments.merge(&before.moments);
            all.facing += before.facing;
        }
        let facing = all.facing / f64::from(all.moments.n());
        Gaussian::of(&all.moments, &facing, &self.middle, size, shape)
    }
}

/// Voxels of one size and their distributions.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    size: f64,
    places: FxHashMap<u64, u32>,
    cells: Vec<Cell>,
    /// One per cell, apart from it because the search reads nothing else.
    gaussians: Vec<Option<Gaussian>>,
}

impl Grid {
    pub(crate) fn new(size: f64) -> Self {
        Self {
            size,
            places: FxHashMap::default(),
            cells: Vec::new(),
            gaussians: Vec::new(),
        }
    }

    /// Edge of the voxels, m.
    pub(crate) fn size(&self) -> f64 {
        self.size
    }

    /// Number of cells that have a distribution.
    pub(crate) fn n_surfaces(&self) -> usize {
        self.gaussians.iter().flatten().count()
    }

    /// The distribution at a place in the map, if there is one.
    #[inline]
    pub(crate) fn at(&self, p: &[f64; 3]) -> Option<&Gaussian> {
        let place = self.places.get(&key(p, 1.0 / self.size))?;
        self.gaussians[*place as usize].as_ref()
    }

    /// Adds points in the map, in their order, seen from `lidar`.
    pub(crate) fn insert(&mut self, points: &[[f64; 3]], lidar: &Vector3<f64>, shape: &Shape) {
        let mut touched: Vec<u32> = points.iter().map(|p| self.add(p, lidar)).collect();
        touched.sort_unstable();
        touched.dedup();
        let cells = &self.cells;
        let of = |i: &u32| cells[*i as usize].gaussian(self.size, shape);
        let made: Vec<Option<Gaussian>> = touched.par_iter().with_min_len(CHUNK).map(of).collect();
        for (i, gaussian) in touched.iter().zip(made) {
            self.gaussians[*i as usize] = gaussian;
        }
    }

    fn add(&mut self, p: &[f64; 3], lidar: &Vector3<f64>) -> u32 {
        let key = key(p, 1.0 / self.size);
        let to_lidar = (lidar - Vector3::from(*p))
            .try_normalize(0.0)
            .unwrap_or_default();
        if let Some(&place) = self.places.get(&key) {
            let cell = &mut self.cells[place as usize];
            let middle = cell.middle;
            cell.add(std::array::from_fn(|i| p[i] - middle[i]), &to_lidar);
            return place;
        }
        let place = self.cells.len() as u32;
        let middle = Vector3::from(p.map(|c| ((c / self.size).floor() + 0.5) * self.size));
        self.places.insert(key, place);
        self.cells.push(Cell {
            key,
            middle,
            before: None,
            now: Seen::of(std::array::from_fn(|i| p[i] - middle[i]), &to_lidar),
        });
        self.gaussians.push(None);
        place
    }

    /// Keeps only the cells within `radius`, m, of `centre`.
    pub(crate) fn keep_within(&mut self, centre: &Vector3<f64>, radius: f64) {
        let near: Vec<bool> = (self.cells.iter())
            .map(|c| (c.middle - centre).norm() <= radius)
            .collect();
        let mut kept = near.iter();
        self.cells.retain(|_| *kept.next().unwrap_or(&false));
        let mut kept = near.iter();
        self.gaussians.retain(|_| *kept.next().unwrap_or(&false));
        let places = self.cells.iter().enumerate();
        self.places = places.map(|(i, c)| (c.key, i as u32)).collect();
    }
}
