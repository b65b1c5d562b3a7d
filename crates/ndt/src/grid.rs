// SPDX-License-Identifier: MIT OR Apache-2.0
//! One level of voxels.

use bentwing_voxels::{Memory, Moments, Tally, Voxel, VoxelMap};
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::gaussian::{Gaussian, Shape};

/// Voxels per parallel task; fixed, so that results do not depend on the number of threads.
const CHUNK: usize = 512;
/// Points after which a voxel begins anew.
const MEMORY: Memory = Memory::Last(400);

/// What was seen in one voxel.
#[derive(Clone, Copy, Debug)]
struct Seen {
    moments: Moments,
    /// Sum of the unit directions from the points to the lidar.
    facing: Vector3<f64>,
}

impl Tally for Seen {
    fn n(&self) -> u32 {
        self.moments.n()
    }

    fn merge(&mut self, other: &Self) {
        self.moments.merge(&other.moments);
        self.facing += other.facing;
    }
}

/// Voxels of one size and their distributions.
#[derive(Clone, Debug)]
pub(crate) struct Grid(VoxelMap<Seen, Gaussian>);

impl Grid {
    pub(crate) fn new(size: f64) -> Self {
        Self(VoxelMap::new(size, MEMORY))
    }

    /// Edge of the voxels, m.
    pub(crate) fn size(&self) -> f64 {
        self.0.size()
    }

    /// Number of voxels that have a distribution.
    pub(crate) fn n_surfaces(&self) -> usize {
        self.0.n_shapes()
    }

    /// The distribution at a place in the map, if there is one.
    #[inline]
    pub(crate) fn at(&self, p: &[f64; 3]) -> Option<&Gaussian> {
        self.0.at(p)
    }

    /// Adds points in the map, in their order, seen from `lidar`.
    pub(crate) fn insert(&mut self, points: &[[f64; 3]], lidar: &Vector3<f64>, shape: &Shape) {
        let seen = |i: usize, local| {
            let to_lidar = lidar - Vector3::from(points[i]);
            Seen {
                moments: Moments::of_point(local),
                facing: to_lidar.try_normalize(0.0).unwrap_or_default(),
            }
        };
        let (touched, _) = self.0.add(points.iter().copied(), seen);
        let (map, size) = (&self.0, self.0.size());
        let of = |&number: &u32| gaussian(map.voxel(number).0, size, shape);
        let made: Vec<Option<Gaussian>> = touched.par_iter().with_min_len(CHUNK).map(of).collect();
        for (number, gaussian) in touched.into_iter().zip(made) {
            self.0.set_shape(number, gaussian);
        }
    }

    /// Keeps only the voxels within `radius`, m, of `centre`.
    pub(crate) fn keep_within(&mut self, centre: &Vector3<f64>, radius: f64) {
        self.0.keep_within(centre, radius);
    }
}

fn gaussian(voxel: &Voxel<Seen>, size: f64, shape: &Shape) -> Option<Gaussian> {
    let all = voxel.tally();
    let facing = all.facing / f64::from(all.n());
    Gaussian::of(&all.moments, &facing, voxel.middle(), size, shape)
}
