// SPDX-License-Identifier: MIT OR Apache-2.0
//! The local map: planes on several levels of voxels, and lines.
//!
//! The paper keeps points and fits a plane to the nearest five of each feature. The rays of a
//! sparse lidar are decimetres apart; statistics of voxels use all that was ever seen of a surface.

use bentwing_voxels::{MIN_POINTS, MIN_WIDTH, Memory, Moments, VoxelMap, sym3};
use nalgebra::Vector3;

/// Most variance across a plane, as a share of that of its narrower side.
const MAX_THICKNESS: f64 = 0.1;
/// Beyond this many features the mean of a surface gains no more: they share the error of the pose.
const MOST_INDEPENDENT: u32 = 25;
/// A line is so long at least, in voxels, and so thin at most, m.
const LINE: (f64, f64) = (0.15, 0.08);

/// What the features of a voxel have in common.
trait Shape: Sized {
    /// The shape in a voxel of edge `size` around `middle`, if the features show one; `sigma` is the
    /// standard deviation of a range, m.
    fn of(moments: &Moments, middle: &Vector3<f64>, size: f64, sigma: f64) -> Option<Self>;
}

/// A plane through the features of a voxel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    pub normal: Vector3<f64>,
    pub mean: Vector3<f64>,
    /// Variance across, m²: noise, thickness and roughness.
    pub across: f64,
    /// Variance of the mean's height, m², and the squared lengths over which it grows.
    height: f64,
    wide: f64,
}

impl Plane {
    /// Variance of the plane's own height at a place in it, m².
    pub(crate) fn height_variance(&self, x: &Vector3<f64>) -> f64 {
        let beside = (x - self.mean).norm_squared();
        self.height * (1.0 + beside / self.wide)
    }
}

impl Shape for Plane {
    fn of(moments: &Moments, middle: &Vector3<f64>, size: f64, sigma: f64) -> Option<Self> {
        if moments.n() < MIN_POINTS {
            return None;
        }
        let e = moments.eigen();
        let [across, wide, _] = e.values;
        if wide < (MIN_WIDTH * size).powi(2) || across > MAX_THICKNESS * wide {
            return None;
        }
        let across = across.max((0.25 * sigma).powi(2));
        Some(Self {
            normal: e.normal,
            mean: middle + moments.mean(),
            across,
            height: across / f64::from(moments.n().min(MOST_INDEPENDENT)),
            wide,
        })
    }
}

/// A line through the edge features of a voxel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub direction: Vector3<f64>,
    pub mean: Vector3<f64>,
    /// Variance across, m².
    pub across: f64,
}

impl Shape for Line {
    fn of(moments: &Moments, middle: &Vector3<f64>, size: f64, sigma: f64) -> Option<Self> {
        if moments.n() < MIN_POINTS {
            return None;
        }
        let (values, axes) = sym3::axes(&moments.covariance());
        if values[2] < (LINE.0 * size).powi(2) || values[1] > LINE.1 * LINE.1 {
            return None;
        }
        Some(Self {
            direction: axes[2],
            mean: middle + moments.mean(),
            across: values[1].max(sigma * sigma),
        })
    }
}

/// How the map is kept.
#[derive(Clone, Copy, Debug)]
pub struct MapSettings {
    /// Edge of the finest voxels, m.
    pub voxel_size: f64,
    /// Number of levels, each twice as coarse.
    pub n_levels: usize,
    /// How long voxels take features.
    pub memory: Memory,
    /// What is farther away from the lidar is forgotten, m.
    pub reach: f64,
}

/// Voxels of one size, their shapes with what was told when these were seen first.
type Level<S> = VoxelMap<Moments, (S, u32)>;

/// Adds features to a level; returns how many came to a voxel that had no shape.
fn add<S: Shape>(level: &mut Level<S>, features: &[Vector3<f64>], sigma: f64, birth: u32) -> usize {
    let points = features.iter().map(|&p| p.into());
    let (touched, n_new) = level.add(points, |_, local| Moments::of_point(local));
    let size = level.size();
    for number in touched {
        let (voxel, known) = level.voxel(number);
        let birth = known.map_or(birth, |(_, birth)| *birth);
        let shape = S::of(&voxel.tally(), voxel.middle(), size, sigma);
        level.set_shape(number, shape.map(|shape| (shape, birth)));
    }
    n_new
}

/// Planes and lines around the sensor.
#[derive(Clone, Debug)]
pub(crate) struct LocalMap {
    planes: Vec<Level<Plane>>,
    lines: Level<Line>,
    sigma: f64,
    reach: f64,
    kept_at: Option<Vector3<f64>>,
}

impl LocalMap {
    /// An empty map of what a lidar with ranges of standard deviation `sigma`, m, sees.
    pub(crate) fn new(settings: &MapSettings, sigma: f64) -> Self {
        let size = |level| settings.voxel_size * f64::from(1_u32 << level);
        let levels = 0..settings.n_levels as u32;
        Self {
            planes: levels
                .map(|l| VoxelMap::new(size(l), settings.memory))
                .collect(),
            lines: VoxelMap::new(size(1), settings.memory),
            sigma,
            reach: settings.reach,
            kept_at: None,
        }
    }

