# SPDX-License-Identifier: MIT OR Apache-2.0
import hashlib
import json

import numpy as np
import pytest

from bentwing.base import provenance
from bentwing.base.atomic import write_text
from bentwing.base.calibration import Calibration
from bentwing.base.errors import EstimationError, UsageError
from bentwing.base.estimate import Estimate
from bentwing.base.mount import FixedMount, Pose
from bentwing.base.plain import plain
from bentwing.base.provenance import describe_input
from bentwing.base.run_record import read_record
from bentwing.base.trajectory import Trajectory
from bentwing.base.window_record import WindowRecord
from bentwing.run.folder import RunFolder
from bentwing.run.found import Found


def record_of(out):
    return json.loads((out / "run.json").read_text())


def estimate():
    trajectory = Trajectory(
        np.array([0.0, 0.01]), np.zeros((2, 3)), np.tile([0.0, 0, 0, 1], (2, 1))
    )
    mount = FixedMount(Pose(np.zeros(3), np.array([0, 0, 0, 1.0])))
    calibration = Calibration(
        0.002, mount, np.zeros(3), np.zeros(3), np.array([0, 0, 9.8]),
        std={"latency": [1e-5]},
    )  # fmt: skip
    window = WindowRecord(
        time=np.float64(1.0), n_surfels=9, n_matches=np.int64(7), inlier_share=None,
        residual_rms=np.nan, iterations=2, converged=True, degenerate=False,
    )  # fmt: skip
    return Estimate(trajectory, calibration, [window], {"used": 5}, {"solve": 1.5}, ["a warning"])


def test_a_run_that_ends_well_is_complete_and_names_its_files(tmp_path):
    out = tmp_path / "new" / "run"
    with RunFolder(out, {"estimator": "continuous"}) as run:
        assert record_of(out)["complete"] is False
        with run.stage("estimate"):
            run.record.found = Found(estimate())
        run.write_trajectory("trajectory.txt", estimate(), 0)
    record = record_of(out)
    assert (record["complete"], record["stage"], record["reason"]) == (True, "done", None)
    assert record["files"] == ["trajectory.txt"]
    assert record["settings"] == {"estimator": "continuous"}
    assert record["calibration"]["std"] == {"latency": [1e-5]}
    (window,) = record["windows"]
    assert (window["time"], window["n_matches"], window["residual_rms"]) == (1.0, 7, None)
    assert record["timings"]["estimate"] <= record["timings"]["total"]
    assert record["timings"]["estimate/solve"] == 1.5
    assert record["peak_memory_mb"] > 10
    assert {"bentwing", "python", "numpy", "platform"} <= set(record["versions"])


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (KeyboardInterrupt(), "interrupted"),
        (EstimationError("no matches at 12 s"), "no matches at 12 s"),
        (MemoryError(), "MemoryError"),
    ],
)
def test_a_run_that_stops_keeps_what_it_has_and_says_where_and_why(tmp_path, error, reason):
    def stopping():
        with RunFolder(tmp_path) as run:
            run.write_trajectory("odometry.txt", estimate(), 0)
            with run.stage("map"):
                run.file("map.laz")
                raise error

    with pytest.raises(type(error)):
        stopping()
    record = record_of(tmp_path)
    assert (record["complete"], record["stage"], record["reason"]) == (False, "map", reason)
    assert record["files"] == ["odometry.txt"]
    assert (tmp_path / "odometry.txt").exists()


def test_a_folder_with_foreign_files_is_refused_and_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(UsageError, match="not empty"), RunFolder(tmp_path):
        pass
    assert [file.name for file in tmp_path.iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize("content", ["{}", "not json", '{"kind": "other"}', "[]"])
def test_a_run_json_of_another_program_does_not_make_a_folder_ours(tmp_path, content):
    (tmp_path / "run.json").write_text(content)
    with pytest.raises(UsageError, match="not empty"), RunFolder(tmp_path):
        pass
    with pytest.raises(UsageError, match="holds no bentwing run"):
        read_record(tmp_path)


def test_a_file_in_the_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(UsageError, match="cannot be made"), RunFolder(tmp_path / "out"):
        pass


def run_with(out, *names, fail=False):
    with RunFolder(out) as run:
        for name in names:
            write_text(run.file(name), "new")
        if fail:
            raise EstimationError


def test_the_next_run_replaces_the_files_of_the_earlier_one(tmp_path):
    run_with(tmp_path, "trajectory.txt", "map.laz")
    (tmp_path / "notes.txt").write_text("by the user")
    (tmp_path / ".map.laz.partial").write_text("of a killed run")
    run_with(tmp_path, "trajectory.txt", "map.ply")
    names = {file.name for file in tmp_path.iterdir()}
    assert names == {"trajectory.txt", "map.ply", "run.json", "notes.txt"}


def test_files_of_an_earlier_run_stay_until_a_run_completes(tmp_path):
    run_with(tmp_path, "map.laz")
    for _ in range(2):
        with pytest.raises(EstimationError):
            run_with(tmp_path, "odometry.txt", fail=True)
        assert (tmp_path / "map.laz").exists()
        assert record_of(tmp_path)["files"] == ["odometry.txt"]
        assert record_of(tmp_path)["files_of_earlier_run"] == ["map.laz"]
    run_with(tmp_path, "map.ply")
    assert {file.name for file in tmp_path.iterdir()} == {"map.ply", "run.json"}


def test_a_record_cannot_make_a_run_delete_outside_its_folder(tmp_path):
    (tmp_path / "precious").write_text("")
    out = tmp_path / "run"
    run_with(out, "map.laz")
    record = record_of(out)
    record["files"] += ["../precious", "/etc/none", 3]
    (out / "run.json").write_text(json.dumps(record))
    run_with(out)
    assert (tmp_path / "precious").exists()


def test_inputs_are_named_with_size_and_hash(tmp_path, monkeypatch):
    content = bytes(range(256)) * 20_000
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "a.mcap").write_bytes(content)
    found = describe_input(tmp_path / "bag" / "a.mcap")
    assert found["sha256"] == hashlib.sha256(content).hexdigest()
    assert (found["name"], found["bytes"], found["hashed"]) == ("a.mcap", len(content), "all")
    monkeypatch.setattr(provenance, "FULL_HASH_LIMIT", 2**22)
    ends = hashlib.sha256(content[: 2**20] + content[-(2**20) :]).hexdigest()
    with RunFolder(tmp_path / "out") as run:
        run.add_inputs([tmp_path / "bag"])
    assert [(i["sha256"], i["hashed"]) for i in record_of(tmp_path / "out")["inputs"]] == [
        (ends, "first and last MiB")
    ]


def test_plain_makes_json_of_what_runs_hold(tmp_path):
    value = {"a": np.array([1.0, np.inf]), 2: (np.int64(3), tmp_path), "c": estimate().calibration}
    result = plain(value)
    assert result["a"] == [1.0, None]
    assert result["2"] == [3, str(tmp_path)]
    json.dumps(result, allow_nan=False)


def test_nothing_is_called_good_before_there_is_an_estimate():
    assert Found().to_json()["verdict"] is None
    assert Found(estimate()).to_json()["verdict"].state == "good"
