# SPDX-License-Identifier: MIT OR Apache-2.0
"""The folder a simulation leaves: recording, payload and truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bentwing.base.atomic import write_text
from bentwing.base.errors import UsageError
from bentwing.base.staged_folder import staged_folder
from bentwing.simulate.imu import RATE_HZ
from bentwing.simulate.records import (
    CloudRecord,
    EncoderRecord,
    FixRecord,
    ImuRecord,
    Record,
    ScanRecord,
)
from bentwing.simulate.ros import BagWriter
from bentwing.simulate.scenes.spheres import control_points
from bentwing.simulate.stream import ticks
from bentwing.simulate.truth import (
    ENCODER_TOPIC,
    FIX_TOPIC,
    IMU_TOPIC,
    calibration,
    payload,
    write_ply,
    write_poses,
    write_yaml,
)

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bentwing.simulate.rig import Rig
    from bentwing.simulate.scenario import Scenario
    from bentwing.simulate.setup import Setup

PAYLOAD = "payload.yaml"


@dataclass(frozen=True, slots=True)
class SimulatedRecording:
    """Where everything was written.

    Attributes
    ----------
    recording : ROS 1 bag file or ROS 2 bag folder
    payload : what the estimators are told about the head
    trajectory : truth, TUM, IMU frame, IMU clock
    scene : truth, triangle mesh
    calibration : truth, extrinsics, latency, biases
    scenario : what was asked for
    """

    recording: Path
    payload: Path
    trajectory: Path
    scene: Path
    calibration: Path
    scenario: Path


def write_recording(
    setup: Setup, scenario: Scenario, out: Path, progress: Callable[[float], None] | None
) -> SimulatedRecording:
    """Streams the setup's sensors into a bag and writes the truth beside it, all or nothing."""
    require_no_recording(out)
    final = _files(out, scenario.format)
    with staged_folder(out, final.recording.name) as stage:
        _write(setup, scenario, stage, progress)
    return final


def _write(
    setup: Setup, scenario: Scenario, out: Path, progress: Callable[[float], None] | None
) -> None:
    files = _files(out, scenario.format)
    write_yaml(files.scenario, scenario.model_dump(mode="json"))
    write_yaml(files.payload, payload(setup, scenario))
    write_ply(files.scene, setup.world.site.mesh)
    if setup.sensors.receiver is not None:
        write_yaml(out / "truth_georeference.yaml", setup.sensors.receiver.place.truth())
    spheres = setup.world.site.spheres
    if spheres:
        write_text(out / "truth_spheres.csv", control_points(spheres))
    biases = [setup.sensors.imu.biases_at(setup.first)]
    with BagWriter(files.recording, scenario.format) as bag, files.trajectory.open("w") as truth:
        for start, end, records in setup.sensors.stream(setup.first, setup.last):
            for record in records:
                bag.write(*_topic_and_frame(record, setup.rig), record)
            write_poses(truth, setup.rig, ticks(start, end, RATE_HZ))
            if progress:
                progress(end - setup.first)
    biases.append(setup.sensors.imu.biases_at(setup.last))
    write_yaml(files.calibration, calibration(setup, *biases))
    if setup.sensors.samples is not None:
        write_yaml(out / "truth_realism.yaml", setup.realism.truth())
        setup.sensors.samples.write(out / "truth_points.npy", setup.first)


def require_no_recording(out: Path) -> None:
    """Refuse a folder that holds a recording already."""
    for existing in (out / "recording.bag", out / "recording"):
        if existing.exists():
            msg = f"{existing} exists already: remove it or choose another output folder"
            raise UsageError(msg)


def _files(out: Path, kind: str) -> SimulatedRecording:
    recording = out / ("recording.bag" if kind == "bag" else "recording")
    return SimulatedRecording(
        recording=recording,
        payload=out / PAYLOAD,
        trajectory=out / "truth_trajectory.txt",
        scene=out / "truth_scene.ply",
        calibration=out / "truth_calibration.yaml",
        scenario=out / "scenario.yaml",
    )


def _topic_and_frame(record: Record, rig: Rig) -> tuple[str, str]:
    match record:
        case ImuRecord():
            return IMU_TOPIC, "imu"
        case EncoderRecord():
            return ENCODER_TOPIC, "motor"
        case FixRecord():
            return FIX_TOPIC, "gnss"
        case ScanRecord() | CloudRecord():
            return rig.head.lidar.topic, "lidar"
