# SPDX-License-Identifier: MIT OR Apache-2.0
"""Nested values survive being taken apart and written, bit for bit, and nothing else is made of a file."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from bentwing.base.packed import pack, unpack
from bentwing.base.sealed import DAMAGE, read_sealed, write_sealed


@dataclass(frozen=True, slots=True)
class Leaf:
    """With an array and a number that JSON does not know."""

    values: np.ndarray
    distance: float
    span: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Branch:
    """With leaves."""

    leaves: list[Leaf]
    name: Any


def test_nested_values_come_back_bit_for_bit(tmp_path):
    generator = np.random.default_rng(931)
    leaves = [
        Leaf(generator.normal(size=(4, 3)), float("nan"), (0.1, 1e300)),
        Leaf(np.zeros((0, 3), np.int32), float("-inf")),
        Leaf(generator.normal(size=3).astype(np.float32)[::-1], np.float64(1 / 3)),
    ]
    packed, arrays = pack(Branch(leaves, "β"))
    write_sealed(tmp_path / "value.npz", {"value": packed}, arrays)
    read, described = read_sealed(tmp_path / "value.npz")
    again = unpack(described["value"], read, (Branch, Leaf))
    assert again.name == "β"
    for mine, its in zip(leaves, again.leaves, strict=True):
        assert its.values.dtype == mine.values.dtype
        assert its.values.shape == mine.values.shape
        assert its.values.tobytes() == mine.values.tobytes()
        assert repr(its.distance) == repr(mine.distance)
        assert its.span == mine.span


def test_nothing_is_made_but_the_classes_that_are_named():
    packed, arrays = pack(Branch([], None))
    with pytest.raises(LookupError):
        unpack(packed, arrays, (Leaf,))


@pytest.mark.parametrize("spoilt", ["cut", "flipped", "empty"])
def test_a_damaged_file_is_told(tmp_path, spoilt):
    path = tmp_path / "value.npz"
    write_sealed(path, {"value": [1, 2]}, {"0": np.arange(5.0)})
    whole = path.read_bytes()
    flipped = bytearray(whole)
    flipped[len(whole) // 2] ^= 1
    path.write_bytes({"cut": whole[:-10], "flipped": bytes(flipped), "empty": b""}[spoilt])
    with pytest.raises(DAMAGE):
        read_sealed(path)


def test_what_is_written_needs_no_pickle(tmp_path):
    write_sealed(tmp_path / "value.npz", {"value": 1}, {"0": np.arange(3)})
    arrays, described = read_sealed(tmp_path / "value.npz")
    assert json.dumps(described) == '{"value": 1}'
    assert arrays["0"].tolist() == [0, 1, 2]
