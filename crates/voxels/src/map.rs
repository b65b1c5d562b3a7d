// SPDX-License-Identifier: MIT OR Apache-2.0
//! Voxels of one size that remember what was seen in them, and a shape made of it.

use nalgebra::Vector3;
use rustc_hash::FxHashMap;

use crate::{Moments, VoxelKey};

/// What points add up to.
pub trait Tally: Copy {
    /// Number of points.
    fn n(&self) -> u32;
    /// Adds the points of `other`.
    fn merge(&mut self, other: &Self);
}

impl Tally for Moments {
    fn n(&self) -> u32 {
        self.n()
    }

    fn merge(&mut self, other: &Self) {
        self.merge(other);
    }
}

/// How long a voxel takes points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Memory {
    /// Until it has so many and a shape: the first view of a place is what all later ones are
    /// compared with, so that coming back does not drift.
    First(u32),
    /// For ever, but after so many it begins anew, keeping these until as many have come again: what
    /// it says stays recent, and a crowded place does not outweigh what is seen there now.
    Last(u32),
}

/// What was seen in a voxel.
#[derive(Clone, Debug)]
pub struct Voxel<T> {
    key: VoxelKey,
    middle: Vector3<f64>,
    before: Option<T>,
    now: T,
}

impl<T: Tally> Voxel<T> {
    /// Middle of the voxel, m; what is summed is relative to it.
    pub fn middle(&self) -> &Vector3<f64> {
        &self.middle
    }

    /// All that it remembers.
    pub fn tally(&self) -> T {
        let mut all = self.now;
        if let Some(before) = &self.before {
            all.merge(before);
        }
        all
    }
}

/// Voxels of one size, each with a shape `S` if its points show one.
#[derive(Clone, Debug)]
pub struct VoxelMap<T, S> {
    size: f64,
    memory: Memory,
    places: FxHashMap<VoxelKey, u32>,
    voxels: Vec<Voxel<T>>,
    /// One per voxel, apart from it because the search reads nothing else.
    shapes: Vec<Option<S>>,
}

impl<T: Tally, S> VoxelMap<T, S> {
    /// An empty map with voxels of edge `size`, m.
    pub fn new(size: f64, memory: Memory) -> Self {
        Self {
            size,
            memory,
            places: FxHashMap::default(),
            voxels: Vec::new(),
            shapes: Vec::new(),
        }
    }

    /// Edge of the voxels, m.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Number of voxels with a shape.
    pub fn n_shapes(&self) -> usize {
        self.shapes.iter().flatten().count()
    }

    /// The shape in the voxel of a point, if there is one.
    #[inline]
    pub fn at(&self, p: &[f64; 3]) -> Option<&S> {
        let place = self.places.get(&VoxelKey::of(p, 1.0 / self.size))?;
        self.shapes[*place as usize].as_ref()
    }

    /// Adds points in their order, of which `tally` makes sums by their numbers and their places
    /// relative to the middle of their voxel. Returns the numbers of the voxels that took any, in
    /// order, and how many points came to a voxel that had no shape.
    pub fn add(
        &mut self,
        points: impl IntoIterator<Item = [f64; 3]>,
        tally: impl Fn(usize, [f64; 3]) -> T,
    ) -> (Vec<u32>, usize) {
        let (mut touched, mut n_new) = (Vec::new(), 0);
        for (i, p) in points.into_iter().enumerate() {
            let (place, took) = self.add_one(&p, |local| tally(i, local));
            n_new += usize::from(self.shapes[place as usize].is_none());
            if took {
                touched.push(place);
            }
        }
        touched.sort_unstable();
        touched.dedup();
        (touched, n_new)
    }

