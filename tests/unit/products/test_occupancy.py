# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest
import yaml
from PIL import Image

from bentwing.base.errors import UsageError
from bentwing.products import CutPlane, occupancy_of, write_occupancy
from bentwing.products.beams import Passages
from support.known_points import rooms, write_run


def seen_from(place, points):
    """Points of the room in which a sensor at a place is."""
    inside = points[:, 0] < 6.06
    return points[inside], np.tile(place, (50, 1))


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """A run in which the sensor stands in the first of two rooms."""
    points, way = seen_from((2.0, 2.0, 1.0), rooms())
    return write_run(tmp_path_factory.mktemp("room") / "run", points, way=way)


def value_at(grid, x, y):
    column, row = np.floor((np.array([x, y]) - grid.origin) / grid.cell).astype(int)
    return int(grid.cells[row, column])


def test_walls_are_occupied_the_room_is_free_and_the_rest_is_unknown(room):
    grid = occupancy_of(room, 1.0, thickness=1.0)
    assert [value_at(grid, x, 2.0) for x in (0.0, 2.0, 4.0, 6.0)] == [100, 0, 0, 100]
    assert value_at(grid, 6.4, 2.0) == -1
    assert value_at(grid, 3.0, -0.3) == -1
    inner = grid.cells[
        round((0.15 - grid.origin[1]) / 0.05) : round((3.85 - grid.origin[1]) / 0.05),
        round((0.15 - grid.origin[0]) / 0.05) : round((5.85 - grid.origin[0]) / 0.05),
    ]
    assert (inner == 0).mean() > 0.98


def test_the_files_are_what_map_server_reads(room, tmp_path):
    grid = write_occupancy(room, tmp_path / "plan.yaml", 1.0, thickness=1.0, cell=0.1)
    described = yaml.safe_load((tmp_path / "plan.yaml").read_text())
    assert described["image"] == "plan.pgm"
    assert described["resolution"] == 0.1
    assert described["origin"] == pytest.approx([*grid.origin, 0.0])
    with Image.open(tmp_path / "plan.pgm") as image:
        grey = np.asarray(image)
    # map_server, trinary: how dark a pixel is decides; the first row of the picture lies on top.
    dark = (255 - grey[::-1]) / 255
    read = np.full(dark.shape, -1)
    read[dark > described["occupied_thresh"]] = 100
    read[dark < described["free_thresh"]] = 0
    assert np.array_equal(read, grid.cells)
    assert set(np.unique(read)) == {-1, 0, 100}


def test_without_trajectory_nothing_is_known_to_be_free(tmp_path):
    grid = occupancy_of(write_run(tmp_path / "run", rooms()), 1.0, thickness=1.0)
    assert set(np.unique(grid.cells)) == {-1, 100}
    assert "none known to be free" in grid.sentence()


def test_a_stray_point_is_no_obstacle_and_a_table_is_one(tmp_path):
    rng = np.random.default_rng(108)
    points, way = seen_from((2.0, 2.0, 1.6), rooms())
    # One point in every other cell of a table, and one in the air.
    table = np.column_stack([rng.uniform(3, 4, 300), rng.uniform(1, 2, 300), np.full(300, 0.75)])
    run = write_run(tmp_path / "run", np.vstack([points, table, [[1.0, 1.0, 1.0]]]), way=way)
    grid = occupancy_of(run, 1.0, thickness=1.0)
    assert value_at(grid, 1.0, 1.0) == 0
    there = grid.cells[
        round((1 - grid.origin[1]) / 0.05) : round((2 - grid.origin[1]) / 0.05),
        round((3 - grid.origin[0]) / 0.05) : round((4 - grid.origin[0]) / 0.05),
    ]
    assert (there == 100).mean() > 0.4


def test_a_beam_frees_the_cells_between_its_ends_within_the_heights():
    passages = Passages(np.zeros(2), (10, 100), 0.1)
    sensors = np.array([[0.05, 0.55, 2.0]])
    passages.add(sensors, np.array([[8.05, 0.55, 0.0]]), (0.5, 1.5))
    row = passages.counts[5]
    # At 2 m it is 1.5 m high, at 6 m 0.5 m.
    assert row[:20].sum() == 0
    assert (row[21:60] > 0).all()
    assert row[61:].sum() == 0
    assert passages.counts.sum() == row.sum()


def test_beams_of_unknown_origin_free_nothing():
    passages = Passages(np.zeros(2), (10, 10), 0.1)
    passages.add(np.full((2, 3), np.nan), np.ones((2, 3)), (0.0, 2.0))
    assert passages.counts.sum() == 0


def test_a_grid_needs_a_level_cut(room):
    with pytest.raises(UsageError, match="level cut"):
        occupancy_of(room, CutPlane.upright((0.0, 2.0), (6.0, 2.0)))


@pytest.mark.parametrize("cell", [0.0, np.nan, 1e-5])
def test_a_cell_that_cannot_be_used_is_refused(room, cell):
    with pytest.raises(UsageError, match="--cell"):
        occupancy_of(room, cell=cell)
