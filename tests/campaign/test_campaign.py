# SPDX-License-Identifier: MIT OR Apache-2.0
"""A short part of the campaign: one fault of each kind. `make campaign` runs a thousand."""

import pytest

from campaign.campaign import Ground, tried
from campaign.faults import KINDS


@pytest.fixture(scope="module")
def ground(simulated, tmp_path_factory):
    return Ground.of(simulated("office", 22.0), tmp_path_factory.mktemp("ground") / "run")


@pytest.mark.parametrize("number", range(len(KINDS)), ids=[*KINDS])
def test_a_faulty_command_ends_in_a_result_or_a_sentence(number, ground):
    outcome = tried(number, ground)
    assert outcome.kind == [*KINDS][number]
    assert not outcome.findings, outcome.findings
