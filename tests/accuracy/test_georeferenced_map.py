# SPDX-License-Identifier: MIT OR Apache-2.0
"""A simulated flight with a receiver and somebody walking about, from the bag to the map in UTM."""

import json
from datetime import datetime, timezone

import laspy
import numpy as np
import pytest
import yaml

from bentwing import map_recording
from bentwing.base.geodesy import LevelFrame, ProjectedSystem
from bentwing.closing import GeoreferenceSettings
from bentwing.evaluate.simulated import Truth
from bentwing.recording import Payload, Recording
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


def as_solution(files, path):
    """Write the fixes of a recording as RTKLIB does: dates of GPS time, roots of covariances."""
    with Recording([files.recording], Payload.load(files.payload)) as recording:
        fixes, stamps = recording.fixes(), recording.clock.to_ns(recording.fixes().times)
    lines = [
        "%  GPST  latitude(deg) longitude(deg) height(m) Q ns sdn(m) sde(m) sdu(m) sdne sdeu sdun"
    ]
    for stamp, (lon, lat, height), covariance in zip(
        stamps.tolist(), fixes.places.tolist(), fixes.covariances, strict=True
    ):
        gps = stamp + 18 * 10**9
        when = datetime.fromtimestamp(gps // 10**9, timezone.utc)
        east, north, up = np.sqrt(np.diag(covariance))
        lines.append(
            f"{when:%Y/%m/%d %H:%M:%S}.{gps % 10**9:09d} {lat:.11f} {lon:.11f} {height:.5f} 1 9 "
            f"{north:.6f} {east:.6f} {up:.6f} 0 0 0"
        )
    path.write_text("\n".join(lines))


def test_the_same_fixes_in_a_file_put_the_map_in_the_same_place(flight, tmp_path):
    files, run = flight
    as_solution(files, tmp_path / "ppk.pos")
    wanted = GeoreferenceSettings(fixes=tmp_path / "ppk.pos")
    payload = Payload.load(files.payload).model_copy(update={"gnss": None})
    other = map_recording(
        files.recording, payload, tmp_path / "run", georeferencing=wanted, write_map=False,
        loop_closure=False,
    )  # fmt: skip
    assert any("no lever arm" in warning for warning in other.warnings)
    payload = Payload.load(files.payload)
    gnss = payload.gnss.model_copy(update={"topic": None})
    same = map_recording(
        files.recording, payload.model_copy(update={"gnss": gnss}), tmp_path / "run",
        georeferencing=wanted, write_map=False, loop_closure=False,
    )  # fmt: skip
    records = [json.loads((r.out / "run.json").read_text())["georeference"] for r in (run, same)]
    assert records[1]["fixes"]["leap_seconds"] == 18
    assert records[1]["heading"] == pytest.approx(records[0]["heading"], abs=2e-5)
    for key in ("projected", "map"):
        assert records[1]["linear"][key] == pytest.approx(records[0]["linear"][key], abs=1e-3)
