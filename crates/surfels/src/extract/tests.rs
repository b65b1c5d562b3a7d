// SPDX-License-Identifier: MIT OR Apache-2.0
use bentwing_trajectory::{LidarClock, RangeBias, TrajectoryError, so3};
use nalgebra::Isometry3;

use super::*;

fn settings() -> Settings {
    Settings {
        voxel_size: 0.4,
        n_levels: 4,
        max_gap: 0.08,
        max_span: 0.3,
        min_points: 6,
        min_planarity: 0.3,
        min_width_ratio: 0.03,
        min_width: 0.05,
        min_incidence_cosine: 0.1,
        max_rate: f64::INFINITY,
        range_sigma: 0.0,
    }
}

fn head() -> Head {
    Head {
        T_imu_base: Isometry3::new(Vector3::new(0.03, 0.0, -0.05), Vector3::new(0.0, 0.02, 0.1)),
        clock: LidarClock::late_by(0.002),
        motor: None,
        ranges: RangeBias::default(),
    }
}

fn moving() -> Trajectory {
    let n = 121;
    let positions = (0..n)
        .map(|i| Vector3::new(0.005 * f64::from(i), 0.0, 1.5))
        .collect();
    let rate = Vector3::new(0.05, 0.0, 3.0);
    let rotations = (0..n)
        .map(|i| so3::exp(&(rate * 0.01 * f64::from(i))))
        .collect();
    Trajectory::new(-0.05, 0.01, positions, rotations).unwrap()
}

/// Points on the plane x = 4 m, seen by the moving head at increasing stamps.
fn wall(trajectory: &Trajectory, head: &Head) -> (Vec<[f64; 3]>, Vec<f64>) {
    let (R, t) = head.lidar_in_imu(0.0);
    let mut out = (Vec::new(), Vec::new());
    for i in 0..4000 {
        let stamp = 0.1 + 0.00005 * f64::from(i);
        let (column, row) = (i / 40, i % 40);
        let target = Vector3::new(4.0, 0.05 * f64::from(column) - 2.5, 0.05 * f64::from(row));
        let pose = trajectory.pose(head.clock.measured(stamp));
        let p = R.transpose() * (pose.R.transpose() * (target - pose.p) - t);
        out.0.push(p.into());
        out.1.push(stamp);
    }
    out
}

/// A corner of two walls is flat in the plane of a scan that does not move: that is no surface.
#[test]
fn the_plane_of_a_resting_scan_is_no_surfel() -> Result<(), TrajectoryError> {
    let trajectory = Trajectory::new(
        -0.05,
        0.01,
        vec![Vector3::zeros(); 121],
        vec![nalgebra::UnitQuaternion::identity(); 121],
    )?;
    let head = Head {
        clock: LidarClock::default(),
        ..head()
    };
    let corner = (0..600).map(|i| {
        let along = 0.004 * f64::from(i % 100 - 50);
        [4.0 - along.max(0.0), 2.0 + along.min(0.0), 0.0]
    });
    let points: Vec<_> = corner.collect();
    let stamps: Vec<_> = (0..600).map(|i| 0.0003 * f64::from(i)).collect();
    let points = Points {
        points: &points,
        stamps: &stamps,
        angles: &[],
    };
    let anything = Settings {
        min_incidence_cosine: 0.0,
        ..settings()
    };
    assert!(!extract(points, &trajectory, &head, &anything).is_empty());
    assert!(extract(points, &trajectory, &head, &settings()).is_empty());
    Ok(())
}

#[test]
fn surfels_of_a_wall_lie_on_it_and_face_the_sensor() {
    let (trajectory, head) = (moving(), head());
    let (points, stamps) = wall(&trajectory, &head);
    let points = Points {
        points: &points,
        stamps: &stamps,
        angles: &[],
    };
    let set = extract(points, &trajectory, &head, &settings());
    assert!((0..4).all(|l| !set.level(l).is_empty()));
    for i in 0..set.len() {
        let pose = trajectory.pose(head.clock.measured(set.stamps[i]));
        let (R, t) = head.lidar_in_imu(0.0);
        let mean = pose.R * (R * set.means[i] + t) + pose.p;
        let normal = pose.R * R * set.normals[i];
        assert!((mean.x - 4.0).abs() < 1e-4, "mean {mean}");
        assert!((normal + Vector3::x()).norm() < 1e-3, "normal {normal}");
    }
}