    /// Adds a point; returns the number of its voxel and whether that took it.
    fn add_one(&mut self, p: &[f64; 3], tally: impl Fn([f64; 3]) -> T) -> (u32, bool) {
        let key = VoxelKey::of(p, 1.0 / self.size);
        let local = |middle: &Vector3<f64>| std::array::from_fn(|i| p[i] - middle[i]);
        let Some(&place) = self.places.get(&key) else {
            let place = self.voxels.len() as u32;
            let middle = Vector3::from(p.map(|c| ((c / self.size).floor() + 0.5) * self.size));
            self.places.insert(key, place);
            self.voxels.push(Voxel {
                key,
                middle,
                before: None,
                now: tally(local(&middle)),
            });
            self.shapes.push(None);
            return (place, true);
        };
        let has_shape = self.shapes[place as usize].is_some();
        let voxel = &mut self.voxels[place as usize];
        let (Memory::First(most) | Memory::Last(most)) = self.memory;
        let is_full = voxel.now.n() >= most;
        if is_full && has_shape && matches!(self.memory, Memory::First(_)) {
            return (place, false);
        }
        let seen = tally(local(&voxel.middle));
        if is_full {
            // A voxel that never shows a shape must not hold on to what spoils it.
            voxel.before = Some(voxel.now);
            voxel.now = seen;
        } else {
            voxel.now.merge(&seen);
        }
        (place, true)
    }

    /// What was seen in a voxel, and its shape so far.
    pub fn voxel(&self, number: u32) -> (&Voxel<T>, Option<&S>) {
        let number = number as usize;
        (&self.voxels[number], self.shapes[number].as_ref())
    }

    /// Sets the shape of a voxel.
    pub fn set_shape(&mut self, number: u32, shape: Option<S>) {
        self.shapes[number as usize] = shape;
    }

    /// Keeps only the voxels within `radius`, m, of `centre`.
    pub fn keep_within(&mut self, centre: &Vector3<f64>, radius: f64) {
        let near: Vec<bool> = (self.voxels.iter())
            .map(|v| (v.middle - centre).norm() <= radius)
            .collect();
        let mut kept = near.iter();
        self.voxels.retain(|_| *kept.next().unwrap_or(&false));
        let mut kept = near.iter();
        self.shapes.retain(|_| *kept.next().unwrap_or(&false));
        let places = self.voxels.iter().zip(0..);
        self.places = places.map(|(v, number)| (v.key, number)).collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shape of a voxel: how many points it remembers.
    fn count(map: &mut VoxelMap<Moments, u32>, points: &[[f64; 3]]) -> usize {
        let (touched, n_new) = map.add(points.iter().copied(), |_, local| Moments::of_point(local));
        for number in touched {
            let n = map.voxel(number).0.tally().n();
            map.set_shape(number, (n > 1).then_some(n));
        }
        n_new
    }

    #[test]
    fn voxels_remember_the_first_or_the_last_points() {
        for (memory, after, new) in [(Memory::First(4), 4, 0), (Memory::Last(4), 6, 0)] {
            let mut map = VoxelMap::new(0.5, memory);
            assert_eq!(count(&mut map, &[[1.2, 0.1, 0.1]; 4]), 4);
            assert_eq!(count(&mut map, &[[1.3, 0.1, 0.1]; 6]), new);
            assert_eq!(map.at(&[1.4, 0.4, 0.4]), Some(&after));
        }
    }

    #[test]
    fn sums_are_relative_to_the_middle_and_what_is_far_is_forgotten() {
        let mut map = VoxelMap::new(0.5, Memory::Last(100));
        count(
            &mut map,
            &[[-0.1, -0.3, 7.2], [-0.3, -0.3, 7.2], [9.0, 0.0, 0.0]],
        );
        let (voxel, shape) = map.voxel(0);
        assert_eq!(voxel.middle(), &Vector3::new(-0.25, -0.25, 7.25));
        assert!(
            (voxel.tally().mean() + voxel.middle() - Vector3::new(-0.2, -0.3, 7.2)).norm() < 1e-12
        );
        assert_eq!((shape, map.n_shapes()), (Some(&2), 1));
        map.keep_within(&Vector3::new(9.0, 0.0, 0.0), 5.0);
        assert_eq!((map.n_shapes(), map.at(&[-0.1, -0.3, 7.2])), (0, None));
    }
}
