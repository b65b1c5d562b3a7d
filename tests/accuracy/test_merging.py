# SPDX-License-Identifier: MIT OR Apache-2.0
"""Flights in one world find each other without a guess; flights in different worlds stay apart."""

from __future__ import annotations

import json
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from bentwing.base.errors import InputError, UsageError
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.simulated import merged_score
from bentwing.evaluate.trajectory import absolute_error
from bentwing.recording import Payload
from bentwing.run.flights import map_flights
from bentwing.run.merging import merge
from bentwing.run.pipeline import map_recording
from bentwing.run.settings import RunSettings
from bentwing.simulate import Scenario, simulate
from bentwing.simulate.knock import knocked

SECONDS = 22.0
STALL = (0.55 * 30.0, 0.55 * 30.0 + 6.0)  # s
KNOCK = (19.0, 21.0)  # s


@pytest.fixture(scope="module")
def flights(made_once):
    """Two flights in one office, and one in a forest."""

    def make(scene, seed, flight_seed):
        scenario = Scenario(scene=scene, seed=seed, flight_seed=flight_seed, duration=SECONDS)
        name = f"merging-{scene}-{seed}-{flight_seed}"
        return made_once(name, lambda folder: simulate(scenario, folder))

    return make("office", 31, 3101), make("office", 31, 3102), make("forest", 31, 3103)


def settings_of(payload):
    return RunSettings(payload=Payload.load(payload), threads=2)


@pytest.fixture(scope="module")
def merged(flights, made_once):
    """All of them mapped and merged by one call."""

    def fill(folder):
        recordings = [[flight / "recording.bag"] for flight in flights]
        payload = flights[0] / "payload.yaml"
        map_flights(recordings, folder, settings_of(payload), payload)

    out = made_once("merged-flights", fill)
    runs = sorted((out / "runs").iterdir(), key=lambda p: p.name)
    assert [run.name for run in runs] == sorted(flight.name for flight in flights)
    record = json.loads((out / "run.json").read_text())
    return SimpleNamespace(out=out, record=record, runs=[out / "runs" / f.name for f in flights])


def test_flights_in_one_world_are_one_map_and_the_other_is_apart(flights, merged):
    maps = merged.record["merging"]["maps"]
    assert [m["runs"] for m in maps] == [[flights[0].name, flights[1].name], [flights[2].name]]
    (sentence,) = [w for w in merged.record["warnings"] if "separate maps" in w]
    assert f"map_2 ({flights[2].name})" in sentence
    for one in maps:
        assert (merged.out / one["folder"] / "map.laz").exists()
        assert (merged.out / one["folder"] / "report.html").exists()


def test_the_flights_agree_to_a_centimetre(flights, merged):
    score = merged_score(flights[:2], merged.out / "map_1")
    assert score.after < 0.01
    assert score.joint < 0.008
    assert max(score.ates) < 0.006
    assert score.map_ratio < 1.3


def test_the_map_is_clean_and_tells_the_run_of_every_point(merged):
    import laspy

    one = merged.out / "map_1"
    record, table = json.loads((one / "run.json").read_text()), laspy.read(one / "map.laz")
    counts = record["counts"]
    assert counts["map.mixed_pixels"] > 100
    assert (
        counts["map.written"]
        == len(table)
        == counts["map.points"] - (counts["map.mixed_pixels"] + counts["map.moving"])
    )
    assert np.isfinite(table["thickness"]).mean() > 0.9
    ids, times = np.asarray(table["run_id"]), np.asarray(table.gps_time)
    for number, run in enumerate(record["runs"]):
        lines = (one / run["trajectory"]).read_text().splitlines()
        unix = [float(lines[k].split()[0]) for k in (1, -1)]  # behind the comment
        begins = times[ids == number].min() - times.min()
        expected = (run["start_ns"] - min(r["start_ns"] for r in record["runs"])) / 1e9
        assert begins == pytest.approx(expected, abs=1.0)
        assert np.ptp(times[ids == number]) <= unix[1] - unix[0] + 0.1
    assert set(ids) == {0, 1}


def test_every_pair_of_places_is_listed_with_its_reason(merged):
    listed = merged.record["merging"]["candidates"]
    accepted = [c for c in listed if c["accepted"]]
    assert accepted
    assert all(c["reason"] is None and c["T_a_b"] for c in accepted)
    assert all(c["reason"] for c in listed if not c["accepted"])
    report = (merged.out / "report.html").read_text()
    assert f"Accepted ({len(accepted)})" in report
    assert f"Rejected ({len(listed) - len(accepted)})" in report