#[test]
fn a_single_scan_line_is_no_surfel() {
    let (trajectory, head) = (moving(), head());
    let line: Vec<[f64; 3]> = (0..500).map(|i| [4.0, 0.01 * f64::from(i), 0.3]).collect();
    let stamps: Vec<f64> = (0..500).map(|i| 0.2 + 1e-6 * f64::from(i)).collect();
    let points = Points {
        points: &line,
        stamps: &stamps,
        angles: &[],
    };
    assert!(extract(points, &trajectory, &head, &settings()).is_empty());
}

#[test]
fn a_pause_splits_a_cell_in_two_surfels() {
    let still = Trajectory::new(
        0.0,
        1.0,
        vec![Vector3::zeros(); 3],
        vec![so3::exp(&Vector3::zeros()); 3],
    )
    .unwrap();
    let head = Head {
        T_imu_base: Isometry3::identity(),
        clock: LidarClock::default(),
        motor: None,
        ranges: RangeBias::default(),
    };
    let patch = |k: i32| {
        [
            1.0 + 1e-3 * f64::from(k % 2),
            0.02 * f64::from(k % 10) + 0.05,
            0.02 * f64::from(k / 10) + 0.05,
        ]
    };
    let points: Vec<[f64; 3]> = (0..200).map(|k| patch(k % 100)).collect();
    let stamps: Vec<f64> = (0..200)
        .map(|k| 1e-4 * f64::from(k) + if k < 100 { 0.0 } else { 1.0 })
        .collect();
    let set = extract(
        Points {
            points: &points,
            stamps: &stamps,
            angles: &[],
        },
        &still,
        &head,
        &settings(),
    );
    assert_eq!(set.level(0).len(), 2);
}

#[test]
fn a_budget_keeps_the_same_voxels_of_a_surface_seen_twice() {
    let (trajectory, head) = (moving(), head());
    let (points, stamps) = wall(&trajectory, &head);
    let points = Points {
        points: &points,
        stamps: &stamps,
        angles: &[],
    };
    let all = extract(points, &trajectory, &head, &settings());
    let few = extract(
        points,
        &trajectory,
        &head,
        &Settings {
            max_rate: 200.0,
            ..settings()
        },
    );
    let fewer = extract(
        points,
        &trajectory,
        &head,
        &Settings {
            max_rate: 100.0,
            ..settings()
        },
    );
    assert!(few.len() <= 40 && few.len() < all.len() && fewer.len() < few.len());
    assert!(fewer.means.iter().all(|m| few.means.contains(m)));
}

/// Pseudo-random normal numbers: sums of twelve uniform ones.
fn noise(i: u64) -> f64 {
    let uniform = |k| (rank(VoxelKey::new([i as i64, 0, k]), 0) >> 11) as f64 / (1u64 << 53) as f64;
    (0..12).map(uniform).sum::<f64>() - 6.0
}

/// Lines farther apart than the noise: seen at a grazing angle it tilts every normal to one side.
#[test]
fn noise_along_the_rays_does_not_tilt_the_ground() -> Result<(), TrajectoryError> {
    let above = vec![Vector3::new(0.0, 0.0, 1.5); 121];
    let level = vec![nalgebra::UnitQuaternion::identity(); 121];
    let trajectory = Trajectory::new(-0.05, 0.01, above, level)?;
    let head = Head {
        T_imu_base: Isometry3::identity(),
        ..head()
    };
    let sigma = 0.03;
    let ground = |i: u64| {
        let (line, column) = (i / 400, i % 400);
        let p = Vector3::new(4.0 + 0.16 * line as f64, 0.01 * column as f64 - 2.0, -1.5);
        (p + p.normalize() * sigma * noise(i)).into()
    };
    let points: Vec<[f64; 3]> = (0..10_000).map(ground).collect();
    let stamps: Vec<f64> = (0..10_000).map(|i| 0.1 + 2e-5 * f64::from(i)).collect();
    let tilt = |range_sigma| {
        let points = Points {
            points: &points,
            stamps: &stamps,
            angles: &[],
        };
        let settings = Settings {
            range_sigma,
            ..settings()
        };
        let set = extract(points, &trajectory, &head, &settings);
        assert!(set.len() > 100);
        set.normals.iter().map(|n| n.x).sum::<f64>() / set.len() as f64
    };
    assert!(tilt(0.0) > 5e-3, "{}", tilt(0.0));
    assert!(
        tilt(sigma).abs() < 0.2 * tilt(0.0),
        "{} {}",
        tilt(sigma),
        tilt(0.0)
    );
    Ok(())
}
