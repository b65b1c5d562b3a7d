# SPDX-License-Identifier: MIT OR Apache-2.0
"""Two flights with receivers in one world: the merged map keeps its place on the Earth."""

from __future__ import annotations

import json
import shutil

import laspy
import numpy as np
import pytest
import yaml

from bentwing import map_recording, merge
from bentwing.base.errors import UsageError
from bentwing.base.geodesy import LevelFrame, ProjectedSystem
from bentwing.closing import GeoreferenceSettings
from bentwing.evaluate.simulated import Truth
from bentwing.recording import Payload
from bentwing.simulate import Scenario, simulate

pytestmark = pytest.mark.slow

EPSG = 25832


@pytest.fixture(scope="module")
def flights(made_once):
    """Two flights in one office, with receivers good to a centimetre."""

    def make(flight_seed):
        scenario = Scenario(
            scene="office", seed=31, flight_seed=flight_seed, duration=22.0, gnss="rtk"
        )
        return made_once(f"earth-{flight_seed}", lambda folder: simulate(scenario, folder))

    return make(3101), make(3102)


@pytest.fixture(scope="module")
def runs(flights, made_once):
    def mapped(flight):
        def fill(folder):
            map_recording(
                flight / "recording.bag", flight / "payload.yaml", folder,
                georeferencing=GeoreferenceSettings(epsg=EPSG), map_spacing=0.1,
            )  # fmt: skip

        return made_once(f"{flight.name}-mapped", fill)

    return [mapped(flight) for flight in flights]


def record_of(out):
    return json.loads((out / "run.json").read_text())


def in_the_world(flight, las):
    where = yaml.safe_load((flight / "truth_georeference.yaml").read_text())
    c, s = np.cos(where["heading"]), np.sin(where["heading"])
    frame = LevelFrame(where["longitude"], where["latitude"], where["height"])
    level = frame.from_geodetic(ProjectedSystem.of_epsg(EPSG).to_geodetic(las.xyz[::20]))
    return level @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def test_flights_in_one_world_are_in_one_place(flights):
    first, second = (
        yaml.safe_load((flight / "truth_georeference.yaml").read_text()) for flight in flights
    )
    assert first == second


def test_the_merged_map_lies_where_the_world_is_in_the_system_of_its_runs(flights, runs, tmp_path):
    out = merge(runs, tmp_path / "site", map_spacing=0.1).maps[0].out
    record, las = record_of(out), laspy.read(out / "map.laz")
    assert las.header.parse_crs().to_epsg() == EPSG == record["georeference"]["epsg"]
    shares = record["georeference"]["fixes"]["runs"]
    assert [share["name"] for share in shares] == [run.name for run in runs]
    assert all(share["used"] > 50 and not share["disagrees"] for share in shares)
    off = np.abs(Truth(flights[0]).distances(in_the_world(flights[0], las)))
    assert np.median(off) < 0.025  # the receivers are good to a centimetre


def test_bent_by_the_fixes_it_lies_there_too(flights, runs, tmp_path):
    wanted = GeoreferenceSettings(mode="constraints")
    out = merge(runs, tmp_path / "site", map_spacing=0.1, georeferencing=wanted).maps[0].out
    record = record_of(out)
    assert record["georeference"]["mode"] == "constraints"
    assert 0.0 < record["georeference"]["bent_by"] < 0.05
    off = np.abs(Truth(flights[0]).distances(in_the_world(flights[0], laspy.read(out / "map.laz"))))
    assert np.median(off) < 0.025


def test_a_run_whose_antenna_is_elsewhere_is_named(flights, runs, tmp_path):
    payload = Payload.load(flights[1] / "payload.yaml")
    high = payload.gnss.model_copy(update={"lever_arm": (0.0, 0.0, 2.0)})
    second = tmp_path / "high"
    map_recording(
        flights[1] / "recording.bag", payload.model_copy(update={"gnss": high}), second,
        georeferencing=GeoreferenceSettings(epsg=EPSG), map_spacing=0.2,
    )  # fmt: skip
    out = merge([runs[0], second], tmp_path / "site", map_spacing=0.2).maps[0].out
    said = [text for text in record_of(out)["warnings"] if "from its GNSS fixes" in text]
    # Of two runs nobody can say whose receiver is right.
    assert len(said) == 2
    assert "high lies 0.9" in said[1]


def test_coordinates_without_anything_to_find_them_by_are_refused(runs, tmp_path):
    bare = []
    for run in runs:
        copy = tmp_path / run.name
        shutil.copytree(run, copy)
        record = record_of(copy)
        del record["settings"]["payload"]["gnss"]
        (copy / "run.json").write_text(json.dumps(record))
        bare.append(copy)
    with pytest.raises(UsageError, match="no GNSS fixes that the payload names"):
        merge(bare, tmp_path / "site", georeferencing=GeoreferenceSettings(epsg=EPSG))
