// SPDX-License-Identifier: MIT OR Apache-2.0
//! A triangle mesh with a bounding-volume hierarchy.

use parry3d_f64::math::Vector;
use parry3d_f64::query::Ray;
use parry3d_f64::shape::{CompositeShapeRef, TriMesh};
use rayon::prelude::*;

#[cfg(test)]
mod tests;

/// Stands in for a triangle's index where nothing was hit.
pub const NO_TRIANGLE: i32 = -1;

/// Rays and points per parallel task: small enough to share the work evenly, large enough to
/// hide its cost.
const CHUNK: usize = 1024;

/// Why a scene cannot be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// There is nothing to hit.
    #[error("the scene has no triangles")]
    Empty,
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {triangle} refers to vertex {vertex}, the scene has {n_vertices}")]
    VertexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex it asks for.
        vertex: u32,
        /// How many there are.
        n_vertices: usize,
    },
}

/// Triangles that can be asked for the first hit along a ray and the nearest point.
pub struct Scene {
    mesh: TriMesh,
}

impl Scene {
    /// Builds the hierarchy over `triangles`, whose corners index into `vertices` (m) and turn
    /// counter-clockwise when seen from outside.
    ///
    /// # Errors
    ///
    /// [`SceneError`] when there are no triangles or one refers to a missing vertex.
    pub fn new(vertices: &[[f64; 3]], triangles: Vec<[u32; 3]>) -> Result<Self, SceneError> {
        check(vertices.len(), &triangles)?;
        let vertices = vertices.iter().copied().map(vector).collect();
        let mesh = TriMesh::new(vertices, triangles).map_err(|_empty| SceneError::Empty)?;
        Ok(Self { mesh })
    }

    /// Number of triangles.
    pub fn n_triangles(&self) -> usize {
        self.mesh.indices().len()
    }

    /// First surface along each ray: range (in lengths of the direction, so m for unit vectors)
    /// and triangle, or infinity and [`NO_TRIANGLE`] where there is none up to `max_range`.
    ///
    /// Both sides of a triangle are hit.
    pub fn cast(
        &self,
        origins: &[[f64; 3]],
        directions: &[[f64; 3]],
        max_range: f64,
    ) -> (Vec<f64>, Vec<i32>) {
        origins
            .par_iter()
            .zip_eq(directions)
            .with_min_len(CHUNK)
            .map(|(&origin, &direction)| self.cast_one(origin, direction, max_range))
            .unzip()
    }

    /// Distance from each point to the nearest surface and that surface's triangle; the distance
    /// is negative behind the triangle (on the side its normal points away from).
    pub fn distance(&self, points: &[[f64; 3]]) -> (Vec<f64>, Vec<i32>) {
        points
            .par_iter()
            .with_min_len(CHUNK / 8)
            .map(|&point| self.distance_one(point))
            .unzip()
    }

    fn cast_one(&self, origin: [f64; 3], direction: [f64; 3], max_range: f64) -> (f64, i32) {
        let ray = Ray::new(vector(origin), vector(direction));
        match CompositeShapeRef(&self.mesh).cast_local_ray(&ray, max_range, false) {
            Some((triangle, range)) => (range, triangle as i32),
            None => (f64::INFINITY, NO_TRIANGLE),
        }
    }

    fn distance_one(&self, point: [f64; 3]) -> (f64, i32) {
        let point = vector(point);
        let nearest =
            CompositeShapeRef(&self.mesh).project_local_point(point, f64::INFINITY, false);
        let Some((triangle, projection)) = nearest else {
            return (f64::INFINITY, NO_TRIANGLE);
        };
        let offset = point - projection.point;
        let side = self.mesh.triangle(triangle).scaled_normal().dot(offset);
        (offset.length().copysign(side), triangle as i32)
    }
}

fn check(n_vertices: usize, triangles: &[[u32; 3]]) -> Result<(), SceneError> {
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= n_vertices) {
            return Err(SceneError::VertexOutOfRange {
                triangle,
                vertex,
                n_vertices,
            });
        }
    }
    if triangles.is_empty() {
        Err(SceneError::Empty)
    } else {
        Ok(())
    }
}

fn vector([x, y, z]: [f64; 3]) -> Vector {
    Vector::new(x, y, z)
}
