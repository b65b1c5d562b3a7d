# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing map FOLDER` and `bentwing fleet` as a user runs them."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import psutil
import pytest

from bentwing.base.run_record import RUN_FOLDER

THIN = ("--map-spacing", "0.1")


def record_of(out):
    return json.loads((out / "site.json").read_text())


def states(out):
    return {one["name"]: one["state"] for one in record_of(out)["recordings"]}


@pytest.fixture
def flights(office, simulated, tmp_path):
    """A folder of two flights through an office, one through a cave, and a damaged one."""
    folder = tmp_path / "flights"
    folders = {
        "morning": office, "noon": simulated("office", 22.0, flight_seed=9), "cave": simulated("cave", 22.0),
    }  # fmt: skip
    for name, made in folders.items():
        (folder / name).mkdir(parents=True)
        for file in ("recording.bag", "payload.yaml"):
            (folder / name / file).symlink_to(made / file)
    (folder / "damaged").mkdir()
    whole = (office / "recording.bag").read_bytes()
    (folder / "damaged" / "recording.bag").write_bytes(whole[:3000])
    shutil.copy(office / "payload.yaml", folder / "damaged")
    return folder


def test_a_folder_without_a_recording_that_can_be_used_is_refused(bentwing, flights, tmp_path):
    said = bentwing("map", flights / "damaged", "-o", tmp_path / "out")
    assert said.code == 3
    assert "recording  refused" in said.out
    assert "1 of 1 are not mapped: recording" in said.err
    assert states(tmp_path / "out") == {"recording": "refused"}
    assert "cut off" in (tmp_path / "out" / "index.html").read_text()


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["map", "empty", "-o", "out"], 3, "empty: a folder without recordings"),
        (["map", "flights", "-o", "out", "--write-payload", "head.yaml"], 2, "with a folder of recordings"),
        (["map", "flights", "-o", "out", "--set", "window=-1"], 2, "window"),
        (["map", "flights", "-o", "flights"], 2, "holds no earlier site"),
        (["fleet", "empty", "-o", "out"], 3, "empty: a folder without recordings"),
        (["fleet", "gone.yaml", "-o", "out"], 3, "gone.yaml: no such file"),
        (["fleet", "flights", "-o", "out", "--scheduler", "tcp://127.0.0.1:1", "--workers", "2"], 2, "give one of them"),
    ],
)  # fmt: skip
@pytest.mark.usefixtures("flights")
def test_what_cannot_be_mapped_is_refused_in_one_sentence(bentwing, tmp_path, words, code, says):
    (tmp_path / "empty").mkdir()
    paths = {"empty", "out", "flights", "head.yaml", "gone.yaml"}
    said = bentwing(*(tmp_path / word if word in paths else word for word in words))
    errors = [line for line in said.err.splitlines() if line.startswith("bentwing: error:")]
    assert (said.code, len(errors)) == (code, 1), said.err
    assert says in errors[0]
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_the_recordings_of_a_folder_are_mapped_each_into_its_own(bentwing, flights, tmp_path):
    out = tmp_path / "out"
    said = bentwing("map", flights, "-o", out, *THIN)
    assert said.code == 5, said.err
    assert states(out) == {"cave": "good", "damaged": "refused", "morning": "good", "noon": "good"}
    assert "1 of 4 are not mapped: damaged" in said.err
    for name in ("cave", "morning", "noon"):
        assert RUN_FOLDER.read(out / name)["complete"]
    alone = tmp_path / "alone"
    recording = flights / "morning" / "recording.bag"
    payload = flights / "morning" / "payload.yaml"
    assert bentwing("map", recording, "-p", payload, "-o", alone, *THIN).code == 0
    for name in ("map.laz", "trajectory.txt"):
        assert (out / "morning" / name).read_bytes() == (alone / name).read_bytes()
    (flights / "damaged" / "recording.bag").unlink()
    said = bentwing("map", flights, "-o", out, *THIN)
    assert said.code == 0, said.err
    assert said.out.count("good (as before)") == 3


