# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing evaluate` as a user runs it: what comes out, and what is said when nothing can."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.evaluate.alignment import Alignment
from bentwing.map.chunk import MapChunk
from bentwing.map.read import read_points
from bentwing.map.writer import open_map

ORIGIN = 1_700_000_000_000_000_000
TRAJECTORY_FIGURES = {
    "trajectory_differences.svg", "trajectory_over_time.svg", "trajectory_over_speed.svg",
    "drift_translation.svg", "drift_rotation.svg",
}  # fmt: skip


def circling():
    t = np.arange(0, 60, 0.05)
    p = np.stack([5 * np.cos(0.3 * t), 5 * np.sin(0.3 * t), 1 + 0.5 * np.sin(0.9 * t)], axis=1)
    p *= (1.2 + np.sin(0.17 * t))[:, None]
    turns = np.stack([0.2 * np.sin(t), 0.2 * np.cos(0.7 * t), 0 * t], axis=1)
    yaw = geometry.exp(np.stack([0 * t, 0 * t, 0.8 * t], axis=1))
    return Trajectory(t, p, geometry.multiply(yaw, geometry.exp(turns)))


@pytest.fixture
def run_folder(tmp_path):
    """A run of another program: an estimate with some error, its open loop, and a small map."""
    truth, rng = circling(), np.random.default_rng(0)
    walk = np.cumsum(rng.normal(0, 1e-3, truth.positions.shape), axis=0)
    out = tmp_path / "run"
    out.mkdir()
    for name, scale in (("trajectory.txt", 0.3), ("odometry.txt", 1.0)):
        moved = Trajectory(truth.times, truth.positions + scale * walk, truth.quats_xyzw)
        moved.write_tum(out / name, ORIGIN)
    truth.write_tum(tmp_path / "truth.txt", ORIGIN)
    for path, noise in ((out / "map.ply", 0.005), (tmp_path / "scan.ply", 0.0)):
        points = rng.uniform(0, 6, (30_000, 3))
        side = rng.integers(0, 3, len(points))
        points[np.arange(len(points)), side] = rng.normal(0, noise, len(points)) if noise else 0.0
        points += 0.3  # off the faces of the cubes that the measures cut maps into
        times = np.where(rng.uniform(size=len(points)) < 0.5, 1.0, 50.0) + rng.uniform(
            0, 1, len(points)
        )
        with open_map(path, "ply", ORIGIN) as writer:
            writer.write(MapChunk(points, times, np.ones(len(points), np.float32)))
    return out


def record_of(out):
    return json.loads((out / "evaluation.json").read_text())


def test_a_run_is_compared_with_both_references(bentwing, run_folder):
    references = ("--reference-trajectory", run_folder.parent / "truth.txt",
                  "--reference-map", run_folder.parent / "scan.ply")  # fmt: skip
    done = bentwing("evaluate", run_folder, *references)
    assert done.code == 0, done.err
    out = run_folder / "evaluation"
    record = record_of(out)
    assert record["complete"]
    assert len(record["inputs"]) == 5
    assert record["map"]["robust_std"] == pytest.approx(0.005, rel=0.15)
    assert record["drift"]["trajectory"] == "odometry"
    assert record["drift"]["against"] == "reference"
    assert record["revisits"]["n_patches"] > 50
    assert set(record["files"]) > TRAJECTORY_FIGURES | {"map_error.svg", "map_error.ply"}
    assert {path.name for path in out.iterdir()} == {*record["files"], "evaluation.json"}
    for name in record["files"]:
        if name.endswith(".svg"):
            ET.fromstring((out / name).read_text())
    assert len(read_points(out / "map_error.ply")) == record["map"]["n_measured"]
    for word in ("ATE", "RPE", "completeness", "clock offset", "mm/m", "point spacing"):
        assert word in done.out


def test_numbers_are_those_of_evo_on_the_same_files(bentwing, run_folder, tmp_path):
    pytest.importorskip("evo", reason="evo is not installed")
    from evo.core import metrics, sync
    from evo.tools import file_interface

    truth, estimate = tmp_path / "truth.txt", run_folder / "trajectory.txt"
    done = bentwing(
        "evaluate", estimate, "--reference-trajectory", truth, "-o", tmp_path / "out", "--quiet"
    )
    assert (done.code, done.out) == (0, "")
    found = record_of(tmp_path / "out")["trajectory"]
    reference, theirs = sync.associate_trajectories(
        *(file_interface.read_tum_trajectory_file(path) for path in (truth, estimate))
    )
    theirs.align(reference)
    ape = metrics.APE(metrics.PoseRelation.translation_part)
    ape.process_data((reference, theirs))
    rpe = metrics.RPE(
        metrics.PoseRelation.translation_part, 1.0, metrics.Unit.meters, pairs_from_reference=True
    )
    rpe.process_data((reference, theirs))
    assert found["absolute"]["rmse"] == pytest.approx(ape.get_all_statistics()["rmse"], rel=1e-6)
    assert found["relative"][0]["translation"]["rmse"] == pytest.approx(
        rpe.get_all_statistics()["rmse"], rel=1e-6
    )


