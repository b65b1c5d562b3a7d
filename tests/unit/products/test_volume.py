# SPDX-License-Identifier: MIT OR Apache-2.0
import json

import numpy as np
import pytest

from bentwing.base.errors import InputError, UsageError
from bentwing.products import Area, measure_volume
from support.known_points import write_run

SIGMA = 0.01
RADIUS, HEIGHT = 4.0, 2.5
TRUTH = 0.5 * np.pi * RADIUS**2 * HEIGHT  # m³, of a paraboloid
SQUARE = [[(-5, -5), (5, -5), (5, 5), (-5, 5)]]


def paraboloid(places):
    return np.maximum(HEIGHT * (1 - (places**2).sum(axis=1) / RADIUS**2), 0.0)


def tilted(places):
    """A plane of 5 % and 2 % of slope."""
    return 3.0 + places @ [0.05, -0.02]


def scanned(heights, seed, density=300, hole=None, sigma=SIGMA):
    """Points of a surface over 14 x 14 m, twice as dense on one side, with noise and a hole."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(-7, 7, (density * 196, 2))
    kept = rng.uniform(size=len(places)) < 0.5 + 0.5 * (places[:, 0] > 0)
    if hole is not None:
        centre, size = hole
        kept &= np.abs(places - centre).max(axis=1) > size / 2
    places = places[kept]
    return np.column_stack([places, heights(places) + rng.normal(0, sigma, len(places))])


def pile(places):
    return tilted(places) + paraboloid(places)


@pytest.fixture
def made(tmp_path):
    """Return a maker of runs that state by how much their surfaces scatter."""

    def make(name, points, stated=0.002, **record):
        accuracy = {"expected_accuracy": {"map_thickness": stated}} if stated else {}
        return write_run(tmp_path / name, points, **accuracy, **record)

    return make


@pytest.mark.parametrize("base", ["plane", "dtm"])
def test_a_pile_has_its_volume_within_half_a_percent_and_the_stated_uncertainty(made, base):
    run = made("run", scanned(pile, 110))
    found = measure_volume(run, Area.of(SQUARE), base=base)
    assert found.volume == pytest.approx(TRUTH, rel=0.005)
    assert abs(found.volume - TRUTH) < 2 * found.sigma
    assert found.sigma < 0.005 * TRUTH
    # 1.5 points in a cell on one half, 3 on the other: of e^-1.5 and e^-3 of the cells nothing is known.
    assert found.measured == pytest.approx(1 - (np.exp(-1.5) + np.exp(-3)) / 2, abs=0.02)
    assert found.area == pytest.approx(100.0)


def test_a_pile_is_what_is_there_after_and_not_before(made):
    before, after = made("before", scanned(tilted, 111)), made("after", scanned(pile, 112))
    found = measure_volume(after, Area.of(SQUARE), base=before)
    assert found.volume == pytest.approx(TRUTH, rel=0.005)
    assert abs(found.volume - TRUTH) < 2 * found.sigma
    turned = measure_volume(before, Area.of(SQUARE), base=after)
    assert turned.volume == pytest.approx(-TRUTH, rel=0.005)
    assert turned.below > 0.99 * TRUTH > 99 * turned.above


def test_the_uncertainty_holds_the_errors_of_many_flights(made):
    """Each flight has an offset of its own between surface and base, as the map states it."""
    rng = np.random.default_rng(113)
    inside = 0
    for flight in range(8):
        points = scanned(pile, 200 + flight, density=60)
        points[np.hypot(*points[:, :2].T) < 5.5, 2] += rng.normal(0, 0.005)
        run = made(f"run{flight}", points, stated=0.005)
        found = measure_volume(run, Area.of([[(-4, -4), (4, -4), (4, 4), (-4, 4)]]), cell=0.2)
        truth = TRUTH  # the pile touches the edge of this square
        inside += abs(found.volume - truth) < 2 * found.sigma
    # 95 % of 8; fewer than 6 have a probability below 1 %.
    assert inside >= 6


def test_a_gap_is_interpolated_and_makes_the_result_less_certain(made):
    hole = ((1.0, 0.5), 0.9)
    whole = measure_volume(made("whole", scanned(pile, 114)), Area.of(SQUARE))
    found = measure_volume(made("gap", scanned(pile, 114, hole=hole)), Area.of(SQUARE))
    # 0.81 of 100 m², of which e^-3 was empty before
    more = found.interpolated - whole.interpolated
    assert more == pytest.approx(0.0081 * (1 - np.exp(-3)), abs=0.001)
    assert abs(found.volume - TRUTH) < 2 * found.sigma
    assert found.parts["gaps"] > whole.parts["gaps"]


def test_what_was_not_seen_is_left_out_and_said(made):
    run = made("run", scanned(pile, 115, hole=((0.0, 0.0), 7.0)))
    found = measure_volume(run, Area.of(SQUARE))
    assert found.unknown > 0.05
    assert "was not seen and is left out" in found.sentence()


def test_steep_sides_are_not_cut_off(made):
    def cone(places):
        return np.maximum(3.0 - np.hypot(*places.T), 0.0)  # 45 degrees

    found = measure_volume(made("run", scanned(cone, 116)), Area.of(SQUARE))
    assert found.volume == pytest.approx(np.pi * 9.0, rel=0.005)


def test_a_branch_above_a_pile_does_not_count(made):
    points = scanned(pile, 117)
    branch = np.column_stack([points[:2000, :2] * 0.2, points[:2000, 2] * 0 + 9.0])
    found = measure_volume(made("run", np.vstack([points, branch])), Area.of(SQUARE))
    assert found.volume == pytest.approx(TRUTH, rel=0.005)


def test_a_polygon_with_a_hole_covers_what_is_between(made, tmp_path):
    rings = [[*SQUARE[0], SQUARE[0][0]], [(-1, -1), (-1, 1), (1, 1), (1, -1), (-1, -1)]]
    path = tmp_path / "area.geojson"
    polygon = {
        "type": "Feature",
        "properties": {},
        "geometry": {"type": "Polygon", "coordinates": rings},
    }
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [polygon]}))
    found = measure_volume(made("run", scanned(pile, 118)), path)
    middle = 4 * HEIGHT - HEIGHT / RADIUS**2 * 8 / 3  # of the hole, by integration
    assert found.area == pytest.approx(96.0)
    assert found.volume == pytest.approx(TRUTH - middle, rel=0.005)


def test_a_map_that_states_no_accuracy_is_told(made):
    found = measure_volume(made("run", scanned(pile, 119), stated=None), Area.of(SQUARE))
    assert not found.is_stated
    assert found.parts["map"] == 0.0
    assert "states no accuracy" in found.sentence()


def test_an_area_beside_the_map_is_refused(made):
    far = Area.of([[(100, 100), (101, 100), (101, 101)]])
    with pytest.raises(InputError, match="are its coordinates those of the map"):
        measure_volume(made("run", scanned(pile, 120)), far)


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"type": "Point", "coordinates": [0, 0]}',
             '{"type": "Polygon", "coordinates": [[[0, 0], [1, 1]]]}',
             '{"type": "Polygon", "coordinates": [[[0, 0], [1, 1], [2, 2]]]}',
             '{"type": "Polygon", "coordinates": [[[0, 0], [1, NaN], [2, 0]]]}'],
)  # fmt: skip
def test_a_file_without_a_polygon_is_refused(made, tmp_path, text):
    (tmp_path / "area.geojson").write_text(text)
    with pytest.raises(InputError, match=r"area\.geojson: (not readable as an area|holds )"):
        measure_volume(made("run", scanned(tilted, 121)), tmp_path / "area.geojson")


@pytest.mark.parametrize("cell", [0.0, np.nan, 1e-6])
def test_a_cell_that_cannot_be_used_is_refused(made, cell):
    with pytest.raises(UsageError, match="--cell"):
        measure_volume(made("run", scanned(tilted, 122)), Area.of(SQUARE), cell=cell)
