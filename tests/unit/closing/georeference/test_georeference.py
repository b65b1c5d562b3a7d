# SPDX-License-Identifier: MIT OR Apache-2.0
from collections import Counter

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.errors import NotEnoughDataError, UsageError
from bentwing.base.geodesy import LevelFrame, ProjectedSystem
from bentwing.base.trajectory import Trajectory
from bentwing.closing.georeference.georeference import georeference
from bentwing.closing.georeference.placement import Placement
from bentwing.closing.georeference.receivers import Receivers
from bentwing.closing.georeference.settings import GeoreferenceSettings
from bentwing.map.chunk import MapChunk
from bentwing.recording.fixes import Fixes

FRAME = LevelFrame(11.3, 47.5, 700.0)
TRUE = Placement(1.2, np.array([4.0, -7.0, 2.0]), np.zeros(4))
UTM = ProjectedSystem.utm(11.3, 47.5)
LEVER = np.array([0.1, -0.2, 0.3])


def trajectory(duration=60.0):
    times = np.arange(0, duration, 0.01)
    a = 2 * np.pi * times / 40
    positions = np.stack([12 * np.cos(a), 9 * np.sin(a), 0.5 * np.sin(3 * a)], axis=1)
    return Trajectory(times, positions, geometry.exp(np.c_[0.1 * np.sin(a), 0 * a, 4 * a]))


def on_earth(points):
    return FRAME.to_geodetic(TRUE.to_level(points))


def fixes(sigma=0.02, outliers=0.05, rate=5.0, seed=0):
    rng = np.random.default_rng(seed)
    flight = trajectory()
    times = np.arange(0.3, 59.0, 1 / rate)
    p, q = flight.interpolate(times)
    level = TRUE.to_level(p + geometry.rotate(q, np.tile(LEVER, (len(p), 1))))
    level += sigma * rng.normal(size=level.shape)
    false = rng.random(len(times)) < outliers
    level[false] += 8.0
    covariances = np.tile(sigma**2 * np.eye(3), (len(times), 1, 1))
    counts = Counter({"messages": len(times), "fixes": len(times)})
    return Fixes(times, FRAME.to_geodetic(level), covariances, counts), false


def chunks(n=400_000):
    """A floor and two walls, with noise."""
    rng = np.random.default_rng(1)
    across = rng.uniform(-20, 20, (n, 2))
    noise = 0.01 * rng.normal(size=n)
    kind = rng.integers(0, 3, n)
    floor = np.c_[across, -2 + noise]
    walls = (
        np.c_[across[:, 0], 15 + noise, across[:, 1] / 10],
        np.c_[18 + noise, across[:, 1], across[:, 0] / 10],
    )
    points = np.where(kind[:, None] == 0, floor, np.where(kind[:, None] == 1, *walls))
    times = np.sort(rng.uniform(1, 59, n))
    for part in np.array_split(np.arange(n), 5):
        yield MapChunk(points[part], times[part], np.ones(len(part), np.float32))


MARKS = {
    "floor1,control": (5.0, 5.0, -2.0),
    "floor2,check": (-8.0, 3.0, -2.0),
    "floor3,control": (-3.0, -9.0, -2.0),
    "wall1,control": (6.0, 15.0, 0.0),
    "wall2,control": (-12.0, 15.0, 0.2),
    "wall3,check": (-2.0, 15.0, 0.2),
    "wall4,control": (18.0, 4.0, 0.0),
    "air,control": (0.0, 0.0, 3.0),
}


@pytest.fixture
def marks(tmp_path):
    places = UTM.from_geodetic(on_earth(np.array(list(MARKS.values()))))
    lines = ["id,x,y,z,radius,use"]
    for name, place in zip(MARKS, places, strict=True):
        mark, use = name.split(",")
        lines.append(f"{mark},{place[0]:.4f},{place[1]:.4f},{place[2]:.4f},0.5,{use}")
    path = tmp_path / "marks.csv"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def placed(measured, **settings):
    return georeference(
        trajectory(),
        None if measured is None else Receivers.one(measured, LEVER),
        GeoreferenceSettings(**settings),
        chunks=chunks,
    )


def errors(found):
    points = np.random.default_rng(3).uniform(-20, 20, (100, 3))
    return found.to_projected(points) - UTM.from_geodetic(on_earth(points))


def test_fixes_put_the_map_where_it_is():
    measured, false = fixes()
    found = placed(measured)
    assert np.abs(errors(found)).max() < 0.02
    assert found.record["epsg"] == 32632
    assert found.record["fixes"]["rejected"] >= false.sum()
    assert found.record["fixes"]["used"] > 0.9 * len(false)
    assert 0.02 < found.record["fixes"]["rms_horizontal"] < 0.04
    assert found.trajectory.positions.tobytes() == trajectory().positions.tobytes()
    assert 'AUTHORITY["EPSG","32632"]' in found.crs_wkt


def test_control_points_make_it_better_and_check_points_say_how_good(marks):
    measured, _ = fixes(sigma=0.1)
    loose = placed(measured)
    found = placed(measured, control_points=marks)
    assert np.abs(errors(found)).max() < 0.012 < np.abs(errors(loose)).max()
    rows = {row["id"]: row for row in found.record["control_points"]}
    assert abs(rows["floor2"]["residual"]) < 0.004
    assert abs(rows["wall3"]["residual"]) < 0.004
    assert abs(rows["floor1"]["normal"][2]) > 0.999
    assert rows["air"]["residual"] is None
    assert found.record["residuals"]["check"]["n"] == 2
    assert found.record["residuals"]["check"]["rms"] < 0.004
    assert "air" in found.warnings[0]


