# SPDX-License-Identifier: MIT OR Apache-2.0
import copy
import json
import pickle
from collections import Counter
from contextlib import suppress
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
import yaml

from bentwing import odometry
from bentwing.base.calibration import Calibration
from bentwing.base.errors import EstimationError, UsageError
from bentwing.base.estimate import Estimate
from bentwing.base.progress import Progress
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.calibrate import set_up
from bentwing.calibrate.inspection import Judgement
from bentwing.calibrate.set_up import SetUp
from bentwing.closing.global_registration import GlobalSettings
from bentwing.map.read import read_points
from bentwing.map.sample import MapSample
from bentwing.recording import Clock, ImuBatch, LidarBatch, Payload
from bentwing.recording.described import described_mount
from bentwing.run import head, pipeline
from bentwing.run.found import Spin
from bentwing.run.run import Run
from bentwing.run.settings import RunSettings, run_settings

ORIGIN_NS = 1_700_000_000_000_000_001
PAYLOAD = Payload.model_validate({"T_imu_lidar": {}})


class FakeRecording:
    """Ten seconds at rest, 100 points in every tenth of a second."""

    duration = 10.0
    warnings = ("/imu: a gap of 0.2 s",)
    clock = Clock(ORIGIN_NS)
    has_fixes = False
    clocks = MappingProxyType({})

    def __init__(self, paths, payload, *, strict):
        del payload, strict
        self.paths = [Path(path) for path in paths]
        self.counts = Counter({"lidar.points": 10_000})

    def close(self):
        pass

    def check(self):
        pass

    def batches(self, start=None, duration=None):
        rng = np.random.default_rng(0)
        begin = start or 0.0
        for t in np.arange(begin, begin + (duration or 10.0 - begin), 0.1):
            times = t + 0.001 * np.arange(100)
            yield ImuBatch(times, np.tile([0.0, 0.0, 4.0], (100, 1)), np.zeros((100, 3)))
            yield LidarBatch(rng.uniform(-5, 5, (100, 3)), times)


class FakeEstimator:
    settings = None
    current = None
    fail_at = np.inf

    def __init__(self):
        self.last = 0.0

    def feed(self, batch):
        self.last = batch.times[-1]
        if self.last > self.fail_at:
            raise EstimationError("no matches")

    def result(self):
        return self.so_far()

    def so_far(self):
        times = np.arange(0, self.last + 0.01, 0.01)
        trajectory = Trajectory(
            times, np.zeros((len(times), 3)), np.tile([0.0, 0, 0, 1], (len(times), 1))
        )
        calibration = Calibration(
            0.0,
            described_mount(PAYLOAD),
            np.zeros(3),
            np.zeros(3),
            np.array([0, 0, 9.8]),
        )
        return Estimate(trajectory, calibration, health=["one plane only at 3 s"])


@pytest.fixture
def recording(tmp_path, monkeypatch):
    monkeypatch.setattr(head, "Recording", FakeRecording)
    monkeypatch.setattr(head, "judge", lambda *_, **__: Judgement([], [], None, 1.0))
    monkeypatch.setattr(set_up, "find_set_up", lambda _, payload, *__, **___: SetUp(payload))
    monkeypatch.setattr(odometry, "create", lambda *_: FakeEstimator(), raising=False)
    (tmp_path / "yard.mcap").write_bytes(b"recording")
    return [tmp_path / "yard.mcap"]


def record_of(out):
    return json.loads((out / "run.json").read_text())


def test_a_run_leaves_all_files_of_the_contract(tmp_path, recording):
    out = tmp_path / "out"
    run = pipeline.map_recording(recording, PAYLOAD, out)
    names = {
        "trajectory.txt", "trajectory_covariance.txt", "odometry.txt", "map.laz", "map_top.png",
        "report.html", "run.json",
    }  # fmt: skip
    assert {file.name for file in out.iterdir()} == names
    counts = record_of(out)["counts"]
    assert (
        len(read_points(out / "map.laz")) == counts["map.written"] == len(read_points(run.map_path))
    )
    # points anywhere in the room have been seen through by some of the beams
    assert counts["map.written"] + counts["map.moving"] + counts["map.mixed_pixels"] == 10_000
    assert counts["map.moving"] < 500
    trajectory, origin_ns = read_tum(out / "trajectory.txt")
    assert origin_ns == ORIGIN_NS
    assert np.allclose(np.diff(trajectory.times), 0.01)
    record = record_of(out)
    assert record["complete"] is True
    assert record["counts"]["map.points"] == record["counts"]["lidar.points"] == 10_000
    assert record["warnings"] == ["/imu: a gap of 0.2 s", "one plane only at 3 s"]
    stages = {"inputs", "estimate", "beams", "loops", "map", "report", "total"}
    assert set(record["timings"]) == stages
    assert run.verdict.state == record["verdict"]["state"] == "failed"
    reasons = [reason["sentence"] for reason in record["verdict"]["reasons"]]
    assert any("the accelerations are all zero" in reason for reason in reasons)
    page = run.report_path.read_text()
    assert "Failed: this map is wrong, do not use it" in page
    assert all(warning in page for warning in run.warnings)
    assert run.warnings == ("/imu: a gap of 0.2 s", "one plane only at 3 s")


