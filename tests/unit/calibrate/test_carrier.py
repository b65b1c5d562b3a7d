# SPDX-License-Identifier: MIT OR Apache-2.0
"""A lidar that flies through a hall, with a bar of its carrier in view or without."""

from __future__ import annotations

import re

import numpy as np
import pytest
import yaml

from bentwing.base import geometry
from bentwing.base.mount import MotorMount, Pose
from bentwing.base.voxels import voxel_keys
from bentwing.calibrate.carrier import CarrierWatch, carrier_warnings
from bentwing.calibrate.carrier.view import EDGE, View
from bentwing.recording import LidarBatch, Payload
from bentwing.recording.preprocess.self_hits import outside_boxes

HALL = np.array([[-6.0, -4.0, 0.0], [30.0, 4.0, 5.0]])  # m, lowest and highest corner
BAR = (
    np.array([0.4, 0.2]),
    0.04,
)  # m, where a vertical bar is in the carrier's frame, and its radius
BAR_TOP, BAR_BOTTOM = 0.3, -0.3
SWEEP, RAYS = 0.1, 1200


def hall_ranges(origin, rays):
    """Ranges (N,) from inside the hall along unit vectors (N, 3)."""
    with np.errstate(divide="ignore"):
        walls = np.where(rays > 0, HALL[1] - origin, HALL[0] - origin) / rays
    return walls.min(axis=1)


def bar_ranges(rays):
    """Ranges (N,) to the bar along unit vectors from the carrier's origin; infinite beside it."""
    (x, y), radius = BAR
    flat = np.linalg.norm(rays[:, :2], axis=1)
    along = (rays[:, 0] * x + rays[:, 1] * y) / flat
    beside = np.abs(rays[:, 0] * y - rays[:, 1] * x) / flat
    depth = along - np.sqrt(np.maximum(radius**2 - beside**2, 0.0))
    ranges = depth / flat
    heights = ranges * rays[:, 2]
    hits = (beside < radius) & (along > 0) & (heights > BAR_BOTTOM) & (heights < BAR_TOP)
    return np.where(hits, ranges, np.inf)


def flight(
    *, bar=True, height=lambda t: 1.5 + 0.8 * np.sin(0.4 * t), speed=1.0, rate=None, down=0.6
):
    """Batches of 20 s, and which of their points are of the bar.

    height : of the lidar over the floor, m
    speed : along the hall and sideways, m/s
    rate : rad/s, of a motor that turns the lidar about the carrier's vertical
    down : most negative z of the rays
    """
    rng = np.random.default_rng(3)
    batches, own = [], []
    for t in np.arange(0.0, 20.0, SWEEP):
        rays = rng.normal(size=(RAYS, 3))
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        rays = rays[rays[:, 2] > -down]
        yaw = np.array([0.0, 0.0, 0.3 * np.sin(0.5 * t) if speed else 0.0])
        origin = np.array([speed * t, 2.0 * np.sin(0.3 * t) * bool(speed), height(t)])
        of_hall = hall_ranges(origin, geometry.rotate(geometry.exp(yaw), rays))
        of_bar = bar_ranges(rays) if bar else np.full(len(rays), np.inf)
        ranges = np.minimum(of_hall, of_bar) + rng.normal(0.0, 0.01, len(rays))
        points, times = rays * ranges[:, None], t + np.linspace(0.0, 0.9 * SWEEP, len(rays))
        angles = None
        if rate is not None:
            angles = rate * times
            points = geometry.rotate(geometry.exp(-angles[:, None] * [0.0, 0.0, 1.0]), points)
        batches.append(LidarBatch(points, times, angles=angles))
        own.append(of_bar < of_hall)
    return batches, np.concatenate(own)


def found(batches, payload=None):
    watch = CarrierWatch(payload or Payload())
    for batch in batches:
        watch.add(batch)
    return watch.boxes()


def shares(boxes, batches, own):
    """Share of the bar's points, and of the others, that the boxes hold."""
    inside = ~outside_boxes(np.concatenate([batch.points for batch in batches]), boxes)
    return inside[own].mean(), inside[~own].mean()


def test_a_bar_that_flies_along_is_boxed_and_little_else():
    batches, own = flight()
    boxes = found(batches)
    assert len(boxes) == 1
    of_bar, of_hall = shares(boxes, batches, own)
    assert of_bar > 0.98
    assert of_hall < 1e-3


def test_a_bar_is_boxed_at_every_angle_of_a_lidar_on_a_motor():
    batches, own = flight(rate=1.0)
    boxes = found(batches, Payload.model_validate({"encoder": {}}))
    of_bar, of_hall = shares(boxes, batches, own)
    assert of_bar > 0.98
    assert of_hall < 1e-2
    reach = np.hypot(*BAR[0])
    (box,) = [one.box for one in boxes]
    assert max(box.min[:2]) < -reach + 0.05
    assert min(box.max[:2]) > reach - 0.05


def test_without_a_carrier_in_view_there_is_no_box():
    assert found(flight(bar=False)[0]) == ()


@pytest.mark.parametrize("height", [0.5, 0.8, 1.2])
def test_a_floor_at_a_constant_distance_is_no_carrier(height):
    batches, _ = flight(bar=False, height=lambda _: height, down=1.0)
    assert found(batches) == ()


def test_at_rest_nothing_is_told_apart():
    # A post beside a lidar that stands may be anything.
    assert found(flight(speed=0.0, height=lambda _: 1.5)[0]) == ()


def test_a_few_seconds_are_too_short_to_tell():
    assert found(flight()[0][:60]) == ()


def test_a_carrier_that_the_payload_masks_is_not_found_again():
    batches, _ = flight()
    boxes = found(batches)
    rest = [b.where(outside_boxes(b.points, boxes)) for b in batches]
    assert found(rest) == ()


def test_the_sentence_can_be_pasted_into_the_payload():
    boxes = found(flight()[0])
    (sentence,) = carrier_warnings(Payload(), boxes)
    (line,) = re.findall(r"'(self_hits: .*)'", sentence)
    assert Payload.model_validate(yaml.safe_load(line)).self_hits == boxes


def test_nothing_is_said_where_the_payload_has_boxes_or_nothing_is_seen():
    boxes = found(flight()[0])
    assert carrier_warnings(Payload(self_hits=boxes), boxes) == []
    assert carrier_warnings(Payload(), ()) == []


def test_a_lidar_on_a_motor_is_turned_back_to_axes_that_stand_on_the_carrier():
    rng = np.random.default_rng(5)
    axis = np.array([0.48, -0.6, 0.64])
    lidar = Pose(np.zeros(3), geometry.exp(np.array([0.3, -0.2, 1.0])))
    mount = MotorMount(Pose.identity(), axis, 0.3, lidar)
    points, angles = rng.uniform(-1.0, 1.0, (40, 3)), rng.uniform(-9.0, 9.0, 40)
    view = View.of([LidarBatch(points, np.linspace(0.0, 1.0, 40), angles=angles)], mount)
    standing = [
        mount.lidar_at(angle).R @ point for angle, point in zip(angles, points, strict=True)
    ]
    np.testing.assert_array_equal(view.cells, voxel_keys(np.array(standing), EDGE))
