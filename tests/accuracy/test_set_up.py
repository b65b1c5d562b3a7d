# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether the set-up of a head is found: good flights, and the same with one thing wrong."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.calibrate.draft import draft_payload
from bentwing.calibrate.set_up import find_set_up
from bentwing.calibrate.set_up.axes import angle_between
from bentwing.evaluate.simulated import score
from bentwing.recording import Payload
from bentwing.run.pipeline import map_recording
from bentwing.simulate.faults import with_fault

HEADS = ("hokuyo-spin", "hokuyo-nod", "vlp16-fixed", "vlp16-motor")
FAULTS = {
    "mount-90-y": "mount",
    "mount-random": "mount",
    "gyro-one-negated": "axes",
    "gyro-negated": "axes",
    "accel-cyclic": "axes",
    "imu-left-handed": "axes",
    "gyro-degrees": "units",
    "accel-g": "units",
    "ranges-millimetres": "ranges",
    "lidar-late-0.5": "latency",
    "lidar-early-1": "latency",
    "imu-power-on": "clock",
    "lidar-mirrored": "mirrored",
}
ENCODER = ("encoder-degrees", "encoder-negated", "encoder-turned", "encoder-axis", "encoder-second")


@pytest.fixture
def faulted(simulated, tmp_path):
    """Return a maker of a flight with one thing wrong: recording and payload."""

    def make(head, fault):
        folder = simulated("office", 22.0, head=head)
        return with_fault(
            folder / "recording.bag", folder / "payload.yaml", fault, tmp_path, seed=3
        )

    return make


@pytest.mark.parametrize(
    "head", ["hokuyo-spin", *(pytest.param(head, marks=pytest.mark.slow) for head in HEADS[1:])]
)
def test_a_head_that_is_as_described_stays_so(simulated, head):
    folder = simulated("office", 22.0, head=head)
    found = find_set_up([folder / "recording.bag"], Payload.load(folder / "payload.yaml"))
    assert (found.doubt, found.findings) == (None, ())


@pytest.mark.slow
@pytest.mark.parametrize("seed", [331, 6301])
def test_the_search_goes_on_behind_a_set_up_that_fits_for_some_seconds_only(
    simulated, tmp_path, seed
):
    """In 331 a gyro with two axes negated explains six seconds as well as the mount does, in 6301 other axes all
    but the forces."""
    folder = simulated("office", 24.0, seed=seed)
    recording, payload = with_fault(
        folder / "recording.bag", folder / "payload.yaml", "mount-180-z", tmp_path, seed=3
    )
    found = find_set_up([recording], Payload.load(payload))
    assert found.doubt is None
    assert {finding.kind for finding in found.findings} == {"mount"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "finding", "doubt"),
    [("gyro-swapped", ["axes"], None), ("accel-negated", [], "half a turn about the normal")],
)
def test_a_set_up_that_nearly_fits_six_seconds_is_tried_for_longer(
    simulated, tmp_path, fault, finding, doubt
):
    """The six seconds of this flight that turn most begin in a turn: of a right description 0.946 agrees there."""
    folder = simulated("office", 24.0, seed=6625)
    recording, payload = with_fault(
        folder / "recording.bag", folder / "payload.yaml", fault, tmp_path, seed=3
    )
    found = find_set_up([recording], Payload.load(payload))
    assert [one.kind for one in found.findings] == finding
    assert found.doubt is None if doubt is None else doubt in found.doubt


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "fault", "axes", "gyro_axes"),
    [
        (6622, "gyro-one-negated", ("x", "y", "z"), ("x", "-y", "z")),
        (6641, "accel-swapped", ("y", "x", "z"), ("x", "y", "z")),
    ],
)
def test_axes_that_forces_hardly_tell_are_told_by_what_is_seen(
    simulated, tmp_path, seed, fault, axes, gyro_axes
):
    """The right axes of the accelerometer leave 0.7 of the forces that those of the gyro leave, with which in 6641
    what is seen agrees, but strains the accelerometer."""
    folder = simulated("office", 24.0, head="vlp16-motor", seed=seed)
    recording, payload = with_fault(
        folder / "recording.bag", folder / "payload.yaml", fault, tmp_path, seed=3
    )
    found = find_set_up([recording], Payload.load(payload))
    assert found.doubt is None
    assert (found.payload.imu.axes, found.payload.imu.gyro_axes) == (axes, gyro_axes)


@pytest.mark.slow
def test_a_head_that_spins_evenly_above_level_ground_needs_no_payload(simulated):
    """Its scans come back alike after each turn, and whole families of mounts agree at their crossings."""
    folder = simulated("courtyard", 75.0, seed=131)
    paths = [folder / "recording.bag"]
    found = find_set_up(paths, draft_payload(paths).payload)
    assert found.doubt is None
    assert found.payload.lidar.latency == pytest.approx(0.003, abs=0.005)
    true = Payload.load(folder / "payload.yaml").T_imu_lidar
    assert angle_between(found.payload.T_imu_lidar.pose.R, true.pose.R) < np.radians(3.0)