class Notes(Progress):
    def __init__(self):
        self.texts = []

    def note(self, text):
        self.texts.append(text)


@pytest.mark.parametrize("fail_at", [np.inf, 5.0])
def test_every_warning_of_a_run_is_said_once(tmp_path, recording, monkeypatch, fail_at):
    monkeypatch.setattr(FakeEstimator, "fail_at", fail_at)
    shown = Notes()
    with suppress(EstimationError):
        pipeline.map_recording(recording, PAYLOAD, tmp_path / "out", progress=shown)
    warnings = [text for text in shown.texts if text.startswith("warning: ")]
    assert warnings == ["warning: /imu: a gap of 0.2 s", "warning: one plane only at 3 s"]


def test_a_part_of_the_recording_and_a_spacing_can_be_asked_for(tmp_path, recording):
    out = tmp_path / "out"
    pipeline.map_recording(recording, PAYLOAD, out, duration=2.0, map_format="ply", map_spacing=5.0)
    assert len(read_points(out / "map.ply")) <= 8
    assert record_of(out)["counts"]["map.points"] == 2000


def test_a_failed_estimate_keeps_the_odometry_and_explains_itself(tmp_path, recording, monkeypatch):
    out = tmp_path / "out"
    pipeline.map_recording(recording, PAYLOAD, out)
    monkeypatch.setattr(FakeEstimator, "fail_at", 5.0)
    with pytest.raises(EstimationError, match="no matches"):
        pipeline.map_recording(recording, PAYLOAD, out)
    record = record_of(out)
    assert (record["complete"], record["stage"], record["reason"]) == (
        False,
        "estimate",
        "no matches",
    )
    assert record["files"] == ["odometry.txt", "report.html"]
    assert read_tum(out / "odometry.txt")[0].times[-1] == pytest.approx(5.0, abs=0.2)
    assert "Incomplete" in (out / "report.html").read_text()


def test_an_interrupt_between_two_statements_leaves_no_half_sample_of_the_spin(monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    spin, batch = Spin(), ImuBatch(np.arange(3.0), np.ones((3, 3)), np.zeros((3, 3)))
    monkeypatch.setattr(np, "median", interrupted)
    with pytest.raises(KeyboardInterrupt):
        spin.watch(batch)
    assert spin.series is None
    monkeypatch.undo()
    spin.watch(batch)
    assert [len(values) for values in spin.series] == [1, 1]


def test_an_interrupt_in_the_middle_of_a_step_is_an_interrupt(tmp_path, recording, monkeypatch):
    def half_done(*_):
        raise ValueError("times must increase")

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(FakeEstimator, "so_far", half_done)
    monkeypatch.setattr(FakeEstimator, "feed", interrupted)
    with pytest.raises(KeyboardInterrupt):
        pipeline.map_recording(recording, PAYLOAD, tmp_path / "out")
    assert record_of(tmp_path / "out")["reason"] == "interrupted"


def test_an_interrupt_while_mapping_leaves_the_trajectory_and_no_half_map(
    tmp_path, recording, monkeypatch
):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(MapSample, "add", interrupted)
    with pytest.raises(KeyboardInterrupt):
        pipeline.map_recording(recording, PAYLOAD, tmp_path / "out")
    record = record_of(tmp_path / "out")
    assert (record["stage"], record["reason"]) == ("map", "interrupted")
    found = ["odometry.txt", "trajectory.txt", "checkpoint.npz", "trajectory_covariance.txt"]
    assert record["files"] == [*found, "report.html"]
    assert {f.name for f in (tmp_path / "out").iterdir()} == {*record["files"], "run.json"}


@pytest.mark.parametrize("wrong", [{"map_format": "obj"}, {"estimator": "x"}])
def test_wrong_options_are_refused_before_anything_is_written(tmp_path, recording, wrong):
    with pytest.raises(UsageError):
        pipeline.map_recording(recording, PAYLOAD, tmp_path / "out", **wrong)
    assert not (tmp_path / "out").exists()


def test_a_finished_run_is_read_back_from_its_folder(tmp_path, recording):
    run = pipeline.map_recording(recording, PAYLOAD, tmp_path / "out")
    again = Run.load(tmp_path / "out")
    assert (again.out, again.warnings) == (run.out, run.warnings)
    assert (again.map_path, again.report_path) == (run.map_path, run.report_path)
    assert np.allclose(again.trajectory.positions, run.trajectory.positions, atol=1e-6)
    assert np.allclose(again.trajectory.times, run.trajectory.times, atol=1e-9)


def test_a_run_that_has_failed_is_not_read_as_a_run(tmp_path, recording, monkeypatch):
    monkeypatch.setattr(FakeEstimator, "fail_at", 5.0)
    with pytest.raises(EstimationError):
        pipeline.map_recording(recording, PAYLOAD, tmp_path / "out")
    with pytest.raises(UsageError, match="not complete"):
        Run.load(tmp_path / "out")


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"settings": {}}, "settings"),
        ({"progress": print}, "progress"),
        ({"payload": 3}, "payload"),
    ],
)
def test_arguments_of_a_wrong_type_are_refused_by_name(tmp_path, recording, wrong, named):
    arguments = {"payload": PAYLOAD, **wrong}
    with pytest.raises(TypeError, match=f"^{named}: expected"):
        pipeline.map_recording(recording, out=tmp_path / "out", **arguments)
    assert not (tmp_path / "out").exists()


