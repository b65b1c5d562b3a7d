# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bentwing.base.errors import UsageError
from bentwing.base.geodesy import LevelFrame, ProjectedSystem

PLACE = LevelFrame(11.5, 47.2, 600.0)


@given(
    st.floats(-179, 179),
    st.floats(-85, 85),
    st.lists(st.tuples(*[st.floats(-2000, 2000)] * 3), min_size=1, max_size=5),
)
def test_a_level_frame_is_left_and_entered_without_loss(longitude, latitude, points):
    frame = LevelFrame(longitude, latitude, 100.0)
    points = np.array(points)
    assert np.allclose(frame.from_geodetic(frame.to_geodetic(points)), points, rtol=0, atol=2e-7)


def test_north_is_towards_larger_latitudes_and_up_away_from_the_ground():
    east, north, up = PLACE.to_geodetic(100.0 * np.eye(3))
    assert east[0] > 11.5
    assert abs(east[1] - 47.2) < 1e-7
    assert north[1] > 47.2
    assert abs(north[0] - 11.5) < 1e-9
    assert np.allclose(up, [11.5, 47.2, 700.0])
    # the radius of the meridian at 47.2° is 6,369.8 km
    assert np.isclose(np.radians(north[1] - 47.2) * 6_369_800, 100.0, rtol=2e-3)


def test_a_place_gets_its_utm_zone_with_convergence_and_scale():
    system = ProjectedSystem.utm(11.5, 47.2)
    assert system.epsg == 32632
    assert 'AUTHORITY["EPSG","32632"]' in system.wkt
    convergence, scale = system.factors(11.5, 47.2)
    # 2.5° east of the central meridian grid north lies clockwise of true north
    assert np.isclose(convergence, 2.5 * np.sin(np.radians(47.2)), atol=0.01)
    # 189 km from it the zone's 0.9996 has grown by half the square of that over the radius
    assert np.isclose(scale, 0.9996 * (1 + 0.5 * (189.4 / 6380) ** 2), atol=2e-6)
    assert ProjectedSystem.utm(-70.0, -33.0).epsg == 32719


def test_easting_and_northing_come_first_and_height_stays():
    point = ProjectedSystem.of_epsg(32632).from_geodetic(np.array([[9.0, 0.0, 55.0]]))
    assert np.allclose(point, [[500_000.0, 0.0, 55.0]], atol=1e-6)


@pytest.mark.parametrize(
    ("epsg", "what"), [(999_999, "not known"), (4326, "not projected"), (2225, "in metres")]
)
def test_what_is_no_projected_system_in_metres_is_refused(epsg, what):
    with pytest.raises(UsageError, match=what):
        ProjectedSystem.of_epsg(epsg)


def test_heights_above_the_sea_without_a_geoid_are_refused_before_any_work():
    """PROJ knows no geoid of DHHN92, and would keep the heights as they are."""
    with pytest.raises(UsageError, match="grid files"):
        ProjectedSystem.of_epsg(5555)


def test_a_system_says_what_its_heights_are_above():
    assert ProjectedSystem.of_epsg(25832).heights == "above the ellipsoid (GRS 1980)"


@pytest.mark.parametrize("epsg", [2193, 28992, 31467, 2154, 6677, 7855, 26910])
def test_systems_of_other_datums_and_across_the_180th_meridian_are_taken(epsg):
    assert ProjectedSystem.of_epsg(epsg).epsg == epsg
