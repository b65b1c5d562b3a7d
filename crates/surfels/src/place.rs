// SPDX-License-Identifier: MIT OR Apache-2.0
//! Places time-stamped lidar points in the map.

#![allow(
    clippy::inline_always,
    reason = "only what is inlined into a dispatched function uses the machine's instructions"
)]

use bentwing_trajectory::{Head, Trajectory, so3};
use nalgebra::{Matrix3, Vector3};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Points per parallel task; fixed, so that results do not depend on the number of threads.
const CHUNK: usize = 4096;

/// Lidar points in the map: `T_map_imu(t − latency) · T_imu_lidar(θ) · p` (Kaul 2015, eq. 1–2).
///
/// `angles` are the encoder angles of a motor-turned head, otherwise ignored and may be empty.
/// Times beyond the trajectory take its first or last pose.
pub fn place_points(
    points: &[[f64; 3]],
    times: &[f64],
    angles: &[f64],
    trajectory: &Trajectory,
    head: &Head,
) -> Vec<[f64; 3]> {
    let mut placed = vec![[0.0; 3]; points.len()];
    Placer::new(trajectory, head).place(points, times, angles, &mut placed);
    placed
}

/// Returns in the map.
#[derive(Clone, Debug)]
pub struct PlacedShots {
    /// m.
    pub points: Vec<[f64; 3]>,
    /// Unit directions from the lidar to the points.
    pub beams: Vec<[f32; 3]>,
    /// m, as they were given.
    pub lengths: Vec<f64>,
}

/// Shorter beams have no direction, m.
const SHORTEST: f32 = 1e-6;

/// Lidar points in the map, as [`place_points`] has them, with the beams that measured them.
pub fn place_shots(
    points: &[[f64; 3]],
    times: &[f64],
    angles: &[f64],
    trajectory: &Trajectory,
    head: &Head,
) -> PlacedShots {
    let placer = Placer::new(trajectory, head);
    let mut placed = vec![[0.0; 3]; points.len()];
    let mut origins = placed.clone();
    placer.place(points, times, angles, &mut placed);
    placer.place(&vec![[0.0; 3]; points.len()], times, angles, &mut origins);
    let length = |p: &[f64; 3]| (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
    let lengths: Vec<f64> = points.par_iter().with_min_len(CHUNK).map(length).collect();
    let beams = placed
        .par_iter()
        .zip(&origins)
        .zip(&lengths)
        .with_min_len(CHUNK)
        .map(|((p, o), &length)| {
            let length = f64::from((length as f32).max(SHORTEST));
            [0, 1, 2].map(|a| ((p[a] - o[a]) / length) as f32)
        })
        .collect();
    PlacedShots {
        points: placed,
        beams,
        lengths,
    }
}

/// Places points with one trajectory and head.
pub(crate) struct Placer<'a> {
    trajectory: &'a Trajectory,
    head: &'a Head,
    rotations: Vec<Matrix3<f64>>,
    R_imu_base: Matrix3<f64>,
    t_imu_base: Vector3<f64>,
}

impl<'a> Placer<'a> {
    pub(crate) fn new(trajectory: &'a Trajectory, head: &'a Head) -> Self {
        let rotations = trajectory.rotations().iter();
        let rotations = rotations.map(so3::matrix).collect();
        let base = &head.T_imu_base;
        Self {
            trajectory,
            head,
            rotations,
            R_imu_base: so3::matrix(&base.rotation),
            t_imu_base: base.translation.vector,
        }
    }

    /// Places `points` into `placed`, which is as long.
    pub(crate) fn place(
        &self,
        points: &[[f64; 3]],
        times: &[f64],
        angles: &[f64],
        placed: &mut [[f64; 3]],
    ) {
        let arch = Arch::new();
        let chunks = placed.par_chunks_mut(CHUNK).enumerate();
        chunks.for_each(|(c, placed)| {
            let chunk = c * CHUNK..c * CHUNK + placed.len();
            let (points, times) = (&points[chunk.clone()], &times[chunk.clone()]);
            let turned: Vec<[f64; 3]>;
            let points = if self.head.takes_points_as_measured() {
                points
            } else {
                let angle = |i: usize| angles.get(i).copied().unwrap_or(0.0);
                let in_base = |(p, i): (&[f64; 3], usize)| {
                    let p = Vector3::from(*p);
                    self.head.point_in_base(&p, angle(i)).into()
                };
                turned = points.iter().zip(chunk).map(in_base).collect();
                &turned
            };
            // The widest instructions of the machine; the order of operations is the same.
            let placer = self;
            arch.dispatch(Chunk {
                placer,
                points,
                times,
                placed,
            });
        });
    }