def test_errors_without_alignment_stand_beside_the_aligned_ones(bentwing, run_folder, tmp_path):
    """The estimate moved by (1, 2, 0.5) m: aligned it is as good as before, as it stands it is off."""
    poses, start = Trajectory.read_tum(run_folder / "trajectory.txt")
    moved = Trajectory(poses.times, poses.positions + np.array([1.0, 2.0, 0.5]), poses.quats_xyzw)
    moved.write_tum(tmp_path / "moved.txt", start)
    truth = ("--reference-trajectory", run_folder / "trajectory.txt")
    done = bentwing("evaluate", tmp_path / "moved.txt", *truth, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    found = record_of(tmp_path / "out")["trajectory"]
    assert found["absolute"]["rmse"] < 1e-4
    assert found["unaligned"]["position"]["rmse"] == pytest.approx(5.25**0.5, abs=1e-4)
    assert found["unaligned"]["axes"]["y"]["mean"] == pytest.approx(2.0, abs=1e-4)
    assert "without alignment" in done.out
    page = (tmp_path / "out" / "evaluation.html").read_text()
    assert "2.29 m" in page
    assert page.count("<figure") == len(list((tmp_path / "out").glob("*.svg")))


def test_several_runs_make_a_table(bentwing, run_folder, tmp_path):
    """A row each, in the terminal and as CSV, JSON and HTML; what one cannot answer is empty."""
    truth = run_folder.parent / "truth.txt"
    lone = tmp_path / "lone.txt"
    lone.write_bytes((run_folder / "trajectory.txt").read_bytes())
    out = tmp_path / "out"
    done = bentwing(
        "evaluate", run_folder, lone, tmp_path / "gone", "--table",
        "--reference-trajectory", truth, "-o", out,
    )  # fmt: skip
    assert done.code == 0, done.err
    assert "gone" in done.err
    rows = list(csv.DictReader((out / "table.csv").read_text().splitlines()))
    assert [row["run"] for row in rows] == [run_folder.name, "lone.txt", "gone"]
    one = record_of(out / run_folder.name)
    assert float(rows[0]["ate_rmse_m"]) == one["trajectory"]["absolute"]["rmse"]
    assert float(rows[0]["thickness_median_m"]) == one["thickness"]["median"]
    assert rows[1]["ate_rmse_m"] == rows[0]["ate_rmse_m"]
    assert rows[1]["thickness_median_m"] == rows[2]["ate_rmse_m"] == ""
    listed = json.loads((out / "table.json").read_text())
    assert listed[2]["ate_rmse_m"] is None
    assert [set(row) for row in listed] == [set(rows[0])] * 3
    assert "lone.txt" in (out / "table.html").read_text()
    assert "thickness" in done.out
    assert "\u2026" not in done.out  # no number is cut


@pytest.mark.parametrize(
    ("arguments", "says"),
    [([], "--table"), (["--table"], "-o OUT"), (["--table", "-o", "x"], "name of several")],
)
def test_several_runs_need_a_table_a_folder_and_names(bentwing, run_folder, tmp_path, monkeypatch, arguments, says):  # fmt: skip
    monkeypatch.chdir(tmp_path)
    other = tmp_path / "other" / run_folder.name
    done = bentwing("evaluate", run_folder, other, *arguments)
    assert done.code == 2
    assert says in done.err


def test_where_no_run_can_be_evaluated_it_fails(bentwing, tmp_path):
    done = bentwing("evaluate", tmp_path / "a", tmp_path / "b", "--table", "-o", tmp_path / "out")
    assert done.code == 2
    assert "does not exist" in done.err


def test_open_and_closed_loop_are_compared_without_any_reference(bentwing, run_folder):
    assert bentwing("evaluate", run_folder).code == 0
    record = record_of(run_folder / "evaluation")
    assert record["trajectory"] is None
    assert record["map"] is None
    assert (record["drift"]["trajectory"], record["drift"]["against"]) == ("odometry", "trajectory")
    assert record["thickness"]["median"] == pytest.approx(0.005, rel=0.2)


def test_a_total_station_as_csv_is_matched_in_time_and_place(bentwing, run_folder, tmp_path):
    truth = circling()
    arm, at = np.array([0.1, 0.0, -0.2]), np.arange(3, 55, 0.13)
    points = geometry.compose(*truth.interpolate(at), arm)
    elsewhere = Alignment(
        geometry.to_matrices(geometry.exp(np.array([0, 0, 1.0]))), np.full(3, 50.0)
    )
    rows = zip(at + 1000, points @ elsewhere.R.T + elsewhere.t, strict=True)
    path = tmp_path / "prism.csv"
    path.write_text(
        "t,x,y,z\n" + "".join(f"{t:.4f},{x:.4f},{y:.4f},{z:.4f}\n" for t, (x, y, z) in rows)
    )
    done = bentwing(
        "evaluate",
        run_folder / "trajectory.txt",
        "--reference-trajectory",
        path,
        "-o",
        tmp_path / "out",
    )
    assert done.code == 0, done.err
    point = record_of(tmp_path / "out")["trajectory"]["tracked_point"]
    assert point["clock_offset"] == pytest.approx(1000 - 1_700_000_000, abs=0.01)
    assert np.allclose(point["lever_arm"], arm, atol=0.02)  # of the estimate's own errors
    assert "lever arm, estimated" in done.out


def test_figures_of_an_earlier_evaluation_do_not_stay(bentwing, run_folder):
    (run_folder / "map.ply").unlink()
    reference = ("--reference-trajectory", run_folder.parent / "truth.txt")
    assert bentwing("evaluate", run_folder, *reference, "--quiet").code == 0
    assert bentwing("evaluate", run_folder, "--quiet").code == 0
    out = run_folder / "evaluation"
    assert not (out / "trajectory_differences.svg").exists()
    assert {path.name for path in out.iterdir()} == {*record_of(out)["files"], "evaluation.json"}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("nowhere",), "does not exist"),
        ((".",), "has neither"),
        (("truth.txt",), "-o OUT"),
        (("run", "-o", "run"), "holds no earlier evaluation"),
        (("run", "-o", "truth.txt"), "choose another"),
        (("run", "--lever-arm", "1,2"), "three numbers"),
        (("run", "--changed-beyond", "-1"), "above 0"),
        (("truth.txt", "-o", "out", "--reference-map", "scan.ply"), "no map"),
        (("scan.ply", "-o", "out", "--reference-trajectory", "truth.txt"), "no trajectory"),
        (("run", "--reference", "truth.txt"), "No such option"),
    ],
)
def test_wrong_usage_ends_with_2(bentwing, run_folder, monkeypatch, arguments, says):
    monkeypatch.chdir(run_folder.parent)
    done = bentwing("evaluate", *arguments)
    assert done.code == 2
    assert says in " ".join(done.err.split())


