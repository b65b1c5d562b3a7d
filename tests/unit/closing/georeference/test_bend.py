# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np

from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory
from bentwing.closing.georeference.bend import bend, of_fixes, of_surfaces
from bentwing.closing.georeference.placement import Positions, Surfaces

DURATION = 300.0


def truth():
    """Walk along a long loop, turning."""
    times = np.arange(0, DURATION, 0.02)
    a = 2 * np.pi * times / 150
    positions = np.stack([60 * np.sin(a), 40 * np.sin(2 * a), 2 * np.sin(3 * a)], axis=1)
    return Trajectory(times, positions, geometry.exp(np.c_[0 * a, 0 * a, 5 * a]))


def drifted(true, turn=0.02, stretch=0.002):
    """The same with a heading that drifts and steps a little too long."""
    steps = np.diff(true.positions, axis=0) * (1 + stretch)
    headings = turn * true.times / DURATION
    turns = geometry.exp(np.c_[np.zeros((len(true.times), 2)), headings])
    walked = np.cumsum(geometry.rotate(turns[1:], steps), axis=0)
    start = true.positions[:1]
    return Trajectory(
        true.times,
        np.r_[start, start + walked],
        geometry.multiply(turns, true.quats_xyzw),
    )


def fixes(true, at, sigma, outliers, seed=0):
    rng = np.random.default_rng(seed)
    measured = true.interpolate(at)[0] + sigma * rng.normal(size=(len(at), 3))
    false = rng.random(len(at)) < outliers
    measured[false] += rng.choice([-1, 1], (false.sum(), 3)) * rng.uniform(2, 20, (false.sum(), 1))
    return measured


def error(found, true):
    return np.linalg.norm(found.positions - true.positions, axis=1)


def test_a_drifted_trajectory_gives_way_to_fixes_and_not_to_false_ones():
    true = truth()
    start = drifted(true)
    at = np.arange(0.5, DURATION - 1, 0.5)
    p, _ = start.interpolate(at)
    measured = fixes(true, at, 0.02, outliers=0.05)
    covariances = np.tile(0.02**2 * np.eye(3), (len(at), 1, 1))
    seen = of_fixes(at, np.zeros_like(p), Positions(p, measured, covariances, share=0.1))
    found = bend(start, [seen])
    assert error(start, true).max() > 0.8
    assert error(found, true).max() < 0.12
    assert np.sqrt(np.mean(error(found, true) ** 2)) < 0.035
    # the heading follows from the way
    off = geometry.log(geometry.multiply(found.quats_xyzw, geometry.inverse(true.quats_xyzw)))
    assert np.abs(off[:, 2]).max() < 0.4 * 0.02
    assert np.abs(off[:, :2]).max() < 1e-9


def test_loose_fixes_leave_a_good_trajectory_alone():
    true = truth()
    at = np.arange(0.5, DURATION - 1, 0.5)
    p, _ = true.interpolate(at)
    measured = fixes(true, at, 2.0, outliers=0.0)
    covariances = np.tile(4.0 * np.eye(3), (len(at), 1, 1))
    seen = of_fixes(at, np.zeros_like(p), Positions(p, measured, covariances, share=0.025))
    found = bend(true, [seen])
    # as a rigid fit would it moves as a whole, but keeps its shape
    moved = found.positions - true.positions
    assert np.abs(moved - moved.mean(axis=0)).max() < 0.35


def test_control_points_pull_along_their_normals_only():
    true = truth()
    levers = np.array([[0.0, 0, -2.0], [3.0, 0, 0]])
    at = np.array([100.0, 200.0])
    middle = true.interpolate(at)[0] + levers
    normals = np.array([[0.0, 0, 1], [1.0, 0, 0]])
    targets = middle + np.array([[0.5, 0.5, 0.02], [0.03, 0.5, 0.5]])
    surfaces = Surfaces(middle, normals, targets, np.full(2, 0.001))
    found = bend(true, [of_surfaces(at, levers, surfaces, targets)])
    p, q = found.interpolate(at)
    turn = geometry.multiply(q, geometry.inverse(true.interpolate(at)[1]))
    now = p + geometry.rotate(turn, levers)
    assert np.allclose((now - middle)[[0, 1], [2, 0]], [0.02, 0.03], atol=0.001)
    assert np.abs((now - middle)[0, :2]).max() < 0.1


def test_a_break_in_the_trajectory_is_where_it_gives_way_most():
    true = truth()
    shift = np.where(true.times > 150, 5.0, 0.0)[:, None] * [1.0, 0, 0]
    start = Trajectory(true.times, true.positions + shift, true.quats_xyzw)
    at = np.arange(0.5, DURATION - 1, 0.5)
    at = at[np.abs(at - 150) > 1.5]
    p, _ = start.interpolate(at)
    covariances = np.tile(0.05**2 * np.eye(3), (len(at), 1, 1))
    positions = Positions(p, fixes(true, at, 0.05, 0.0), covariances, share=0.1)
    spans = [(0.0, 149.5), (150.5, DURATION)]
    found = bend(start, [of_fixes(at, np.zeros_like(p), positions)], spans)
    away = np.abs(true.times - 150) > 2
    assert error(found, true)[away].max() < 0.15
