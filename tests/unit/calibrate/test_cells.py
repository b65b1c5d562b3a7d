# SPDX-License-Identifier: MIT OR Apache-2.0
"""Pairs of planes in a grid."""

from __future__ import annotations

import numpy as np

from bentwing.calibrate.cells import find_pairs, plane_probability


def wall(rng, n, sigma, at=2.2):
    """Points of a wall across x, for one half-scan."""
    yz = rng.uniform([0.1, 0.1], [1.9, 1.9], (n, 2))
    return np.column_stack([at + rng.normal(0.0, 1.0, n) * sigma, yz])


def test_a_wall_that_both_halves_see_makes_pairs():
    rng = np.random.default_rng(0)
    points = np.vstack([wall(rng, 2000, 0.02), wall(rng, 2000, 0.02, at=2.22)])
    halves = np.repeat([0, 1], 2000)
    pairs = find_pairs(points, halves, 0.02)
    assert len(pairs) >= 12
    assert (np.abs(pairs.normals[:, 0]) > 0.99).all()
    assert (pairs.probability > 0.9).all()
    assert len(np.unique(pairs.index)) == len(pairs.index)


def test_a_wall_that_one_half_sees_makes_none():
    points = wall(np.random.default_rng(0), 4000, 0.02)
    assert len(find_pairs(points, np.zeros(4000, dtype=np.int64), 0.02)) == 0


def test_leaves_of_a_tree_make_none():
    points = np.random.default_rng(0).uniform(0.0, 2.0, (6000, 3))
    assert len(find_pairs(points, np.arange(6000) % 2, 0.02)) == 0


def test_the_probability_falls_with_the_thickness():
    thickness = np.array([0.01, 0.02, 0.05, 0.1, 0.2])
    n = np.full(5, 50.0)
    found = plane_probability(thickness**2, n, 0.5, 0.02)
    assert (np.diff(found) < 0).all()
    assert found[1] > 0.99
    assert found[3] < 0.01
