# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is true, and what the estimators are told: the files beside a simulated recording."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from bentwing.base import geometry
from bentwing.base.clock import format_ns
from bentwing.simulate.gnss import LEVER_ARM
from bentwing.simulate.imu import ImuErrors
from bentwing.simulate.ros import to_ns

if TYPE_CHECKING:
    from pathlib import Path
    from typing import TextIO

    from numpy.typing import NDArray

    from bentwing.simulate.rig import Rig
    from bentwing.simulate.scenario import Scenario
    from bentwing.simulate.scenes.mesh import Mesh
    from bentwing.simulate.setup import Setup

    Array = NDArray[np.float64]

IMU_TOPIC, ENCODER_TOPIC, FIX_TOPIC = "/imu", "/encoder", "/fix"


def write_yaml(path: Path, content: dict[str, Any]) -> None:
    """Write a small mapping, in its own order."""
    path.write_text(yaml.safe_dump(content, sort_keys=False, default_flow_style=None))


def write_poses(file: TextIO, rig: Rig, times: Array) -> None:
    """TUM lines `t x y z qx qy qz qw`: the IMU in the simulated world, at its own stamps."""
    motion = rig.imu(times)
    for time, p, q in zip(times, motion.p, geometry.from_matrices(motion.R), strict=True):
        pose = " ".join(f"{value:.9f}" for value in (*p, *q))
        file.write(f"{format_ns(to_ns(float(time)))} {pose}\n")


def write_ply(path: Path, mesh: Mesh) -> None:
    """Return the scene as a binary PLY mesh, double precision."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(mesh.vertices)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {len(mesh.triangles)}\n"
        "property list uchar uint vertex_indices\nend_header\n"
    )
    faces = np.empty(len(mesh.triangles), dtype=[("n", "u1"), ("corners", "<u4", 3)])
    faces["n"], faces["corners"] = 3, mesh.triangles
    vertices = np.ascontiguousarray(mesh.vertices, dtype="<f8")
    path.write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())


def payload(setup: Setup, scenario: Scenario) -> dict[str, Any]:
    """Return the head as its user believes it to be."""
    errors = scenario.imu_errors() if not scenario.noiseless else ImuErrors()
    gyro_noise, accel_noise = errors.densities()
    imu = {
        "topic": IMU_TOPIC,
        "gyro_noise": round(gyro_noise, 7),
        "accel_noise": round(accel_noise, 7),
        "gyro_bias_walk": errors.gyro_bias_walk,
        "accel_bias_walk": errors.accel_bias_walk,
    }
    head = dict(setup.rig.head.payload)
    described = {"name": f"simulated-{scenario.head}", "lidar": head.pop("lidar"), "imu": imu}
    if setup.sensors.receiver is not None:
        head["gnss"] = {"topic": FIX_TOPIC, "lever_arm": list(LEVER_ARM)}
    return {**described, **head}


def calibration(setup: Setup, first_biases: Array, last_biases: Array) -> dict[str, Any]:
    """Return what a perfect calibration would find."""
    biases = {
        when: {
            "gyro": [round(float(b), 9) for b in values[:3]],
            "accel": [round(float(b), 9) for b in values[3:]],
        }
        for when, values in (("start", first_biases), ("end", last_biases))
    }
    # A stamp τ of the lidar belongs to the IMU's time τ − latency.
    latency = round(setup.sensors.latency(), 9)
    return {"latency": latency, **setup.rig.head.truth, "imu_biases": biases}