@pytest.mark.parametrize(
    ("head", "fault"),
    [
        ("vlp16-fixed", "mount-90-y"),
        ("hokuyo-spin", "lidar-early-1"),
        *(
            pytest.param(head, fault, marks=pytest.mark.slow)
            for head in HEADS
            for fault in FAULTS
            # A plane is its own mirror image.
            if not (fault in {"lidar-mirrored", "gyro-negated"} and head.startswith("hokuyo"))
        ),
        *(pytest.param("vlp16-motor", fault, marks=pytest.mark.slow) for fault in ENCODER),
    ],
)
def test_what_is_wrong_is_found_and_named(faulted, head, fault):
    recording, payload = faulted(head, fault)
    found = find_set_up([recording], Payload.load(payload))
    assert found.doubt is None
    assert FAULTS.get(fault, "encoder") in {finding.kind for finding in found.findings}


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("mount-180-x", ("half a turn about the normal", "accelerometer are negated")),
        pytest.param(
            "gyro-negated", ("gyro are negated", "across the scan plane"), marks=pytest.mark.slow
        ),
    ],
)
def test_mirror_images_that_a_2d_lidar_cannot_tell_apart_are_both_named(faulted, fault, words):
    # About the x axis of the IMU, which is the normal of the scans.
    recording, payload = faulted("hokuyo-spin", fault)
    doubt = find_set_up([recording], Payload.load(payload)).doubt
    assert all(part in doubt for part in words)


def test_an_answer_to_such_a_question_is_believed(faulted):
    recording, payload = faulted("hokuyo-spin", "accel-negated")
    described = Payload.load(payload)
    told = {"axes": ("-x", "-y", "-z"), "gyro_axes": ("x", "y", "z")}
    answered = described.model_copy(update={"imu": described.imu.model_copy(update=told)})
    found = find_set_up([recording], answered)
    assert (found.doubt, found.findings) == (None, ())


@pytest.mark.parametrize(
    ("head", "fault", "words"),
    [
        ("vlp16-fixed", "gyro-zero", "gyro shows the same"),
        ("vlp16-fixed", "accel-no-gravity", "gravity"),
    ],
)
def test_what_cannot_be_put_right_is_named(faulted, head, fault, words):
    recording, payload = faulted(head, fault)
    found = find_set_up([recording], Payload.load(payload))
    assert found.is_defect
    assert words in found.doubt


@pytest.mark.parametrize(
    ("head", "fault", "scale", "pattern"),
    [
        ("vlp16-fixed", "gyro-1.2", 1.2, r"gyro shows ([\d.]+) times"),
        ("hokuyo-spin", "ranges-1.3", 1.3, r"ranges are about ([\d.]+) times"),
        *(
            pytest.param(head, "gyro-1.2", 1.2, r"about ([\d.]+) times", marks=pytest.mark.slow)
            for head in ("hokuyo-spin", "hokuyo-nod")
        ),
    ],
)
def test_a_wrong_scale_is_named_with_its_figure(faulted, head, fault, scale, pattern):
    recording, payload = faulted(head, fault)
    found = find_set_up([recording], Payload.load(payload))
    assert found.is_defect
    assert float(re.search(pattern, found.doubt)[1]) == pytest.approx(scale, rel=0.03)


@pytest.mark.parametrize(
    "head",
    ["hokuyo-spin", *(pytest.param(head, marks=pytest.mark.slow) for head in HEADS[1:])],
)
def test_no_payload_is_needed(simulated, tmp_path, head):
    folder = simulated("office", 22.0, head=head)
    run = map_recording(folder / "recording.bag", None, tmp_path / "run", map_spacing=0.05)
    assert run.verdict.state == "good"
    assert score(folder, tmp_path / "run").ate < 0.006
    said = json.loads((tmp_path / "run/run.json").read_text())["set_up"]
    assert any("mirror image" in finding["sentence"] for finding in said)
    mount = run.estimate.calibration.mount
    if head == "vlp16-motor":
        # Which turn of the motor is its zero nobody can tell.
        return
    true = Payload.load(folder / "payload.yaml").T_imu_lidar.pose
    turn = geometry.multiply(geometry.inverse(true.quaternion), mount.T_imu_lidar.quaternion)
    assert np.degrees(np.linalg.norm(geometry.log(turn[None]))) < 1.5


def test_a_draft_knows_no_mount(simulated):
    folder = simulated("office", 22.0, head="vlp16-fixed")
    assert not draft_payload(folder / "recording.bag").payload.places_lidar_on_imu