@pytest.mark.slow
def test_a_fleet_survives_the_death_of_a_worker(bentwing, flights, tmp_path):
    out = tmp_path / "site"
    command = ("fleet", flights, "-o", out, "--workers", 2, *THIN)
    process = subprocess.Popen(
        [sys.executable, "-m", "bentwing", *map(str, command)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    worker_of_a_map(process).kill()
    said, _ = process.communicate(timeout=1200)
    assert process.returncode == 5, said
    assert states(out) == {"cave": "good", "damaged": "refused", "morning": "good", "noon": "good"}
    merged, island = record_of(out)["groups"]
    assert (merged["runs"], merged["folder"]) == (["morning", "noon"], "groups/1")
    assert (island["runs"], island["folder"]) == (["cave"], "recordings/cave")
    runs = [out / "recordings" / name for name in ("cave", "morning", "noon")]
    assert not [path for path in (out / "recordings").iterdir() if path not in runs]
    assert bentwing("merge", *runs, "-o", tmp_path / "merged", *THIN).code == 0
    for name in ("map.laz", "trajectory_noon.txt"):
        ours = (out / "groups" / "1" / name).read_bytes()
        assert ours == (tmp_path / "merged" / "map_2" / name).read_bytes()
    before = {path: path.stat().st_ino for path in out.rglob("run.json")}
    said = bentwing(*command)
    assert said.code == 5, said.err
    assert {path: path.stat().st_ino for path in out.rglob("run.json")} == before


@pytest.mark.slow
def test_a_further_recording_costs_no_other_its_survey(bentwing, flights, tmp_path):
    later = flights / "noon"
    later.rename(tmp_path / "noon")
    shutil.rmtree(flights / "damaged")
    out = tmp_path / "site"
    command = ("fleet", flights, "-o", out, "--workers", 1, *THIN)
    assert bentwing(*command).code == 0
    (tmp_path / "noon").rename(later)
    run = tmp_path / "noon"
    assert bentwing("map", later / "recording.bag", "-p", later / "payload.yaml", "-o", run, *THIN).code == 0  # fmt: skip
    said = bentwing("merge", out, run, "-o", out)
    assert said.code == 0, said.err
    assert "surveyed 1 of 3 runs and compared 2 of 3 pairs" in said.err
    again, whole = out / "groups" / "1", tmp_path / "whole"
    assert bentwing(*("fleet", flights, "-o", whole, "--workers", 1, *THIN)).code == 0
    for name in ("map.laz", "trajectory_noon.txt"):
        assert (again / name).read_bytes() == (whole / "groups" / "1" / name).read_bytes()


def worker_of_a_map(process):
    """Wait until a recording is being mapped, and return the process of its worker."""
    fleet = psutil.Process(process.pid)
    while process.poll() is None:
        for child in fleet.children(recursive=True):
            if child.is_running() and "fleet.child" in " ".join(child.cmdline()):
                return child.parent()
        time.sleep(0.1)
    pytest.fail(process.communicate()[0])


@pytest.mark.slow
def test_an_interrupted_batch_goes_on_where_it_was(flights, tmp_path):
    out = tmp_path / "out"
    shutil.rmtree(flights / "cave")
    shutil.rmtree(flights / "damaged")
    command = [sys.executable, "-m", "bentwing", "map", flights, "-o", out, *THIN]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    said = []
    for line in process.stderr:
        said.append(line)
        if "loops: done" in line:
            os.killpg(process.pid, signal.SIGINT)
            break
    rest = process.stderr.read()
    process.stderr.close()
    assert process.wait(120) == 130, "".join(said) + rest
    assert rest.endswith("bentwing: error: interrupted\n")
    assert not record_of(out)["complete"]
    (staging, *_) = [path for path in out.iterdir() if (path / "checkpoint.npz").exists()]
    assert not RUN_FOLDER.read(staging)["complete"]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert states(out) == {"morning": "good", "noon": "good"}
    assert {path.name for path in out.iterdir()} == {"morning", "noon", "site.json", "index.html"}
