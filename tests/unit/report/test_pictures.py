# SPDX-License-Identifier: MIT OR Apache-2.0
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from bentwing.base.errors import UsageError
from bentwing.report.colours import HEIGHT
from bentwing.report.geotiff import write_geotiff
from bentwing.report.lettering import Lettering, bar_length, coordinate, lettered, multiples, write
from bentwing.report.picture import View, project
from bentwing.report.view.pictures import round_projection


def view(rows=130, columns=300, pixel=0.05):
    image = np.random.default_rng(0).integers(0, 200, (rows, columns, 3)).astype(np.uint8)
    return View(image, pixel, 500_000.0, 5_400_000.0, 0.0, 1.0)


@pytest.mark.parametrize("pixel", [0.001, 0.05, 0.5, 20.0])
def test_the_bar_is_a_round_length_of_at_most_a_quarter(pixel):
    metres, pixels = bar_length(pixel, 800)
    assert pixels == round(metres / pixel)
    assert 0.09 * 800 < pixels <= 200
    assert f"{metres:e}"[0] in "125"


def test_around_the_picture_are_grid_bar_legend_and_arrow():
    shown = view()
    image = lettered(shown, Lettering("PLAN", "N", "m", HEIGHT))
    inside = image[44:174, 200:500]
    is_line = (inside != shown.image).any(axis=2)
    columns, rows = (np.flatnonzero(is_line.all(axis=axis)) for axis in (0, 1))
    # 15 by 6.5 m: lines each 5 m, at coordinates that are multiples of it
    assert columns.tolist() == [0, 100, 200, 299]
    assert rows.tolist() == [0, 100]
    assert np.array_equal(inside[~is_line], shown.image[~is_line])
    foot = image[174:]
    dark = (foot < 255).any(axis=2)
    metres, pixels = bar_length(shown.pixel, 300)
    longest = max(len(run) for run in "".join("#" if d else " " for d in dark[67, :600]).split())
    assert (metres, longest) == (2.0, pixels)
    legend = foot[60, -316:-16].astype(int)
    assert len(np.unique(legend, axis=0)) > 100
    assert (image[44:90, 16:60] < 255).any()


def test_the_grid_has_round_coordinates():
    assert multiples(-3.2, 7.1, 2.5) == [-2.5, 0.0, 2.5, 5.0]
    assert [coordinate(v) for v in (-0.0, 2.5, 12.0, 631_020.0)] == ["0", "2.5", "12", "631,020"]


def test_a_pixel_is_a_round_length():
    rng = np.random.default_rng(0)
    for size in (0.7, 33.0, 4000.0):
        x, y = rng.uniform(-size, size, (2, 5000))
        seen = round_projection(x, y, np.zeros(5000))
        digits = f"{seen.pixel:e}"
        assert digits[0] in "125"
        assert digits[1:8] == ".000000"
        assert seen.left / seen.pixel == pytest.approx(round(seen.left / seen.pixel), abs=1e-6)
        assert max(seen.front.shape[1] / 2400, seen.front.shape[0] / 1800) > 0.35
        assert (seen.front >= 0).sum() > 1000


def test_letters_are_drawn_and_cut_at_the_edge():
    image = np.full((20, 40, 3), 255, np.uint8)
    write(image, (0, 0), "1", size=1)
    assert (image[:7, :5] < 255).any(axis=2).sum() == 10  # one column of five, two feet, a hook
    write(image, (15, 35), "8", size=3)


def decoded(path):
    """Tags and image of a TIFF, read by the book."""
    data = path.read_bytes()
    assert data[:4] == b"II*\0"
    (at,) = struct.unpack_from("<I", data, 4)
    (n,) = struct.unpack_from("<H", data, at)
    tags = {}
    for i in range(n):
        tag, kind, count = struct.unpack_from("<HHI", data, at + 2 + 12 * i)
        letter = {3: "H", 4: "I", 12: "d"}[kind]
        where = at + 10 + 12 * i
        if count * struct.calcsize(letter) > 4:
            (where,) = struct.unpack_from("<I", data, where)
        tags[tag] = struct.unpack_from(f"<{count}{letter}", data, where)
    assert list(tags) == sorted(tags)
    rows = b"".join(
        zlib.decompress(data[o : o + size]) for o, size in zip(tags[273], tags[279], strict=True)
    )
    steps = np.frombuffer(rows, np.uint8).reshape(tags[257][0], tags[256][0], 3)
    return tags, np.cumsum(steps, axis=1, dtype=np.uint8)


def test_a_geotiff_holds_the_picture_and_its_place(tmp_path):
    shown = view()
    write_geotiff(tmp_path / "top.tif", shown, 32633)
    tags, image = decoded(tmp_path / "top.tif")
    assert np.array_equal(image, shown.image)
    assert tags[33550] == (0.05, 0.05, 0.0)
    assert tags[33922][3:5] == (500_000.0, 5_400_000.0)
    keys = np.array(tags[34735]).reshape(-1, 4)
    assert dict(zip(keys[1:, 0].tolist(), keys[1:, 3].tolist(), strict=True)) == {
        1024: 1, 1025: 1, 3072: 32633
    }  # fmt: skip


def test_a_geotiff_is_read_by_another_library(tmp_path):
    shown = view()
    write_geotiff(tmp_path / "top.tif", shown, 32633)
    with Image.open(tmp_path / "top.tif") as image:
        assert np.array_equal(np.asarray(image), shown.image)
        assert image.tag_v2[34735][-1] == 32633


@pytest.mark.parametrize("epsg", [4326, 0, 70_000])
def test_degrees_are_no_metres(tmp_path, epsg):
    with pytest.raises(UsageError, match="projected"):
        write_geotiff(tmp_path / "top.tif", view(), epsg)
    assert not (tmp_path / "top.tif").exists()


def test_a_picture_can_have_a_given_frame():
    x = np.array([0.0, 1.0, 5.0])
    seen = project(x, x, x, width=100, max_height=50, frame=(-2.0, 2.0, -1.0, 1.0), close_gaps=0)
    assert seen.front.shape == (51, 101)
    assert (seen.left, seen.top) == (-2.0, 1.0)
    assert set(np.unique(seen.front)) == {-1, 0, 1}