    /// Number of planes on all levels.
    pub(crate) fn n_planes(&self) -> usize {
        self.planes.iter().map(VoxelMap::n_shapes).sum()
    }

    /// The finest plane at a place, and when it was seen first.
    #[inline]
    pub(crate) fn plane(&self, x: &Vector3<f64>) -> Option<&(Plane, u32)> {
        self.planes.iter().find_map(|level| level.at(&(*x).into()))
    }

    /// The line at a place.
    #[inline]
    pub(crate) fn line(&self, x: &Vector3<f64>) -> Option<&Line> {
        self.lines.at(&(*x).into()).map(|(line, _)| line)
    }

    /// Adds features in the map, new planes with a `birth`; returns the share of the planar ones that saw something new.
    pub(crate) fn insert(
        &mut self,
        planar: &[Vector3<f64>],
        edges: &[Vector3<f64>],
        birth: u32,
    ) -> f64 {
        // On the finest level what is far away is always new.
        let told = 1.min(self.planes.len() - 1);
        let n_new: Vec<usize> = (self.planes.iter_mut())
            .map(|level| add(level, planar, self.sigma, birth))
            .collect();
        add(&mut self.lines, edges, self.sigma, birth);
        n_new[told] as f64 / planar.len().max(1) as f64
    }

    /// Forgets what is out of reach, each time the sensor has moved by a tenth of it.
    pub(crate) fn follow(&mut self, centre: &Vector3<f64>) {
        let moved = |at: &Vector3<f64>| (at - centre).norm() > 0.1 * self.reach;
        if self.kept_at.as_ref().is_none_or(moved) {
            for level in &mut self.planes {
                level.keep_within(centre, self.reach);
            }
            self.lines.keep_within(centre, self.reach);
            self.kept_at = Some(*centre);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: MapSettings = MapSettings {
        voxel_size: 0.5,
        n_levels: 2,
        memory: Memory::First(200),
        reach: 20.0,
    };

    fn wall(x: f64) -> Vec<Vector3<f64>> {
        (0..400)
            .map(|i| Vector3::new(x, f64::from(i % 20) * 0.05, f64::from(i / 20) * 0.05))
            .collect()
    }

    #[test]
    fn a_wall_becomes_planes_and_an_edge_a_line() -> Result<(), &'static str> {
        let mut map = LocalMap::new(&SETTINGS, 0.02);
        let edge: Vec<_> = (0..20)
            .map(|i| Vector3::new(0.3, 0.3, 0.045 * f64::from(i)))
            .collect();
        map.insert(&wall(3.25), &edge, 7);
        let (plane, _) = map.plane(&Vector3::new(3.3, 0.2, 0.2)).ok_or("no plane")?;
        assert!(plane.normal.x.abs() > 0.9999 && (plane.mean.x - 3.25).abs() < 1e-9);
        let (near, far) = (plane.mean, plane.mean + Vector3::new(0.0, 1.0, 0.0));
        assert!(plane.height_variance(&far) > 10.0 * plane.height_variance(&near));
        let line = map.line(&Vector3::new(0.3, 0.4, 0.5)).ok_or("no line")?;
        assert!(line.direction.z.abs() > 0.9999);
        assert!(map.plane(&Vector3::new(8.0, 0.0, 0.0)).is_none());
        Ok(())
    }

    #[test]
    fn a_single_scan_line_is_no_plane() {
        let mut map = LocalMap::new(&SETTINGS, 0.02);
        let line: Vec<_> = (0..40)
            .map(|i| Vector3::new(2.2, 0.01 * f64::from(i), 0.2))
            .collect();
        map.insert(&line, &[], 0);
        assert_eq!(map.n_planes(), 0);
    }

    #[test]
    fn the_first_view_of_a_place_stays_and_the_last_one_replaces() -> Result<(), &'static str> {
        for (memory, x) in [(Memory::First(60), 3.2), (Memory::Last(60), 3.3)] {
            let mut map = LocalMap::new(&MapSettings { memory, ..SETTINGS }, 0.02);
            map.insert(&wall(3.2), &[], 0);
            for _ in 0..3 {
                map.insert(&wall(3.3), &[], 0);
            }
            let (plane, _) = map.plane(&Vector3::new(3.3, 0.2, 0.2)).ok_or("no plane")?;
            assert!((plane.mean.x - x).abs() < 0.03, "{}", plane.mean);
        }
        Ok(())
    }

    #[test]
    fn what_is_out_of_reach_is_forgotten() {
        let mut map = LocalMap::new(&SETTINGS, 0.02);
        map.insert(&wall(3.25), &[], 0);
        map.follow(&Vector3::zeros());
        assert!(map.n_planes() > 0);
        map.follow(&Vector3::new(30.0, 0.0, 0.0));
        assert_eq!(map.n_planes(), 0);
    }
}