    /// Places points between sample `n` and the next, each a fraction of the way.
    #[inline(always)]
    fn place_run(&self, n: usize, points: &[[f64; 3]], fractions: &[f64], placed: &mut [[f64; 3]]) {
        let (positions, w) = (self.trajectory.positions(), self.trajectory.steps()[n]);
        let (p0, shift) = (positions[n], positions[n + 1] - positions[n]);
        let (R, R_imu_base, t_imu_base) = (self.rotations[n], self.R_imu_base, self.t_imu_base);
        for ((p, &u), placed) in points.iter().zip(fractions).zip(placed) {
            let p = R_imu_base * Vector3::new(p[0], p[1], p[2]) + t_imu_base;
            // Exp(u w) p as a series: a step is at most about 0.1 rad, so the fifth term is below 1e-7.
            let c1 = w.cross(&p);
            let c2 = w.cross(&c1);
            let c3 = w.cross(&c2);
            let c4 = w.cross(&c3);
            let turned =
                p + (c1 + (c2 + (c3 + c4 * (u * 0.25)) * (u * (1.0 / 3.0))) * (u * 0.5)) * u;
            let q = R * turned + p0 + shift * u;
            *placed = [q.x, q.y, q.z];
        }
    }
}

/// What one task places. A closure would not be inlined into the dispatched function.
struct Chunk<'a> {
    placer: &'a Placer<'a>,
    points: &'a [[f64; 3]],
    times: &'a [f64],
    placed: &'a mut [[f64; 3]],
}

impl WithSimd for Chunk<'_> {
    type Output = ();

    /// Places points run by run; all points of a run are between the same two samples.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (trajectory, clock) = (self.placer.trajectory, self.placer.head.clock);
        let located = self
            .times
            .iter()
            .map(|&t| trajectory.locate(clock.measured(t)));
        let (samples, fractions): (Vec<usize>, Vec<f64>) = located.unzip();
        let mut start = 0;
        for run in samples.chunk_by(|a, b| a == b) {
            let range = start..start + run.len();
            start = range.end;
            let points = &self.points[range.clone()];
            let placed = &mut self.placed[range.clone()];
            let fractions = &fractions[range];
            self.placer.place_run(run[0], points, fractions, placed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bentwing_trajectory::{LidarClock, Motor, MotorErrors, RangeBias};
    use nalgebra::Isometry3;

    #[test]
    fn points_are_placed_by_the_interpolated_pose_and_the_chain_of_frames() {
        let rate = Vector3::new(1.0, 0.5, 8.0);
        let positions = (0..50)
            .map(|n| Vector3::new(0.02, 0.01, 0.0) * f64::from(n))
            .collect();
        let rotations = (0..50)
            .map(|n| so3::exp(&(rate * 0.01 * f64::from(n))))
            .collect();
        let trajectory = Trajectory::new(0.0, 0.01, positions, rotations).unwrap();
        let motor = Motor {
            axis: Vector3::y(),
            zero: 0.01,
            T_motor_lidar: Isometry3::new(Vector3::new(0.0, 0.1, 0.0), Vector3::x()),
            errors: MotorErrors {
                eccentricity: [0.01, 0.0],
                wobble: [[0.01; 4]; 2],
            },
        };
        let base = Isometry3::new(Vector3::new(0.3, 0.0, 0.1), Vector3::z());
        for motor in [None, Some(motor)] {
            let head = Head {
                T_imu_base: base,
                clock: LidarClock::late_by(0.003),
                motor,
                ranges: RangeBias::default(),
            };
            let p = [3.0, 20.0, -4.0];
            let placed = place_points(&[p], &[0.2574], &[1.3], &trajectory, &head)[0];
            let (R, t) = head.lidar_in_imu(1.3);
            let pose = trajectory.pose(0.2544);
            let expected = pose.R * (R * Vector3::from(p) + t) + pose.p;
            assert!((Vector3::from(placed) - expected).norm() < 2e-6);
        }
    }
}
