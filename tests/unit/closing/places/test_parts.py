# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bentwing.base import geometry
from bentwing.base.transform import apply, turned_and_shifted, upright
from bentwing.closing.places import cut_places, learn_metric, link_between
from bentwing.closing.places.cloud import surfels_of, voxel_means
from bentwing.closing.places.free_space import seen_through
from bentwing.closing.places.gestalt import describe, opposite
from bentwing.closing.places.keypoints import Keypoints, draw_keypoints
from bentwing.closing.places.refine import FINE, Alignment, refine

from .conftest import seen


def test_descriptors_do_not_depend_on_heading_or_position_of_the_map():
    cloud = voxel_means(seen(3, 0)[0], 0.3)
    keypoints = draw_keypoints(cloud, 50)
    T = upright(0.7, np.array([100.0, -50.0, 3.0]))
    turned = Keypoints(apply(T, keypoints.points), keypoints.headings + 0.7, keypoints.shapes)
    ours, theirs = describe(cloud, keypoints), describe(apply(T, cloud), turned)
    # rounding moves a few points across the border of a bin
    assert np.median(np.abs(ours - theirs)) < 1e-9
    assert np.mean(np.abs(ours - theirs) > 1e-6) < 0.02


def test_the_opposite_descriptor_is_that_of_the_frame_turned_round():
    cloud = voxel_means(seen(3, 0)[0], 0.3)
    keypoints = draw_keypoints(cloud, 20)
    back = Keypoints(keypoints.points, keypoints.headings + np.pi, keypoints.shapes)
    descriptors = describe(cloud, keypoints)
    assert np.mean(np.abs(opposite(descriptors) - describe(cloud, back)) > 1e-6) < 0.02
    np.testing.assert_array_equal(opposite(opposite(descriptors)), descriptors)


def test_no_keypoint_lies_in_a_plane_or_has_a_vertical_normal():
    keypoints = draw_keypoints(voxel_means(seen(3, 0)[0], 0.3), 400)
    assert len(keypoints) == 400
    assert keypoints.shapes[:, 0].max() <= 0.9
    assert keypoints.shapes[:, 1].min() >= np.sin(np.radians(10.0))


def test_surfels_have_the_moments_of_their_points():
    rng = np.random.default_rng(0)
    points = rng.uniform(0.0, 0.5, (300, 3)) * [1.0, 1.0, 0.01] + [-3.0, 7.0, 2.1]
    surfels = surfels_of(points, 0.5)
    np.testing.assert_allclose(surfels.means, [points.mean(axis=0)], atol=1e-12)
    np.testing.assert_allclose(surfels.covariances[0], np.cov(points.T, bias=True), atol=1e-12)
    assert abs(surfels.normals[0, 2]) > 0.999


def test_free_space_is_along_the_beams_and_not_at_their_ends():
    points = np.column_stack([np.full(200, 8.0), np.linspace(-3, 3, 200), np.zeros(200)])
    free = seen_through(points, np.zeros((200, 3)))
    assert free.contains(np.array([[4.0, 0.0, 0.0], [2.0, 0.3, 0.0]])).all()
    assert not free.contains(np.array([[8.0, 0.0, 0.0], [7.8, 1.0, 0.0], [4.0, 6.0, 0.0]])).any()


