# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing map` with several recordings, `merge` and `localize` as a user runs them."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bentwing.base.trajectory import read_tum
from bentwing.cli.main import run_command
from bentwing.map.read import read_points

THIN = ("--map-spacing", "0.1")


def record_of(out):
    return json.loads((out / "run.json").read_text())


def names_in(folder):
    return {path.name for path in folder.iterdir()}


@pytest.fixture(scope="module")
def flights(office, simulated):
    """Folders of two flights through the same office."""
    return [office, simulated("office", 22.0, flight_seed=9)]


@pytest.fixture(scope="module")
def site(flights, tmp_path_factory):
    """Both flights mapped by one command."""
    out = tmp_path_factory.mktemp("site") / "site"
    recordings = [folder / "recording.bag" for folder in flights]
    command = ["map", *recordings, "-p", flights[0] / "payload.yaml", "-o", out, *THIN, "-q"]
    assert run_command([str(word) for word in command]) == 0
    return out


def test_two_flights_become_two_runs_and_one_map(site, flights):
    morning, noon = (folder.name for folder in flights)
    assert names_in(site / "runs") == {morning, noon}
    assert {f"trajectory_{morning}.txt", f"trajectory_{noon}.txt", "map.laz", "report.html",
            "run.json"} <= names_in(site)  # fmt: skip
    assert record_of(site)["complete"]
    for name in (morning, noon):
        assert record_of(site / "runs" / name)["complete"]
    whole = len(read_points(site / "map.laz"))
    assert whole > max(len(read_points(run / "map.laz")) for run in (site / "runs").iterdir())


@pytest.mark.slow
def test_a_mapped_flight_is_left_alone_unless_it_is_asked_for_with_other_settings(
    site, flights, bentwing
):
    recordings = [folder / "recording.bag" for folder in flights]
    command = ("map", *recordings, "-p", flights[0] / "payload.yaml", "-o", site, *THIN, "--resume")
    before = record_of(site / "runs" / flights[0].name)["timings"]
    said = bentwing(*command)
    assert said.code == 0, said.err
    assert said.err.count("is mapped already") == 2
    names = f"{flights[0].name}, {flights[1].name}"
    assert said.out == f"{site}: {names}; good; open {site}/report.html\n"
    assert record_of(site / "runs" / flights[0].name)["timings"] == before
    said = bentwing(*command, "--set", "window=4")
    assert said.code == 0, said.err
    assert "is mapped already" not in said.err
    for folder in flights:
        record = record_of(site / "runs" / folder.name)
        assert record["settings"]["continuous"]["window"] == 4.0


def test_runs_are_merged_into_one_map(site, flights, bentwing, tmp_path):
    runs, out = [site / "runs" / folder.name for folder in flights], tmp_path / "merged"
    said = bentwing("merge", *runs, "-o", out, *THIN)
    assert said.code == 0, said.err
    assert said.out == f"{out}: {runs[0].name}, {runs[1].name}; good; open {out}/report.html\n"
    assert "survey" in said.err
    assert (out / "map.laz").read_bytes() == (site / "map.laz").read_bytes()


def test_a_recording_is_localized_in_the_map_of_another_flight(site, flights, bentwing, tmp_path):
    first, second = flights
    out = tmp_path / "today"
    said = bentwing(
        "localize", second / "recording.bag", "--map", site / "runs" / first.name,
        "-p", second / "payload.yaml", "-o", out, *THIN,
    )  # fmt: skip
    assert said.code == 0, said.err
    assert said.out == (
        f"{out}: nothing has changed since the map was made\n{out}: good; open {out}/report.html\n"
    )
    assert {"trajectory.txt", "map.laz", "appeared.laz", "disappeared.laz", "run.json"} <= names_in(
        out
    )
    found, origin = read_tum(out / "trajectory.txt")
    merged, _ = read_tum(site / f"trajectory_{second.name}.txt", origin)
    at = np.linspace(2.0, 18.0, 50)
    apart = found.interpolate(at)[0] - merged.interpolate(at)[0]
    assert np.abs(apart).max() < 0.1  # m; both are in the frame of the first flight


@pytest.mark.parametrize(
    ("command", "code", "says"),
    [
        (["merge", "nowhere", "noon", "-o", "out"], 2, "nowhere: holds no bentwing run"),
        (["merge", "run", "run", "-o", "out"], 2, "give each run once"),
        (["merge", "run", "-o", "out"], 2, "merging takes two or more"),
        (["localize", "bag", "--map", "no.laz", "-p", "head", "-o", "out"], 3, "no.laz: no such file"),
        (["localize", "bag", "--map", "empty", "-p", "head", "-o", "out"], 2, "holds no bentwing run"),
        (["localize", "nowhere.bag", "--map", "run", "-o", "out"], 3, "nowhere.bag: no such file"),
        (["map", "bag", "other", "-o", "out", "--start", "3"], 2, "--start with 2 flights"),
        (["map", "bag", "nowhere.bag", "-o", "out"], 3, "nowhere.bag: no such file"),
    ],
)  # fmt: skip
def test_what_cannot_be_put_together_is_refused_in_one_sentence(
    site, flights, bentwing, tmp_path, command, code, says
):
    (tmp_path / "empty").mkdir()
    words = {
        "run": site / "runs" / flights[0].name,
        "bag": flights[0] / "recording.bag",
        "other": flights[1] / "recording.bag",
        "head": flights[0] / "payload.yaml",
        "out": tmp_path / "out",
        "empty": tmp_path / "empty",
    }
    said = bentwing(*(words.get(word, word) for word in command))
    errors = [line for line in said.err.splitlines() if line.startswith("bentwing: error:")]
    assert said.code == code, said.err
    assert len(errors) == 1
    assert says in errors[0]


@pytest.mark.slow
def test_runs_without_a_place_in_common_become_maps_of_their_own(
    site, flights, simulated, bentwing, tmp_path
):
    cave, office = simulated("cave", 22.0), site / "runs" / flights[0].name
    command = (cave / "recording.bag", "-p", cave / "payload.yaml", "-o", tmp_path / "cave", "-q")
    assert bentwing("map", *command, *THIN).code == 0
    said = bentwing("merge", office, tmp_path / "cave", "-o", tmp_path / "out", *THIN)
    assert said.code == 0, said.err
    first, *maps = said.out.splitlines()
    assert first == "not all runs have places in common: 2 separate maps"
    assert len(maps) == 2
    for line in maps:
        assert line.endswith("/report.html")