def test_runs_are_copied_and_pickled(tmp_path, recording):
    run = pipeline.map_recording(recording, PAYLOAD, tmp_path / "out")
    for again in (copy.deepcopy(run), pickle.loads(pickle.dumps(run))):
        assert again.trajectory == run.trajectory
        assert again.map_path == run.map_path


def test_settings_of_a_file_are_those_of_the_run_and_arguments_stand_over_them(tmp_path, recording):
    file = tmp_path / "settings.yaml"
    file.write_text("map_format: ply\nmap_spacing: 5.0\ncontinuous: {window: 4}\n")
    pipeline.map_recording(recording, PAYLOAD, tmp_path / "out", settings=file, map_spacing=4.0)
    settings = record_of(tmp_path / "out")["settings"]
    assert (settings["map_format"], settings["map_spacing"]) == ("ply", 4.0)
    assert settings["continuous"]["window"] == 4


def test_settings_are_written_once_and_read_back_the_same(recording):
    del recording
    settings = run_settings(estimator="kalman", payload=PAYLOAD, map_spacing=0.1)
    text = settings.to_yaml()
    assert "T_imu_lidar" in text
    assert RunSettings.model_validate(yaml.safe_load(text)) == settings


@pytest.mark.parametrize(
    ("wrong", "named"),
    [({"map_spacing": -1.0}, "map_spacing"), ({"threads": 0}, "threads"), ({"x": 1}, "x")],
)
def test_settings_that_cannot_be_are_refused_by_name(wrong, named):
    with pytest.raises(UsageError, match=named):
        run_settings(**wrong)


def test_the_settings_of_the_closing_are_those_that_are_used(tmp_path, recording):
    closing = GlobalSettings(memory_mb=100.0)
    pipeline.run_recording(
        recording, tmp_path / "out", run_settings(payload=PAYLOAD, loop_closure=closing)
    )
    record = record_of(tmp_path / "out")
    assert record["settings"]["loop_closure"]["memory_mb"] == 100.0
    assert record["loop_closure"]["budget"]["megabytes"] <= 100.0


def test_without_a_map_the_run_ends_with_its_trajectory_and_says_so(tmp_path, recording):
    whole = pipeline.map_recording(recording, PAYLOAD, tmp_path / "whole")
    run = pipeline.map_recording(recording, PAYLOAD, tmp_path / "out", write_map=False)
    names = {file.name for file in run.out.iterdir()}
    assert names == {
        "trajectory.txt",
        "trajectory_covariance.txt",
        "odometry.txt",
        "report.html",
        "run.json",
    }
    for name in ("trajectory.txt", "trajectory_covariance.txt", "odometry.txt"):
        assert (run.out / name).read_bytes() == (whole.out / name).read_bytes()
    record = record_of(run.out)
    assert record["complete"] is True
    assert record["map"] == {}
    assert not any(name.startswith("map.") for name in record["counts"])
    assert "map" not in record["timings"]
    assert record["expected_accuracy"]["map_thickness"] is None
    page = run.report_path.read_text()
    assert "No map was asked for" in page
    assert "Expected accuracy" in page
    assert "surfaces as measured scatter" not in page
    assert run.map_path is Run.load(run.out).map_path is None


def test_a_recording_is_decoded_once_for_all_stages(tmp_path, recording, monkeypatch):
    n_passes = []
    decoded = FakeRecording.batches

    def counted(*arguments, **options):
        n_passes.append(arguments)
        return decoded(*arguments, **options)

    monkeypatch.setattr(FakeRecording, "batches", counted)
    # its accelerations are zero, so that otherwise the head is looked for
    pipeline.map_recording(recording, PAYLOAD, tmp_path / "out", trust_payload=True)
    assert len(n_passes) == 1
