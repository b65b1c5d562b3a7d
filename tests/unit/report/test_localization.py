# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the report of a localized run says of place, uncertainty and changes."""

import re
from dataclasses import asdict

import numpy as np
import pytest

from bentwing.base.trajectory import Trajectory
from bentwing.map.change import Change
from bentwing.report.drawn import Drawn
from bentwing.report.localization import localization_section
from bentwing.report.texts import ENGLISH

TIMES = np.linspace(0.0, 20.0, 200)
WAY = Trajectory(
    TIMES,
    np.column_stack([1 + TIMES / 4, np.full(200, 2.0), np.full(200, 1.0)]),
    np.tile([0.0, 0.0, 0.0, 1.0], (200, 1)),
)
CRATE = np.random.default_rng(0).uniform([3, 3, 0], [4, 4, 1.2], (3000, 3))
FLOOR = np.random.default_rng(1).uniform([0, 0, 0], [8, 5, 0.01], (20_000, 3))
PLACED = {
    "linear": {
        "map": [0.0, 0.0, 0.0],
        "projected": [500_000.0, 5_300_000.0, 400.0],
        "matrix": np.eye(3).tolist(),
    },
    "epsg": 25832,
}


def record(change, **more):
    found = {
        "map": "surveys/spring",
        "map_points": 1_234_567,
        "map_places": 4,
        "places": 3,
        "candidates": [{"span": [0, 8]}, {"span": [0, 8]}, {"span": [8, 16]}, {"span": [16, 20]}],
        "supporters": [0, 1, 3],
        "largest_deformation": 0.012,
        "points": 1000,
        "points_beyond_map": 37,
        "changed_areas": [asdict(one) for one in change.areas()],
    }
    accuracy = {"horizontal": 0.0065, "vertical": 0.005, "heading": np.radians(0.08)}
    closing = {"applied": True, "inlier_share": 0.991, "largest_translation": 0.0045}
    return {
        "localization": found,
        "expected_accuracy": accuracy,
        "loop_closure": closing,
        **more,
    }


def section(change, **more):
    drawn = Drawn.of(record(change, **more), WAY, (FLOOR, np.linspace(0, 20, len(FLOOR))), ENGLISH)
    return re.sub(r"data:[^\"]*", "", localization_section(drawn, change))


def test_it_says_which_places_were_recognized_and_how_certain_the_place_is():
    said = section(Change(CRATE, np.empty((0, 3))))
    assert "spring, 1,234,567 points, 4 places" in said
    assert "2 of 3; 3 pairs with places of the map agree" in said
    assert "6.5 mm horizontally, 5.0 mm vertically, 0.080° in heading" in said
    assert "99.1 % of the matches agree" in said
    assert "3.7 %" in said


@pytest.mark.parametrize(
    ("placed", "begin", "crate"),
    [
        (None, "x 1.000, y 2.000, z 1.000 m", (3.5, 3.5, "0.00 to 1.20")),
        (
            PLACED,
            "x 500,001.000, y 5,300,002.000, z 401.000 m",
            (500_003.5, 5_300_003.5, "400.00 to 401.20"),
        ),
    ],
)
def test_places_are_in_the_coordinates_of_the_map(placed, begin, crate):
    said = section(Change(CRATE, np.empty((0, 3))), georeference=placed)
    assert begin in said
    numbers = re.findall(r'<td class="n">([^<]*)</td>', said.split("What has changed")[1])
    assert float(numbers[1].replace(",", "")) == pytest.approx(crate[0], abs=0.02)
    assert float(numbers[2].replace(",", "")) == pytest.approx(crate[1], abs=0.02)
    assert numbers[3] == crate[2]


def test_every_changed_area_is_in_the_table_and_the_largest_have_pictures():
    """One appeared, one disappeared: a plan of both and a picture of each."""
    said = section(Change(CRATE, CRATE + np.array([3.0, -2.0, 0.0])))
    assert said.count("<figure") == 3
    assert said.count(">appeared</td>") == said.count(">disappeared</td>") == 1


def test_without_changes_it_says_so_and_draws_nothing():
    said = section(Change(np.empty((0, 3)), np.empty((0, 3))))
    assert "Nothing has changed" in said
    assert "<figure" not in said


def test_a_run_that_was_not_localized_has_no_such_section():
    drawn = Drawn.of({}, WAY, (FLOOR, np.zeros(len(FLOOR))), ENGLISH)
    assert not localization_section(drawn, None)
