# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.base.errors import InputError
from bentwing.base.trajectory import Trajectory
from bentwing.closing.georeference.control_point_file import RADIUS, read_control_points
from bentwing.closing.georeference.control_points import ControlPoint, Standing, plane_around
from bentwing.closing.georeference.standing import with_places


def read(tmp_path, text):
    path = tmp_path / "points.csv"
    path.write_text(text, encoding="utf-8")
    return read_control_points(path)


def test_points_are_read_with_their_use(tmp_path):
    text = "# surveyed\nid, x, y, z, radius, use\nA,1,2,3,0.5,check\n\nB,4,5,6,0.25,\n"
    listed = read(tmp_path, text)
    first, second = listed.points
    assert not listed.in_degrees
    assert (first.name, first.use, second.use) == ("A", "check", "control")
    assert second.position.tolist() == [4, 5, 6]
    assert second.radius == 0.25


@pytest.mark.parametrize(
    "text",
    [
        "Punkt;Rechtswert;Hochwert;Höhe\nA;694750,708;5177601,273;427,364\n",
        "Name\tEasting [m]\tNorthing [m]\tElevation (m)\nA\t694750.708\t5177601.273\t427.364\n",
        "point,N,E,H\nA,5177601.273,694750.708,427.364\n",
    ],
)
def test_files_of_surveying_programs_are_read_as_they_are(tmp_path, text):
    (point,) = read(tmp_path, text).points
    assert point.position.tolist() == [694750.708, 5177601.273, 427.364]
    assert (point.name, point.radius, point.use, point.picked) == ("A", RADIUS, "control", None)


def test_degrees_and_places_in_the_map_are_recognized(tmp_path):
    listed = read(
        tmp_path, "id,lat,lon,h,map_x,map_y,map_z\nA,47.5,11.3,700,1,2,3\nB,47.6,11.2,701,,,\n"
    )
    first, second = listed.points
    assert listed.in_degrees
    assert first.position.tolist() == [11.3, 47.5, 700.0]
    assert first.picked.tolist() == [1, 2, 3]
    assert second.picked is None
    assert listed.columns["latitude"] == "lat"


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("id,x,y\nA,1,2\n", "no column z"),
        ("A,1,2,3\n", "must name id, x, y, z"),
        ("id,x,y,z,map_x,map_y,map_z\nA,1,2,3,1,2,b\n", "point 'A'"),
        ("id,x,y,z,radius\nA,1,2,b,1\n", "point 'A'"),
        ("id,x,y,z,radius\nA,1,2,3,-1\n", "point 'A'"),
        ("id,x,y,z,radius\nA,1,2\n", "point 'A'"),
        ("id,x,y,z,radius,use\nA,1,2,3,1,maybe\n", "control or check"),
        ("id,x,y,z,radius\nA,1,2,3,1\nA,1,2,3,1\n", "A twice"),
        ("id,x,y,z,radius\n", "holds no point"),
    ],
)
def test_a_bad_file_says_what_is_wrong(tmp_path, text, what):
    with pytest.raises(InputError, match=what):
        read(tmp_path, text)


def patch(offset, noise=0.01, n=2000):
    rng = np.random.default_rng(0)
    points = np.c_[rng.uniform(-1, 1, (n, 2)), offset + noise * rng.normal(size=n)]
    return points, np.linspace(3, 4, n)


def test_the_plane_through_a_patch_has_its_height():
    for offset in (0.0, 0.2, -0.25):
        plane = plane_around(*patch(offset), np.zeros(3), 0.3, slack=0.3)
        assert plane is not None
        assert abs(plane.middle[2] - offset) < 0.002
        assert plane.normal[2] > 0.999
        assert 0.008 < plane.thickness < 0.012
        assert 3 < plane.time < 4


def test_what_stands_on_a_floor_does_not_lift_it():
    points, times = patch(0.0)
    post = np.c_[np.full((30, 2), 0.05), np.linspace(0.05, 0.3, 30)]
    plane = plane_around(np.r_[points, post], np.r_[times, times[:30]], np.zeros(3), 0.3)
    assert plane is not None
    assert abs(plane.middle[2]) < 0.003


def test_where_there_is_no_surface_there_is_no_plane():
    points, times = patch(0.0)
    assert plane_around(points, times, np.array([9.0, 9, 9]), 0.3) is None
    line = np.c_[np.linspace(-1, 1, 500), np.zeros((500, 2))]
    assert plane_around(line, np.zeros(500), np.zeros(3), 0.3) is None


def test_a_time_of_standing_stands_for_a_place_in_the_map(tmp_path):
    (point,) = read(
        tmp_path,
        "id;x;y;z;time;until;foot_x;foot_y;foot_z;sigma\nA;1;2;3;12,5;14;0;0;-0,35;0,01\n",
    ).points
    assert (point.standing.first, point.standing.last) == (12.5, 14.0)
    assert point.standing.foot.tolist() == [0, 0, -0.35]
    assert point.sigma == 0.01
    assert point.picked is None


def test_a_mark_is_where_the_foot_of_the_carrier_stood():
    times = np.linspace(0.0, 10.0, 101)
    way = Trajectory(
        times,
        np.column_stack([np.clip(times - 5, 0, None), 0 * times, 1.2 + 0 * times]),
        np.tile([0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)], (101, 1)),
    )

    def stood(first, last):
        foot = Standing(first, last, np.array([0.3, 0.0, -1.2]))
        return with_places([ControlPoint("A", np.zeros(3), 0.3, "control", standing=foot)], way)

    (point,) = stood(1.0, 4.0)
    np.testing.assert_allclose(point.picked, [0.0, 0.3, 0.0], atol=1e-9)
    with pytest.raises(InputError, match=r"moved by 1\.00 m"):
        stood(4.0, 6.0)
    with pytest.raises(InputError, match="the trajectory goes from"):
        stood(9.0, 12.0)
