# SPDX-License-Identifier: MIT OR Apache-2.0
"""A finished run through two rooms."""

from __future__ import annotations

import numpy as np
import pytest

from support.known_points import rooms, write_run


@pytest.fixture(scope="module")
def office(tmp_path_factory):
    """A run through two rooms, whose floor is at zero."""
    way = np.column_stack([np.linspace(1, 9, 50), np.full(50, 2.0), np.full(50, 1.2)])
    return write_run(tmp_path_factory.mktemp("office") / "run", rooms(), way=way)
