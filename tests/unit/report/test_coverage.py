# SPDX-License-Identifier: MIT OR Apache-2.0
import re

import numpy as np
import pytest

from bentwing.evaluate.revisits import revisit_consistency
from bentwing.report.colours import TIME
from bentwing.report.coverage import draw_coverage
from bentwing.report.loops import closing_table, revisits_table
from bentwing.report.picture import View
from bentwing.report.plot import Series, line_plot
from bentwing.report.stretches import degenerate_spans, spans_sentence
from bentwing.report.texts import ENGLISH
from bentwing.report.way import Way, draw_way


def floor(n=40_000, size=8.0, seed=0):
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(0, size, (n, 2)), rng.normal(0.2, 0.0005, n)])


def test_density_is_that_of_the_whole_map_and_visits_are_counted():
    points = floor()
    left = points[:, 0] < 4.0
    times = np.where(left & (np.arange(len(points)) % 2 == 0), 100.0, 5.0)
    found = draw_coverage(points, times, n_points=10 * len(points))
    # 40,000 of 400,000 points on 64 m²
    assert found.median_density == pytest.approx(400_000 / 64, rel=0.15)
    assert found.area == pytest.approx(64, rel=0.1)
    assert found.share_again == pytest.approx(0.5, abs=0.05)
    assert found.density.count("<image") == found.visits.count("<image") == 1


def test_a_single_point_has_no_coverage():
    assert draw_coverage(np.zeros((1, 3)), np.zeros(1), 1) is None


def doubled(offset):
    """A floor seen at 5 s and, `offset` m higher, at 105 s."""
    below, above = floor(), floor(seed=1) + np.array([0, 0, offset])
    times = np.repeat([5.0, 105.0], len(below))
    return revisit_consistency(np.concatenate([below, above]), times)


def test_loops_are_listed_and_those_that_disagree_are_told():
    agreeing, apart = revisits_table(doubled(0.002), 0.01), revisits_table(doubled(0.04), 0.01)
    for text in ("0 \N{EN DASH} 20 s", "100 \N{EN DASH} 120 s", "within 20 mm", "1 of 1 loops"):
        assert text in agreeing, text
    assert "2.0 mm" in agreeing
    assert "does not agree" in apart
    assert "0 of 1 loops agree" in apart


def test_a_map_without_revisits_says_so():
    assert "No flat surface" in revisits_table(None, None)


def test_the_closing_of_loops_is_told_with_its_reason():
    record = {
        "applied": False, "reason": "did not settle", "n_stretch_pairs": 12, "n_revisits": 3,
        "inlier_share": 0.91, "residual_rms": 1.02, "largest_translation": 0.0123,
        "largest_rotation": 0.001,
        "iterations": [{"n_far_matches": 777, "translation": 0.004}],
    }  # fmt: skip
    text = closing_table(record, asked=True)
    for part in ("rejected: did not settle", "91.0 %", "12.3 mm", "777 matches", "4.00 mm"):
        assert part in text, part
    assert "open-loop" in closing_table(None, asked=False)


def windows(flags):
    return [{"time": float(i + 1), "degenerate": flag} for i, flag in enumerate(flags)]


def test_degenerate_windows_become_stretches():
    spans = degenerate_spans(windows([False, True, True, False, True]))
    assert spans == [(1.0, 3.0), (4.0, 5.0)]
    assert "for 3 s" in spans_sentence(spans, ENGLISH)
    assert "from 1.0 to 3.0 s" in spans_sentence(spans, ENGLISH)
    assert "all the time" in spans_sentence(degenerate_spans(windows([False])), ENGLISH)


def test_stretches_are_marked_in_a_plot():
    series = [Series("a", np.arange(10.0), np.arange(10.0))]
    plain, marked = (line_plot(series, "x", "y", bands=bands) for bands in ((), [(2.0, 4.0)]))
    assert marked.count("<rect") == plain.count("<rect") + 1


def test_a_way_changes_its_colour_where_its_value_does():
    view = View(np.zeros((50, 50, 3), np.uint8), 0.1, 0.0, 5.0, 0.0, 1.0)
    x = np.linspace(0, 5, 11)
    one = draw_way(view, Way(x, x))
    two = draw_way(view, Way(x, x, (x > 2.5).astype(float), ("000000", "ff0000")))
    assert one.count("<polyline") == 2  # casing and line
    assert two.count("<polyline") == 3
    assert "#000000" in two
    assert "#ff0000" in two
    by_time = draw_way(view, Way(x, x, np.linspace(0, 1, 11), TIME))
    assert by_time.count("<polyline") == 1 + 11
    assert draw_way(view, Way(x[:0], x[:0])) == ""


def test_a_way_is_not_drawn_where_nobody_flew():
    view = View(np.zeros((50, 50, 3), np.uint8), 1.0, 0.0, 50.0, 0.0, 1.0)
    x = np.r_[np.linspace(0, 5, 60), np.linspace(30, 35, 60)]
    drawn = draw_way(view, Way(x, 0 * x + 10))
    lines = [re.findall(r"([\d.]+),", points) for points in re.findall(r'points="([^"]*)"', drawn)]
    assert len(lines) == 4  # casing and line of two stretches
    assert all(float(line[-1]) - float(line[0]) < 6 for line in lines)
