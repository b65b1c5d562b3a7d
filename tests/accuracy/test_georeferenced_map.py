# SPDX-License-Identifier: MIT OR Apache-2.0
"""A simulated flight with a receiver and somebody walking about, from the bag to the map in UTM."""

import json

import laspy
import numpy as np
import pytest
import yaml

from bentwing import map_recording
from bentwing.base.geodesy import LevelFrame, ProjectedSystem
from bentwing.evaluate.simulated import Truth
from bentwing.simulate import Scenario, simulate

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flight")
    scenario = Scenario(scene="office", duration=25.0, seed=2, gnss="rtk", events=("person",))
    files = simulate(scenario, folder / "recording")
    run = map_recording(files.recording, files.payload, folder / "run", loop_closure=False)
    return files, run


def test_the_map_lies_where_the_world_is_and_nobody_is_in_it(flight):
    files, run = flight
    las = laspy.read(run.out / "map.laz")
    record = json.loads((run.out / "run.json").read_text())
    assert las.header.parse_crs().to_epsg() == 32632 == record["georeference"]["epsg"]
    assert record["georeference"]["fixes"]["rejected"] > 0
    assert record["counts"]["map.moving"] > 1000
    assert len(las) == record["counts"]["map.written"]
    where = yaml.safe_load((files.payload.parent / "truth_georeference.yaml").read_text())
    c, s = np.cos(where["heading"]), np.sin(where["heading"])
    frame = LevelFrame(where["longitude"], where["latitude"], where["height"])
    level = frame.from_geodetic(ProjectedSystem.of_epsg(32632).to_geodetic(las.xyz[::20]))
    world = level @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    off = np.abs(Truth(files.scene.parent).distances(world))
    # the receiver is good to a centimetre
    assert np.median(off) < 0.02
    # without cleaning 1.3 % of the points are of the person; some of where it stood is never seen through
    assert np.mean(off > 0.25) < 0.0025
    # the lidar's noise is 10 mm
    assert 0.002 < np.nanmedian(las["thickness"]) < 0.012
    assert 20 < np.nanmedian(las["incidence"]) < 60