@pytest.mark.parametrize(
    ("option", "name", "content", "says"),
    [
        ("--reference-trajectory", "kitti.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n", "as KITTI writes"),
        ("--reference-trajectory", "missing.txt", None, "no such file"),
        ("--reference-map", "scan.xyz", "0 0 0\n", "convert it first"),
        ("--reference-map", "cut.ply", "ply\nformat ascii 1.0\n", "no end"),
        ("--reference-map", "missing.ply", None, "no such file"),
    ],
)
def test_a_reference_that_cannot_be_used_ends_with_3(bentwing, run_folder, tmp_path, option, name, content, says):  # fmt: skip
    if content is not None:
        (tmp_path / name).write_text(content)
    done = bentwing("evaluate", run_folder, option, tmp_path / name)
    assert done.code == 3
    assert name in done.err
    assert says in done.err


def test_a_truncated_map_ends_with_3(bentwing, run_folder):
    path = run_folder / "map.ply"
    path.write_bytes(path.read_bytes()[:-1000])
    done = bentwing("evaluate", run_folder)
    assert done.code == 3
    assert "truncated" in done.err


@pytest.mark.slow
def test_a_simulated_flight_is_evaluated_against_its_truth(office, tmp_path, bentwing):
    command = [
        "map",
        office / "recording.bag",
        "--payload",
        office / "payload.yaml",
        "-o",
        tmp_path / "run",
    ]
    subprocess.run([sys.executable, "-m", "bentwing", *map(str, command), "--quiet"], check=True)
    done = bentwing("evaluate", tmp_path / "run",
                    "--reference-trajectory", office / "truth_trajectory.txt",
                    "--reference-map", office / "truth_scene.ply")  # fmt: skip
    assert done.code == 0, done.err
    record = record_of(tmp_path / "run" / "evaluation")
    truth, origin = read_tum(office / "truth_trajectory.txt")
    assert origin > 0
    assert len(truth.times) > record["trajectory"]["absolute"]["n"] > 1000
    assert record["trajectory"]["absolute"]["rmse"] < 0.02
    assert record["map"]["std"] < 0.014  # the paper's 1.4 cm
    assert record["map"]["n_left_out"] < 0.01 * record["map"]["n_points"]
    assert "no loop was closed" in " ".join(record["notes"]) or record["drift"] is not None
