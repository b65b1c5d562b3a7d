// SPDX-License-Identifier: MIT OR Apache-2.0
//! Places time-stamped lidar points in the map.

use bentwing_trajectory::{Head, Trajectory};
use nalgebra::{Isometry3, Matrix3, Vector3};
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
    let placer = Placer::new(trajectory, head);
    let mut placed = vec![[0.0; 3]; points.len()];
    placed
        .par_chunks_mut(CHUNK)
        .enumerate()
        .for_each(|(c, out)| {
            for (i, out) in (c * CHUNK..).zip(out) {
                let angle = angles.get(i).copied().unwrap_or(0.0);
                *out = placer.place(&points[i], times[i], angle);
            }
        });
    placed
}

struct Placer<'a> {
    trajectory: &'a Trajectory,
    head: &'a Head,
    rotations: Vec<Matrix3<f64>>,
    R_imu_lidar: Matrix3<f64>,
    t_imu_lidar: Vector3<f64>,
}

impl<'a> Placer<'a> {
    fn new(trajectory: &'a Trajectory, head: &'a Head) -> Self {
        let rotations = trajectory.rotations().iter();
        let rotations = rotations
            .map(|q| q.to_rotation_matrix().into_inner())
            .collect();
        let (R_imu_lidar, t_imu_lidar) = head.lidar_in_imu(0.0);
        Self {
            trajectory,
            head,
            rotations,
            R_imu_lidar,
            t_imu_lidar,
        }
    }

    fn in_imu(&self, p: &[f64; 3], angle: f64) -> Vector3<f64> {
        let p = Vector3::from(*p);
        if self.head.motor.is_none() {
            return self.R_imu_lidar * p + self.t_imu_lidar;
        }
        let T: &Isometry3<f64> = &self.head.T_imu_base;
        T.transform_point(&self.head.point_in_base(&p, angle).into())
            .coords
    }

    fn place(&self, p: &[f64; 3], stamp: f64, angle: f64) -> [f64; 3] {
        let p = self.in_imu(p, angle);
        let trajectory = self.trajectory;
        let (n, u) = trajectory.locate(stamp - self.head.latency);
        // Exp(u φ) p as a series: a step is at most about 0.1 rad, so the fifth term is below 1e-7.
        let w = trajectory.steps()[n] * u;
        let c1 = w.cross(&p);
        let c2 = w.cross(&c1);
        let c3 = w.cross(&c2);
        let c4 = w.cross(&c3);
        let turned = p + c1 + c2 / 2.0 + c3 / 6.0 + c4 / 24.0;
        let (p0, p1) = (trajectory.positions()[n], trajectory.positions()[n + 1]);
        (self.rotations[n] * turned + p0 + (p1 - p0) * u).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bentwing_trajectory::{Motor, so3};

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
        };
        let base = Isometry3::new(Vector3::new(0.3, 0.0, 0.1), Vector3::z());
        for motor in [None, Some(motor)] {
            let head = Head {
                T_imu_base: base,
                latency: 0.003,
                motor,
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
