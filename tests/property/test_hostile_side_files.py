# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is given beside a recording or kept between runs: with any bytes changed, it is read or refused."""

from __future__ import annotations

import hashlib
import json
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import example, given

from bentwing.base.clock import Clock
from bentwing.base.errors import BentwingError
from bentwing.base.sealed import read_sealed, write_sealed
from bentwing.closing.joining.stored import read_comparison, read_survey, write_comparison
from bentwing.closing.loop_file import read_loops
from bentwing.closing.places import Agreement, Candidate
from bentwing.fleet.groups import ANSWER, finished_merging
from bentwing.fleet.manifest import read_manifest
from bentwing.map.chunk import MapChunk
from bentwing.map.read import read_points
from bentwing.map.writer import open_map
from bentwing.products.area import read_area
from bentwing.recording.gnss_files.read import read_fix_file
from bentwing.recording.urdf import urdf_transform
from support.changed_bytes import EDITS, SHARED, changed, outcome

START_NS = 1_700_000_000 * 10**9
N = 500


def octree(path):
    noise = np.random.default_rng(0)
    with open_map(path, "copc.laz", START_NS) as writer:
        points = noise.uniform(-5, 5, (N, 3))
        writer.write(MapChunk(points, np.sort(noise.uniform(0, 9, N)), np.full(N, 3, np.float32)))


def geojson(path):
    area = {"type": "Polygon", "coordinates": [[[0, 0], [4.5, 0], [4, 3], [0, 0]]]}
    system = {"type": "name", "properties": {"name": "EPSG:25832"}}
    path.write_text(json.dumps({"type": "Feature", "geometry": area, "crs": system}))


def dxf(path):
    ezdxf = pytest.importorskip("ezdxf", reason='needs pip install "bentwing[products]"')
    drawing = ezdxf.new(units=6)
    drawing.modelspace().add_lwpolyline([(0, 0), (4, 0), (4, 3, 0, 0, 1.0)], close=True)
    drawing.saveas(path)


def urdf(path):
    joint = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="1 2 3"/></joint>'
    path.write_text(f"<robot>{joint}</robot>")


def transform(path):
    try:
        urdf_transform(path, "a", "b")
    except ValueError as error:  # which is what it promises
        raise BentwingError(str(error)) from error


def fixes(path):
    head = "%  GPST  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)  sdne(m)  sdeu(m)  sdun(m) age(s)  ratio\n"
    row = "2023/11/14 22:13:{:02d}.250 47.1 11.2 600.5 1 12 0.010 0.020 0.030 0.005 -0.006 0.007 0.00 3.1\n"
    path.write_text(head + "".join(row.format(39 + i) for i in range(9)))


def sentences(path):
    rows = [
        f"GNGGA,2213{20 + i}.25,4706.0,N,01112.0,E,4,12,0.8,552.3,M,48.2,M,1.0,0001"
        for i in range(9)
    ]
    path.write_text("".join(f"${row}*00\r\n" for row in rows))


def signed(path):
    """The same with the checksums that its sentences would have, so that they are read."""
    rows = [row.partition(b"*")[0].lstrip(b"$") for row in path.read_bytes().splitlines()]
    sums = (np.bitwise_xor.reduce(np.frombuffer(row or b"\0", np.uint8)) for row in rows)
    path.write_bytes(
        b"".join(b"$%s*%02X\r\n" % (row, n) for row, n in zip(rows, sums, strict=True))
    )
    read_fixes(path)


def read_fixes(path):
    read_fix_file(path, Clock(START_NS), (0.0, 60.0))


def comparison(path):
    agreement = Agreement(*[0.5] * len(Agreement.__dataclass_fields__))
    write_comparison(path, [Candidate(0, 1, 0.5, None, 9, None, agreement)])


def told(write):
    """What a sealed file says in JSON, without its arrays."""

    def described(path):
        write(path)
        path.write_text(json.dumps(read_sealed(path)[1]))

    return described


def sealed_again(path):
    """What a file is taken for whose seal is right, as whoever makes a hostile one takes care of."""
    content = path.read_bytes()
    path.write_bytes(content + hashlib.sha256(content).digest())
    read_comparison(path)
    read_survey(path, "a", None, None)


