# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.base.geodesy import ProjectedSystem
from bentwing.closing.localize import read_prior_map
from bentwing.closing.localize.coordinates import coordinates_of_cloud, coordinates_of_run
from bentwing.map.chunk import untimed
from bentwing.map.writer import open_map
from bentwing.odometry.continuous.settings import SurfelSettings

UTM = ProjectedSystem.of_epsg(32632)
PLACE = np.array([512_345.0, 5_412_987.0, 431.0])


def wall(n=20_000):
    rng = np.random.default_rng(1)
    return np.column_stack([np.zeros(n), rng.uniform(-2, 2, n), rng.uniform(0, 2, n)])


@pytest.fixture
def survey(tmp_path):
    path = tmp_path / "survey.laz"
    with open_map(path, "laz", 0, UTM.wkt) as writer:
        writer.write(untimed(wall() + PLACE))
    return path


def test_a_survey_keeps_its_coordinates_and_is_compared_near_the_origin(survey):
    prior = read_prior_map(survey, SurfelSettings())
    finest = prior.surfels[0]
    assert np.abs(finest.means).max() < 1000.0
    given = prior.coordinates
    assert given is not None
    assert np.allclose(given.to_projected(finest.means)[:, 0], PLACE[0], atol=1e-3)
    assert given.crs_wkt == UTM.wkt
    assert np.abs(prior.places[0].centre).max() < 1000.0


def test_a_local_cloud_is_left_where_it_is(tmp_path):
    path = tmp_path / "site.ply"
    with open_map(path, "ply", 0) as writer:
        writer.write(untimed(wall() - 200.0))
    assert coordinates_of_cloud(path) is None


def test_a_georeferenced_run_is_compared_in_the_frame_of_its_trajectory():
    turn = np.array([[0.0, -0.9996, 0.0], [0.9996, 0.0, 0.0], [0.0, 0.0, 1.0]])
    linear = {"map": [1.0, 2.0, 3.0], "projected": PLACE.tolist(), "matrix": turn.tolist()}
    given = coordinates_of_run({"epsg": 32632, "linear": linear})
    assert given is not None
    assert np.allclose(given.to_projected(np.array([[1.0, 3.0, 3.0]])), PLACE - [0.9996, 0, 0])
    assert given.crs_wkt == UTM.wkt
    assert coordinates_of_run(None) is None
