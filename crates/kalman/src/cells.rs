// SPDX-License-Identifier: MIT OR Apache-2.0
//! Voxels of one size that hold the moments of the points in them, and a shape made of these.

use bentwing_surfels::Moments;
use bentwing_surfels::voxel::key;
use nalgebra::Vector3;
use rustc_hash::FxHashMap;

/// What the points of a voxel have in common.
pub(crate) trait Shape: Sized {
    /// The shape in a voxel of edge `size` around `middle`, if the points show one; `sigma` is the
    /// standard deviation of a range, m.
    fn of(moments: &Moments, middle: &Vector3<f64>, size: f64, sigma: f64) -> Option<Self>;
}

/// How long a voxel takes points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Memory {
    /// Until it has so many and a shape: the first view of a place is what all later ones are
    /// compared with, so that coming back does not drift.
    First(u32),
    /// For ever, but what is older than so many is forgotten: right while calibration is learned.
    Last(u32),
}

#[derive(Clone, Debug)]
struct Cell {
    key: u64,
    middle: Vector3<f64>,
    before: Option<Moments>,
    now: Moments,
}

impl Cell {
    fn moments(&self) -> Moments {
        let mut all = self.now;
        if let Some(before) = &self.before {
            all.merge(before);
        }
        all
    }
}

/// Voxels of one size.
#[derive(Clone, Debug)]
pub(crate) struct Cells<S> {
    size: f64,
    memory: Memory,
    places: FxHashMap<u64, u32>,
    held: Vec<Cell>,
    /// One per cell, apart from it because the search reads nothing else.
    shapes: Vec<Option<S>>,
    /// What `insert` was told when the cell got its shape.
    births: Vec<u32>,
}

impl<S: Shape> Cells<S> {
    pub(crate) fn new(size: f64, memory: Memory) -> Self {
        Self {
            size,
            memory,
            places: FxHashMap::default(),
            held: Vec::new(),
            shapes: Vec::new(),
            births: Vec::new(),
        }
    }

    /// Number of voxels with a shape.
    pub(crate) fn n_shapes(&self) -> usize {
        self.shapes.iter().flatten().count()
    }

    /// The shape at a place in the map, if there is one, and its birth.
    #[inline]
    pub(crate) fn at(&self, p: &Vector3<f64>) -> Option<(&S, u32)> {
        let place = self.places.get(&key(&(*p).into(), 1.0 / self.size))?;
        let shape = self.shapes[*place as usize].as_ref()?;
        Some((shape, self.births[*place as usize]))
    }

    /// Adds points in the map, in their order; returns how many came to a voxel that had no shape.
    ///
    /// Voxels that get a shape by them remember `birth`.
    pub(crate) fn insert(&mut self, points: &[Vector3<f64>], sigma: f64, birth: u32) -> usize {
        let mut n_new = 0;
        let mut touched: Vec<u32> = Vec::with_capacity(points.len());
        for p in points {
            let (place, is_new) = self.add(p);
            touched.extend(place);
            n_new += usize::from(is_new);
        }
        touched.sort_unstable();
        touched.dedup();
        for i in touched {
            let cell = &self.held[i as usize];
            let shape = S::of(&cell.moments(), &cell.middle, self.size, sigma);
            if self.shapes[i as usize].is_none() {
                self.births[i as usize] = birth;
            }
            self.shapes[i as usize] = shape;
        }
        n_new
    }

    fn add(&mut self, p: &Vector3<f64>) -> (Option<u32>, bool) {
        let key = key(&(*p).into(), 1.0 / self.size);
        let Some(&place) = self.places.get(&key) else {
            let place = self.held.len() as u32;
            let middle = p.map(|c| ((c / self.size).floor() + 0.5) * self.size);
            self.places.insert(key, place);
            self.held.push(Cell {
                key,
                middle,
                before: None,
                now: Moments::of_point((p - middle).into(), 0.0, 0.0),
            });
            self.shapes.push(None);
            self.births.push(0);
            return (Some(place), true);
        };
        let is_new = self.shapes[place as usize].is_none();
        let cell = &mut self.held[place as usize];
        let local = (p - cell.middle).into();
        match self.memory {
            Memory::First(most) if cell.now.n() >= most && !is_new => return (None, false),
            // A voxel that never becomes a shape must not hold on to what spoils it.
            Memory::First(most) | Memory::Last(most) if cell.now.n() >= most => {
                cell.before = Some(cell.now);
                cell.now = Moments::of_point(local, 0.0, 0.0);
            }
            _ => cell.now.add_point(local, 0.0, 0.0),
        }
        (Some(place), is_new)
    }

    /// Keeps only the voxels within `radius`, m, of `centre`.
    pub(crate) fn keep_within(&mut self, centre: &Vector3<f64>, radius: f64) {
        let near: Vec<bool> = (self.held.iter())
            .map(|c| (c.middle - centre).norm_squared() <= radius * radius)
            .collect();
        let mut kept = near.iter();
        self.held.retain(|_| *kept.next().unwrap_or(&false));
        let mut kept = near.iter();
        self.shapes.retain(|_| *kept.next().unwrap_or(&false));
        let mut kept = near.iter();
        self.births.retain(|_| *kept.next().unwrap_or(&false));
        let places = self.held.iter().enumerate();
        self.places = places.map(|(i, c)| (c.key, i as u32)).collect();
    }
}