def test_free_space_is_what_was_passed_and_is_not_beside_a_point():
    rng = np.random.default_rng(5)
    origins = rng.uniform(-1.0, 1.0, (400, 3))
    points = origins + rng.normal(0.0, 3.0, (400, 3))
    free = seen_through(points, origins, voxel=0.5)
    # slowly: where the beams were at every voxel's length, without the neighbours of all points
    steps = [
        o + k * 0.5 * (p - o) / np.linalg.norm(p - o)
        for o, p in zip(origins, points, strict=True)
        for k in range(int(np.linalg.norm(p - o) / 0.5))
    ]
    passed = {tuple(c) for c in np.floor(np.array(steps) / 0.5).astype(int).tolist()}
    filled = np.floor(points / 0.5).astype(int)
    expected = {c for c in passed if (np.abs(filled - c).max(axis=1) > 1).all()}
    cells = np.stack(np.meshgrid(*[np.arange(-30, 31)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    found = cells[free.contains((cells + 0.5) * 0.5)]
    assert len(expected) > 500
    assert {tuple(c) for c in found.tolist()} == expected


def test_no_beam_longer_than_a_voxel_leaves_no_free_space():
    points = np.random.default_rng(6).normal(size=(50, 3))
    assert not seen_through(points, points + 0.01).contains(points + 1.0).any()


def test_a_run_is_cut_by_time_and_at_pauses():
    times = np.concatenate([np.linspace(0.0, 21.0, 6000), np.linspace(40.0, 49.0, 3000)])
    parts = cut_places(np.zeros((9000, 3)), times)
    spans = [part.span for part in parts]
    assert [round(first, 1) for first, _ in spans] == [0.0, 10.5, 40.0]
    assert sum(len(part.points) for part in parts) == 9000


def test_a_large_cloud_without_times_is_cut_into_tiles_and_a_small_one_is_not():
    rng = np.random.default_rng(1)
    assert len(cut_places(rng.uniform(0, 20, (5000, 3)))) == 1
    tiles = cut_places(rng.uniform((0, 0, 0), (150, 20, 5), (50_000, 3)))
    assert len(tiles) > 3
    assert max(np.ptp(tile.points[:, 0]) for tile in tiles) <= 30.0


@pytest.mark.parametrize(
    ("points", "times", "words"),
    [
        (np.zeros((3, 2)), None, r"\(N, 3\)"),
        (np.zeros((3, 3)), np.zeros(2), r"\(3,\)"),
        (np.array([[0.0, 0, 0], [np.nan, 0, 0]]), None, "row 1"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(points, times, words):
    with pytest.raises(ValueError, match=words):
        cut_places(points, times)


def test_the_metric_shrinks_what_varies_between_views_and_keeps_what_tells_places_apart():
    rng = np.random.default_rng(2)
    noisy = np.array([3.0, 3.0, 1.0, 1.0])
    matching = rng.normal(size=(4000, 4)) * noisy
    metric = learn_metric(matching, matching + rng.normal(size=(4000, 4)), dimensions=2)
    assert np.abs(metric.matrix[:, :2]).max() < 0.1
    assert np.linalg.norm(metric.matrix[:, 2:], axis=1).min() > 0.9
    spread = np.cov(metric.apply(matching).T)
    np.testing.assert_allclose(spread, np.eye(2), atol=0.1)


def test_too_few_pairs_teach_nothing():
    with pytest.raises(ValueError, match="3 matching"):
        learn_metric(np.zeros((3, 9)), np.zeros((30, 9)), dimensions=2)


@settings(deadline=None, max_examples=10)
@given(st.floats(-0.04, 0.04), st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-0.1, 0.1))
def test_alignment_brings_a_moved_place_back(places_a, yaw, x, y, z):
    from scipy.spatial import cKDTree

    surfels = places_a[0].surfels
    guess = upright(yaw, np.array([x, y, z]))
    found = refine(surfels, cKDTree(surfels.means), surfels, guess, FINE)
    assert found is not None
    np.testing.assert_allclose(found.T_a_b, np.eye(4), atol=5e-3)


def test_a_links_information_is_that_of_the_alignment_in_the_nodes_frame():
    rng = np.random.default_rng(3)
    A = rng.normal(size=(6, 6))
    T = turned_and_shifted(upright(1.0, np.array([3.0, 4, 5])), np.full(6, 0.3), np.zeros(3))
    alignment = Alignment(T, A @ A.T, np.array([10.0, -4.0, 2.0]), 100)
    T_a, T_b = upright(0.4, np.array([1.0, 2, 3])), upright(-2.0, np.array([7.0, 8, 1]))
    link = link_between(T_a, T_b, alignment)
    step = 1e-6 * rng.normal(size=6)
    # the same small change, made to the alignment and to the link
    changed = link_between(
        T_a,
        T_b,
        Alignment(turned_and_shifted(T, step, alignment.about), A @ A.T, alignment.about, 1),
    )
    R = geometry.to_matrices(link.quat_xyzw)
    turn = geometry.log(geometry.multiply(geometry.inverse(link.quat_xyzw), changed.quat_xyzw))
    xi = np.concatenate([turn, R.T @ (changed.position - link.position)])
    expected = step @ (A @ A.T) @ step
    assert xi @ link.information @ xi == pytest.approx(0.05 * expected, rel=1e-3)
