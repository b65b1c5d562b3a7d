# SPDX-License-Identifier: MIT OR Apache-2.0
"""What faults are made of."""

import pytest

from campaign.campaign import Ground


@pytest.fixture(scope="session")
def ground(simulated, tmp_path_factory):
    """A recording, and a run of it."""
    return Ground.of(simulated("office", 22.0), tmp_path_factory.mktemp("ground") / "run")