def test_constraints_bend_no_further_than_the_noise(marks):
    measured, _ = fixes()
    found = placed(measured, mode="constraints", control_points=marks)
    assert 0 < found.record["bent_by"] < 0.06
    assert abs(found.record["control_points"][0]["residual"]) < 0.006


def test_nothing_is_done_without_fixes_or_when_off():
    assert placed(None) is None
    assert placed(fixes()[0], mode="off") is None


def test_another_system_is_used_when_asked():
    found = placed(fixes()[0], epsg=25832)
    assert found.record["epsg"] == 25832
    assert np.abs(errors(found)).max() < 0.02  # both datums are the same in PROJ


def test_a_flight_too_short_for_its_fixes_has_no_place():
    with pytest.raises(NotEnoughDataError, match="heading"):
        placed(fixes(sigma=30.0, outliers=0.0)[0])


def test_a_doubtful_heading_is_a_warning():
    found = placed(fixes(sigma=0.5)[0])
    assert "heading" in found.warnings[0]


def test_fixes_outside_the_trajectory_are_no_fixes():
    measured, _ = fixes()
    late = Fixes(
        measured.times + 100, measured.places, measured.covariances, Counter({"messages": 9})
    )
    with pytest.raises(NotEnoughDataError, match="0 of 9"):
        placed(late)


def test_control_points_in_another_system_are_told(tmp_path):
    path = tmp_path / "marks.csv"
    path.write_text("id,x,y,z,radius\nA,2600000,1200000,500,0.5\n", encoding="utf-8")
    with pytest.raises(UsageError, match="--epsg"):
        placed(fixes()[0], control_points=path)


def test_without_fixes_control_points_speak_the_language_of_the_map(tmp_path):
    off = np.array([0.1, -0.05, 0.08])
    lines = [
        f"{name.split(',')[0]},{x + off[0]},{y + off[1]},{z + off[2]},0.5"
        for name, (x, y, z) in list(MARKS.items())[:-1]
    ]
    path = tmp_path / "marks.csv"
    path.write_text("id,x,y,z,radius\n" + "\n".join(lines), encoding="utf-8")
    found = placed(None, control_points=path)
    assert found.crs_wkt is None
    assert np.allclose(found.to_projected(np.zeros((1, 3))), off, atol=0.005)


def site_grid(tmp_path, *, wrong=None, picked=5, head="id,x,y,z,map_x,map_y,map_z,use"):
    """Marks on a grid that is turned by 30° and far away; a mark is seen to 2 cm in the map."""
    rng, grid = (
        np.random.default_rng(4),
        Placement(np.radians(30), np.array([5e3, 1e4, 100.0]), np.zeros(4)),
    )
    lines = [head]
    for i, (name, place) in enumerate(MARKS.items()):
        mark, use = name.split(",")
        there = grid.to_level(np.array([place]))[0] + (2.0 if mark == wrong else 0.0)
        seen = np.array(place) + 0.01 * rng.normal(size=3)
        in_map = ",".join(f"{v:.3f}" for v in seen) if i < picked else ",,"
        lines.append(f"{mark},{there[0]:.4f},{there[1]:.4f},{there[2]:.4f},{in_map},{use}")
    path = tmp_path / "grid.csv"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path, grid


def test_marks_seen_in_the_map_put_it_on_a_site_grid_without_gnss(tmp_path):
    path, grid = site_grid(tmp_path)
    found = placed(None, control_points=path)
    points = np.random.default_rng(3).uniform(-15, 15, (100, 3))
    off = found.to_projected(points) - grid.to_level(points)
    assert np.abs(off).max() < 0.03
    assert np.abs(off[:, 2]).max() < 0.006, "the floor around the marks says how high they are"
    assert found.crs_wkt is None
    (check,) = [row for row in found.record["control_points"] if row["id"] == "floor2"]
    assert check["use"] == "check"
    assert check["picked_off"] < 0.04


def test_a_mark_that_disagrees_is_named_and_not_believed(tmp_path):
    path, grid = site_grid(tmp_path, wrong="floor3", picked=8)
    found = placed(None, control_points=path)
    assert (
        np.abs(found.to_projected(np.zeros((1, 3))) - grid.to_level(np.zeros((1, 3)))).max() < 0.03
    )
    (one,) = found.record["contradictions"]
    assert one["marks"] == ["floor3"]
    assert one["off"] == pytest.approx(3.46, abs=0.05)
    assert not one["used"]


def test_marks_on_a_grid_that_nobody_has_seen_in_the_map_say_the_way_out(tmp_path):
    path, _ = site_grid(tmp_path, picked=0)
    with pytest.raises(NotEnoughDataError, match="map_x, map_y, map_z"):
        placed(None, control_points=path)


def test_one_mark_is_too_few_without_gnss(tmp_path):
    path, _ = site_grid(tmp_path, picked=1)
    with pytest.raises(NotEnoughDataError, match="1 of 8 control points"):
        placed(None, control_points=path)


def test_marks_in_a_named_system_give_the_map_its_system(tmp_path):
    rng = np.random.default_rng(4)
    places = on_earth(np.array(list(MARKS.values())))
    lines = ["id;lat;lon;height;map_x;map_y;map_z"]
    for name, place, at in zip(MARKS, places, MARKS.values(), strict=True):
        seen = ";".join(f"{v:.3f}" for v in np.array(at) + 0.01 * rng.normal(size=3))
        lines.append(f"{name.split(',')[0]};{place[1]:.10f};{place[0]:.10f};{place[2]:.4f};{seen}")
    path = tmp_path / "marks.csv"
    path.write_text("\n".join(lines), encoding="utf-8")
    found = placed(None, control_points=path, epsg=25832)
    assert 'AUTHORITY["EPSG","25832"]' in found.crs_wkt
    assert np.abs(errors(found)).max() < 0.04
    assert found.record["control_point_columns"]["longitude"] == "lon"
