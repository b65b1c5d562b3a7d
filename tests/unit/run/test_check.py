# SPDX-License-Identifier: MIT OR Apache-2.0
"""What `map` refuses before it estimates anything, and that `info` says the same."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base.errors import BentwingError, InputError, RecordingError, UsageError
from bentwing.base.progress import Progress
from bentwing.calibrate.inspection import inspect
from bentwing.recording import Payload
from bentwing.run import pipeline
from bentwing.run.check import opened
from bentwing.run.flights import map_flights
from bentwing.run.settings import run_settings

HEAD = Payload(T_imu_lidar={})
GOOD = (
    ("office", 22.0, "hokuyo-spin", 0),
    ("office", 12.0, "hokuyo-nod", 2),
    ("courtyard", 22.0, "vlp16-fixed", 0),
    ("office", 22.0, "vlp16-motor", 0),
)


def refusal(paths, payload):
    """What `map` says to a recording, None where it would map it."""
    try:
        with opened(paths, run_settings(payload=payload), Progress()):
            return None
    except RecordingError as error:
        return str(error)


@pytest.fixture(params=["good", "in g", "no beam times", "no return", "no IMU", "level"])
def head(request, tmp_path, ros1, head_entries):
    """Return a spinning 2D head, and such heads with one thing wrong."""
    wrong, entries = request.param, []
    for topic, t, message in head_entries(ros1):
        if topic == "/imu":
            if wrong == "no IMU":
                continue
            if wrong == "in g":
                message.linear_acceleration.x /= 9.81
                message.linear_acceleration.z /= 9.81
            if wrong == "level":
                message.linear_acceleration.x, message.linear_acceleration.z = 0.0, 9.81
        elif wrong == "no beam times":
            message.time_increment = message.angle_increment = 0.0
        elif wrong == "no return":
            message.ranges = np.full(100, np.inf, np.float32)
        entries.append((topic, t, message))
    payload = Payload() if wrong == "no IMU" else HEAD
    return wrong, ros1.write(tmp_path / "head.bag", entries), payload


def test_a_head_is_refused_if_and_only_if_info_calls_it_unfit(head):
    wrong, path, payload = head
    found, said = inspect(path, payload), refusal(path, payload)
    assert found.is_fit == (wrong == "good")
    if found.is_fit:
        assert said is None
    else:
        assert said.startswith(found.defects[0])
        assert "--force" in said


@pytest.mark.parametrize(("scene", "duration", "kind", "seed"), GOOD)
def test_good_flights_are_fit_and_not_refused(simulated, scene, duration, kind, seed):
    folder = simulated(scene, duration, head=kind, seed=seed)
    path, payload = folder / "recording.bag", Payload.load(folder / "payload.yaml")
    assert inspect(path, payload).defects == []
    assert refusal(path, payload) is None


@pytest.mark.parametrize(
    ("name", "is_fit"),
    [
        ("drive_hdl64/start_16m.bag", True),
        pytest.param("garage_hdl32.bag", True, marks=pytest.mark.slow),
        ("planar_rover/loop2", False),
        ("packets/ouster_os1_64.mcap", False),
    ],
)
def test_real_recordings_are_judged_alike_by_info_and_map(shared_data, name, is_fit):
    # Without the IMU of the rover and the Ouster, which a payload would have to place.
    payload = None if is_fit else HEAD
    assert inspect(shared_data / name, payload).is_fit == is_fit
    said = refusal(shared_data / name, payload or Payload())
    assert (said is None) == is_fit


def test_force_opens_what_is_unfit(tmp_path, ros1):
    scans = [("/scan", i / 40, ros1.scan(i / 40)) for i in range(40)]
    path = ros1.write(tmp_path / "2d.bag", scans)
    assert "without IMU and encoder" in refusal(path, Payload())
    with opened(path, run_settings(payload=Payload(), force=True), Progress()) as head:
        assert head.recording.lidar_topic == "/scan"


@pytest.fixture
def no_estimate(monkeypatch):
    """Fail where an estimate is begun."""

    def begun(*_):
        raise AssertionError("an estimate was begun")

    monkeypatch.setattr(pipeline, "estimate", begun)


@pytest.mark.usefixtures("no_estimate")
@pytest.mark.parametrize(
    ("values", "kind", "part"),
    [
        ({"map_spacing": -1.0}, UsageError, "map_spacing"),
        ({"start": 500.0}, UsageError, "--start 500 lies behind the end"),
        ({"georeferencing": {"epsg": 4326}}, UsageError, "not projected"),
        ({"georeferencing": {"epsg": 32632}}, UsageError, "--epsg 32632 has no effect"),
        ({"georeferencing": {"mode": "constraints"}}, UsageError, "constraints has no effect"),
        ({"georeferencing": {"control_points": "none.csv"}}, InputError, "none.csv: cannot be"),
    ],
)
def test_settings_that_cannot_be_used_are_refused_before_the_estimate(
    tmp_path, ros1, head_entries, values, kind, part
):
    path = ros1.write(tmp_path / "head.bag", head_entries(ros1))
    with pytest.raises(kind, match=part):
        pipeline.map_recording(path, HEAD, tmp_path / "out", **values)
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("no_estimate")
def test_control_points_without_a_row_are_refused_before_the_estimate(tmp_path, ros1, head_entries):
    path = ros1.write(tmp_path / "head.bag", head_entries(ros1))
    marks = tmp_path / "marks.csv"
    marks.write_text("id,x,y,z,radius\n")
    with pytest.raises(InputError, match="holds no point"):
        pipeline.map_recording(
            path, HEAD, tmp_path / "out", georeferencing={"control_points": marks}
        )
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("no_estimate")
def test_no_flight_is_mapped_where_the_payload_fits_another_one_only(tmp_path, ros1, head_entries):
    first = ros1.write(tmp_path / "a.bag", head_entries(ros1))
    scans = [entry for entry in head_entries(ros1) if entry[0] == "/scan"]
    second = ros1.write(tmp_path / "b.bag", scans)
    with pytest.raises(BentwingError, match="describes an IMU"):
        map_flights([[first], [second]], tmp_path / "out", run_settings(payload=HEAD))
    assert not (tmp_path / "out").exists()


def test_a_folder_of_a_run_is_not_touched_by_a_refused_one(tmp_path, ros1):
    scans = [("/scan", i / 40, ros1.scan(i / 40)) for i in range(40)]
    path, out = ros1.write(tmp_path / "2d.bag", scans), tmp_path / "out"
    out.mkdir()
    (out / "run.json").write_text("{}")
    with pytest.raises(RecordingError, match="give --force"):
        pipeline.map_recording(path, Payload(), out)
    assert [file.name for file in out.iterdir()] == ["run.json"]
    assert (out / "run.json").read_text() == "{}"
