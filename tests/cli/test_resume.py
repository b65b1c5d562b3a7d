# SPDX-License-Identifier: MIT OR Apache-2.0
"""A run that is killed goes on where it was, and ends with the same bytes."""

import hashlib
import io
import json
import random
import subprocess
import sys
import time

import numpy as np
import pytest

from bentwing.run.checkpoint import Checkpoint
from bentwing.run.folder import RunFolder
from bentwing.run.settings import RunSettings

RESULTS = ("trajectory.txt", "odometry.txt", "map.laz", "map_top.png")


@pytest.fixture(scope="module")
def asked(simulated):
    folder = simulated("office", 22.0)
    return [folder / "recording.bag", "--payload", folder / "payload.yaml", "--duration", "10"]


def start(asked, out, *options):
    command = [sys.executable, "-m", "bentwing", "map", *asked, "-o", out, "--quiet", *options]
    return subprocess.Popen(list(map(str, command)), stderr=subprocess.PIPE, text=True)


def finished(process):
    _, err = process.communicate(timeout=120)
    assert process.returncode == 0, err


@pytest.fixture(scope="module")
def undisturbed(asked, tmp_path_factory):
    out = tmp_path_factory.mktemp("undisturbed") / "run"
    finished(start(asked, out))
    return out


def record_of(out):
    try:
        return json.loads((out / "run.json").read_text())
    except (OSError, ValueError):
        return {"stage": "", "complete": False}


def kill_in(process, out, stage, delay):
    """Kill the process some time after it has come to a stage, at the latest when it ends."""
    while record_of(out)["stage"] != stage and process.poll() is None:
        time.sleep(0.002)
    time.sleep(delay)
    process.kill()
    process.communicate()


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 2, 3))])
def test_it_ends_with_the_same_bytes_wherever_it_was_killed(seed, asked, undisturbed, tmp_path):
    moments, out = random.Random(seed), tmp_path / "run"
    for stage in ("estimate", "map", "map"):
        process = start(asked, out, "--resume")
        kill_in(process, out, stage, moments.uniform(0.0, 0.3))
    finished(start(asked, out, "--resume"))
    for name in RESULTS:
        assert (out / name).read_bytes() == (undisturbed / name).read_bytes(), name
    left = sorted(path.name for path in out.iterdir())
    assert left == sorted(path.name for path in undisturbed.iterdir())
    ours, theirs = record_of(out), record_of(undisturbed)
    assert ours["complete"]
    for key in ("counts", "windows", "calibration", "segments", "files", "warnings", "verdict"):
        assert ours[key] == theirs[key], key


@pytest.fixture
def killed(asked, tmp_path):
    """A run that was killed while it wrote its map."""
    out = tmp_path / "run"
    process = start(asked, out)
    while not (out / "checkpoint.npz").exists():
        assert process.poll() is None
        time.sleep(0.002)
    process.kill()
    process.communicate()
    return out


def test_a_finished_stage_is_not_done_again(asked, killed):
    with np.load(killed / "checkpoint.npz") as stored:
        before = json.loads(str(stored["described"]))["timings"]
    finished(start(asked, killed, "--resume"))
    after = record_of(killed)["timings"]
    assert "map" in after
    assert after["estimate"] == before["estimate"]
    assert not (killed / "checkpoint.npz").exists()


def test_other_settings_are_refused(asked, killed):
    process = start([*asked, "--map-format", "ply"], killed, "--resume")
    _, err = process.communicate(timeout=60)
    assert process.returncode == 2
    assert "other map_format" in err
    assert "--resume" in err
    # and without --resume it begins anew
    finished(start([*asked, "--map-format", "ply"], killed))
    assert not (killed / "checkpoint.npz").exists()


def test_a_damaged_checkpoint_begins_anew(asked, killed, undisturbed):
    path = killed / "checkpoint.npz"
    path.write_bytes(path.read_bytes()[:2000])
    finished(start(asked, killed, "--resume"))
    assert (killed / "map.laz").read_bytes() == (undisturbed / "map.laz").read_bytes()
    assert any("begins anew" in warning for warning in record_of(killed)["warnings"])


@pytest.fixture
def restored(killed):
    """A function: what a run that resumes makes of a checkpoint's bytes."""
    settings = RunSettings()
    with RunFolder(killed, settings.to_json(), resume=True) as folder:

        def restore(content):
            (killed / "checkpoint.npz").write_bytes(content)
            return Checkpoint(folder, settings).restore(resume=True)

        yield restore


def test_no_damage_of_a_checkpoint_is_taken_for_a_stage_that_is_done(killed, restored):
    whole, flips = (killed / "checkpoint.npz").read_bytes(), random.Random(0)
    for _ in range(200):
        at, bit = flips.randrange(len(whole)), 1 << flips.randrange(8)
        stage, found = restored(whole[:at] + bytes([whole[at] ^ bit]) + whole[at + 1 :])
        assert stage is None
        assert "begins anew" in found.stage_warnings[0]
    for size in (0, 1, 31, 32, 33, len(whole) // 2, len(whole) - 1):
        assert restored(whole[:size])[0] is None


def of_another_program(described, **arrays):
    data = io.BytesIO()
    np.savez(data, described=np.array(json.dumps(described)), **arrays)
    return data.getvalue() + hashlib.sha256(data.getvalue()).digest()


def test_a_checkpoint_of_something_else_begins_anew(killed, restored):
    with np.load(killed / "checkpoint.npz") as stored:
        arrays = {name: stored[name] for name in stored.files}
    described = json.loads(str(arrays.pop("described")))
    settings = {k: v for k, v in RunSettings().to_json().items() if k != "threads"}
    described["asked"] = {**settings, "inputs": []}
    assert restored(of_another_program(described, **arrays))[0] is not None
    for part in ("stage", "files", "timings", "calibration", "estimate", "stage_warnings"):
        for value in (None, "x", {"a": [1]}, 1e300, [[]]):
            changed = {**described, part: value}
            assert restored(of_another_program(changed, **arrays))[0] is None, (part, value)


def test_the_checkpoint_keeps_every_bit(killed):
    with np.load(killed / "checkpoint.npz") as stored:
        written = np.loadtxt(killed / "trajectory.txt")
        assert np.abs(stored["positions"] - written[:, 1:4]).max() < 1e-5
