# SPDX-License-Identifier: MIT OR Apache-2.0
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from bentwing.evaluate.robust import Line
from bentwing.evaluate.statistics import Box
from bentwing.report.charts import HEIGHT, BoxGroup, Sample, box_plot, histogram, scatter
from bentwing.report.svg import standalone


def heights(drawing, tag, attribute):
    tree = ET.fromstring(drawing)
    return [float(node.get(attribute)) for node in tree.iter() if node.tag.endswith(tag)]


def test_a_box_has_its_median_between_the_quartiles_and_the_whiskers_outside():
    boxes = [Box.of(np.linspace(-1, 1, 101)), Box.of(np.linspace(0, 4, 101))]
    drawing = box_plot([BoxGroup("all", boxes)], ["5", "10"], ("way, m", "drift, mm per m"), 1.0)
    tops, tall = heights(drawing, "rect", "y"), heights(drawing, "rect", "height")
    for i, centre in enumerate(heights(drawing, "circle", "cy")):
        assert centre == pytest.approx(tops[i] + tall[i] / 2, abs=0.2)
        whisker = re.findall(r"M[\d.]+ ([\d.]+)V", drawing)
        assert float(whisker[2 * i]) > tops[i] + tall[i]  # the 3 % end is lower on the page
    # the quartiles of the second are half as far apart as its ends, twice those of the first
    assert tall[1] == pytest.approx(2 * tall[0], rel=0.02)


def test_a_histogram_shows_the_share_of_all_values_also_of_those_beyond():
    values = np.concatenate([np.full(50, 0.01), np.full(50, 9.0)])
    drawing = histogram([Sample("a", values)], "error, cm", (-1.0, 1.0), "half of them")
    # half of the values in one bin: the axis ends at the tick above 50 %
    assert ">60<" in drawing
    assert ">80<" not in drawing
    assert "half of them" in drawing
    ET.fromstring(drawing)


def test_every_sample_has_its_name_in_the_legend():
    samples = [Sample(name, np.zeros(3)) for name in ("x", "y & z")]
    drawing = histogram(samples, "error, cm", (-1.0, 1.0))
    assert "y &amp; z" in drawing


def test_dots_beyond_the_axis_stay_on_the_page():
    x = np.linspace(0, 2, 50)
    drawing = scatter(x, 100 * x, ("speed, m/s", "error, cm"), Line(1.0, 0.5), 10.0)
    assert all(0 <= y <= HEIGHT for y in heights(drawing, "circle", "cy"))
    assert len(heights(drawing, "circle", "cy")) == 50


def test_a_drawing_of_its_own_has_size_font_and_paper():
    file = standalone(histogram([Sample("a", np.zeros(3))], "error, cm", (-1.0, 1.0)))
    root = ET.fromstring(file)
    assert (root.get("width"), root.get("height")) == ("640", "340")
    assert "font-family" in file
    with pytest.raises(ValueError, match="view box"):
        standalone("<p>")
