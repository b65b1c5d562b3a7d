# SPDX-License-Identifier: MIT OR Apache-2.0
import hashlib
import json
import os
import platform

import numpy as np
import pytest

from bentwing.base import provenance
from bentwing.base.atomic import write_text
from bentwing.base.calibration import Calibration
from bentwing.base.errors import EstimationError, InputError, UsageError
from bentwing.base.estimate import Estimate
from bentwing.base.mount import FixedMount, Pose
from bentwing.base.plain import plain
from bentwing.base.provenance import describe_input
from bentwing.base.run_record import finished_record, read_record
from bentwing.base.trajectory import Trajectory
from bentwing.base.window_record import WindowRecord
from bentwing.evaluate.folder import EvaluationFolder
from bentwing.run.folder import RunFolder
from bentwing.run.found import Found
from bentwing.run.run import Run


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


def test_nothing_of_an_earlier_run_is_there_once_the_next_begins(tmp_path):
    run_with(tmp_path, "map.laz", "trajectory.txt")
    about = tmp_path / "evaluation"
    with EvaluationFolder(about) as folder:
        write_text(folder.file("figure.png"), "of the earlier run")
        folder.complete([], {})
    with pytest.raises(EstimationError):
        run_with(tmp_path, "odometry.txt", fail=True)
    assert {file.name for file in tmp_path.iterdir()} == {"odometry.txt", "run.json"}


def test_what_a_resumed_run_does_not_go_on_with_is_removed(tmp_path):
    with pytest.raises(EstimationError):
        run_with(tmp_path, "odometry.txt", "map.laz", fail=True)
    with RunFolder(tmp_path, resume=True) as run:
        assert (tmp_path / "map.laz").exists()
        run.file("odometry.txt")
        run.remove_earlier()
        assert {f.name for f in tmp_path.glob("[!.]*")} == {"odometry.txt", "run.json"}


def test_two_processes_cannot_write_into_one_folder(tmp_path):
    with (
        RunFolder(tmp_path),
        pytest.raises(UsageError, match=rf"process {os.getpid()} on .* is writing there"),
        RunFolder(tmp_path),
    ):
        pass
    run_with(tmp_path, "map.laz")


def test_a_lock_that_a_killed_process_left_does_not_keep_others_out(tmp_path):
    holder = {"process": 1, "host": platform.node(), "since": "2020"}
    (tmp_path / ".bentwing.lock").write_text(json.dumps(holder))
    run_with(tmp_path, "map.laz")
    assert {file.name for file in tmp_path.iterdir()} == {"map.laz", "run.json"}


def test_a_lock_of_another_host_is_named_with_what_to_do(tmp_path):
    holder = {"process": 7, "host": "elsewhere", "since": "2020"}
    (tmp_path / ".bentwing.lock").write_text(json.dumps(holder))
    with pytest.raises(UsageError, match=r"process 7 on elsewhere .* remove .*lock"):
        run_with(tmp_path, "map.laz")


def test_an_input_is_not_removed_with_an_earlier_run(tmp_path):
    run_with(tmp_path, "map.laz")
    with pytest.raises(UsageError, match="is read"), RunFolder(tmp_path, inputs=[tmp_path]):
        pass
    assert (tmp_path / "map.laz").exists()


@pytest.mark.parametrize("change", ["other bytes", None])
def test_a_run_whose_input_changed_meanwhile_is_not_complete(tmp_path, change):
    given, out = tmp_path / "payload.yaml", tmp_path / "run"
    given.write_text("first bytes")

    def changing():
        with RunFolder(out) as run:
            run.add_inputs([given])
            given.unlink() if change is None else given.write_text(change)

    with pytest.raises(InputError, match=r"payload\.yaml: (has changed|cannot be read)"):
        changing()
    assert record_of(out)["complete"] is False
    assert "payload.yaml" in record_of(out)["reason"]


def test_only_a_complete_run_with_its_own_files_is_read(tmp_path):
    with pytest.raises(EstimationError):
        run_with(tmp_path, "map.laz", fail=True)
    with pytest.raises(UsageError, match="not complete"):
        finished_record(tmp_path)
    run_with(tmp_path, "map.laz")
    assert finished_record(tmp_path)["files"] == ["map.laz"]
    (tmp_path / "map.laz").write_text("of another run")
    with pytest.raises(InputError, match=r"map\.laz: is not the file that the run wrote"):
        finished_record(tmp_path)


@pytest.mark.parametrize(
    "value", [None, 3, "text", [], [1], {}, {"a": 1}, -1e300, 10**40, [[1, 2, 3]], [[None, 1]]]
)
@pytest.mark.parametrize(
    "key",
    ["files", "hashes", "segments", "start_ns", "windows", "calibration", "warnings", "settings"],
)
def test_a_damaged_record_is_refused_in_a_sentence(tmp_path, key, value):
    with RunFolder(tmp_path) as run:
        run.record.found = Found(estimate())
        run.record.start_ns = 0
        run.write_trajectory("trajectory.txt", estimate(), 0)
        write_text(run.file("map.ply"), "")
    record = record_of(tmp_path)
    (tmp_path / "run.json").write_text(json.dumps({**record, key: value}))
    try:
        loaded = Run.load(tmp_path)
    except (InputError, UsageError) as error:
        said = str(error)
    else:
        said = str(loaded.out)
    assert str(tmp_path) in said


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
    starts = [(len(content) - 2**20) * k // 65 for k in range(66)]
    parts = b"".join(content[start : start + 2**20] for start in starts)
    sampled = hashlib.sha256(parts).hexdigest()
    with RunFolder(tmp_path / "out") as run:
        run.add_inputs([tmp_path / "bag"])
    assert [(i["sha256"], i["hashed"]) for i in record_of(tmp_path / "out")["inputs"]] == [
        (sampled, "66 blocks of 1 MiB")
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