def told_again(path):
    try:
        described = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        return
    if isinstance(described, dict):
        write_sealed(path, described, {str(i): np.ones(3) for i in range(9)})
        assert read_comparison(path) is None or isinstance(read_comparison(path), list)
        read_survey(path, "a", None, None)


def answer(path):
    groups = [{"runs": ["a"], "folder": "map", "state": "merged", "n_links": 0}]
    path.write_text(json.dumps({"request": "r", "groups": groups}))


def read_answer(path):
    (path.parent / ANSWER).write_bytes(path.read_bytes())
    finished_merging(SimpleNamespace(place=path.parent, request="r"))


def text(content):
    return lambda path: path.write_text(content)


LISTED = "payload: dataset:{}\nrecordings: [{{recording: a.bag, name: a, start: 5}}, {{recording: [b.bag, c.bag]}}]\n"
READERS = {
    "map.copc.laz": (octree, read_points),
    "area.geojson": (geojson, read_area),
    "area.dxf": (dxf, read_area),
    "robot.urdf": (urdf, transform),
    "fixes.pos": (fixes, read_fixes),
    "fixes.nmea": (sentences, signed),
    "manifest.yaml": (text(LISTED.format("botanic-garden")), read_manifest),
    "manifest.csv": (text('recording,name,start\n"a.bag; b.bag",a,5\nc.bag,,\n'), read_manifest),
    "loops.yaml": (
        text("loops:\n- {times: [12.0, 95.5]}\n- {times: [1, 5], same: false}\n"),
        read_loops,
    ),
    "comparison.npz": (comparison, sealed_again),
    "comparison.json": (told(comparison), told_again),
    "answer.txt": (answer, read_answer),
}


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """Folder of a sound file for each reader, which reads it."""
    folder = tmp_path_factory.mktemp("sound")
    for name, (write, read) in READERS.items():
        write(folder / name)
        content = (folder / name).read_bytes()
        read(folder / name)
        (folder / name).write_bytes(content)
    return folder


@pytest.mark.parametrize("name", READERS)
@SHARED
@given(edits=EDITS)
@example(edits=[("cut", 0.0, 0)])
@example(edits=[("text", 0.5, 7)])
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_side_file_with_changed_bytes_is_read_or_refused(tmp_path, sound, name, edits):
    path = tmp_path / name
    path.write_bytes(changed((sound / name).read_bytes(), edits))
    assert outcome(READERS[name][1], path) in {None, BentwingError}


@pytest.mark.parametrize(
    "value",
    [
        "2024-13-45",
        "2024-01-01T99:99:99",
        "0b_",
        "0x_",
        "!!int ''",
        "!!bool x",
        "!!timestamp x",
        '"a\\0b"',
        "9" * 5000,
    ],
)
def test_a_value_that_its_form_or_tag_does_not_allow_is_named_with_its_line(tmp_path, value):
    path = tmp_path / "loops.yaml"
    path.write_text(f"loops:\n- {value}\n")
    with pytest.raises(BentwingError, match=r"loops\.yaml: not valid YAML .*line 2"):
        read_loops(path)


@pytest.mark.parametrize("number", ["1" + "0" * 400, "1e308", "1e10"])
def test_a_corner_beyond_the_earth_is_refused(tmp_path, number):
    path = tmp_path / "area.geojson"
    path.write_text(f'{{"type": "Polygon", "coordinates": [[[{number}, 0], [1, 0], [1, 1]]]}}')
    with pytest.raises(BentwingError, match=r"area\.geojson: "):
        read_area(path)


def test_a_drawing_in_parsecs_is_not_drawn_in_millimetres(tmp_path):
    """Its circle would have 10^10 corners: it is refused, or read, before memory is full."""
    ezdxf = pytest.importorskip("ezdxf", reason='needs pip install "bentwing[products]"')
    drawing = ezdxf.new(units=20)
    drawing.modelspace().add_circle((0, 0), 1.0)
    drawing.saveas(tmp_path / "area.dxf")
    with pytest.raises(BentwingError, match="not on Earth; check unit"):
        read_area(tmp_path / "area.dxf")


def test_lines_without_an_end_are_not_held(tmp_path):
    import tracemalloc

    path = tmp_path / "fixes.pos"
    with path.open("wb") as file:
        file.truncate(2**26)
    tracemalloc.start()
    with pytest.raises(BentwingError, match="neither a solution of RTKLIB"):
        read_fixes(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2**22