def test_flights_that_are_mapped_already_are_not_mapped_again(flights, merged, tmp_path):
    out = tmp_path / "again"
    shutil.copytree(merged.out, out)
    before = {run: (out / "runs" / run.name / "run.json").read_bytes() for run in merged.runs}
    recordings = [[flight / "recording.bag"] for flight in flights]
    payload = flights[0] / "payload.yaml"
    map_flights(recordings, out, settings_of(payload), payload, resume=True)
    for run, record in before.items():
        assert (out / "runs" / run.name / "run.json").read_bytes() == record
    assert (out / "map_1" / "map.laz").read_bytes() == (
        merged.out / "map_1" / "map.laz"
    ).read_bytes()


def test_a_run_given_twice_is_refused(merged, tmp_path):
    with pytest.raises(UsageError, match="is the same run as"):
        merge([merged.runs[0], merged.runs[1], merged.runs[0]], tmp_path / "out")
    copied = tmp_path / "copy"
    shutil.copytree(merged.runs[0], copied)
    with pytest.raises(UsageError, match="of the same recording"):
        merge([merged.runs[0], copied], tmp_path / "out")
    with pytest.raises(UsageError, match="takes two or more"):
        merge([merged.runs[0]], tmp_path / "out")


def test_a_merged_map_is_no_run(merged, tmp_path):
    with pytest.raises(UsageError, match="holds a merged map"):
        merge([merged.out / "map_1", merged.runs[2]], tmp_path / "out")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda bag: bag.unlink(), "is gone"),
        (lambda bag: bag.write_bytes(b"other"), "is not the recording"),
    ],
)
def test_a_recording_that_is_gone_or_another_is_named(merged, tmp_path, change, message):
    bag, run = tmp_path / "moved.bag", tmp_path / "run"
    shutil.copytree(merged.runs[0], run)
    record = json.loads((run / "run.json").read_text())
    shutil.copy(record["recordings"][0], bag)
    record["recordings"] = [str(bag)]
    record["inputs"][0]["name"] = bag.name
    (run / "run.json").write_text(json.dumps(record))
    change(bag)
    with pytest.raises(InputError, match=f"moved.bag.* {message}"):
        merge([run, merged.runs[1]], tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def stalled(made_once):
    """A flight whose head stalls, and whose IMU is knocked while it stands."""
    from bentwing.cli.main import run_command

    scenario = Scenario(scene="office", duration=30.0, seed=32, events=("spin-stall",), stall=6.0)

    def fill(folder):
        simulate(scenario, folder)
        knocked(folder / "recording.bag", folder / "knocked.bag", KNOCK)
        asked = ["map", folder / "knocked.bag", "--payload", folder / "payload.yaml"]
        assert run_command([*map(str, asked), "-o", str(folder / "run"), "--quiet"]) == 0

    return made_once("merging-knocked", fill)


def test_a_flight_is_cut_at_a_stall_and_its_parts_are_merged(stalled):
    record = json.loads((stalled / "run" / "run.json").read_text())
    first, second = record["segments"]
    assert first[1] == pytest.approx(STALL[0], abs=2.0)
    assert second[0] == pytest.approx(STALL[1], abs=1.0)
    (sentence,) = [w for w in record["warnings"] if "the head stood still" in w]
    assert "was found again by" in sentence
    assert record["merging"]["groups"] == [[0, 1]]
    truth, origin_ns = read_tum(stalled / "truth_trajectory.txt")
    broken, _ = read_tum(stalled / "run" / "odometry.txt", origin_ns)
    healed, _ = read_tum(stalled / "run" / "trajectory.txt", origin_ns)
    seen = truth.within([(8.0, first[1] - 0.1), (second[0] + 1.0, second[1] - 0.1)])
    assert absolute_error(broken, seen).position.rmse > 0.3
    error = absolute_error(healed, seen).position
    assert error.rmse < 0.01
    assert error.maximum < 0.03
    assert np.isfinite(healed.positions).all()


def test_a_long_stall_that_is_survived_is_told_and_not_cut(stalled, tmp_path):
    out = tmp_path / "out"
    run = map_recording(
        stalled / "recording.bag", stalled / "payload.yaml", out, loop_closure=False, threads=2
    )
    assert run.estimate is not None
    assert len(run.estimate.segments) == 1
    (sentence,) = [w for w in run.estimate.warnings if "the head stood still" in w]
    assert "fits together" in sentence
