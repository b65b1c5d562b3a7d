# SPDX-License-Identifier: MIT OR Apache-2.0
"""A short part of the campaign: one fault of each kind. `make campaign` runs a thousand."""

import pytest

from campaign.campaign import tried
from campaign.faults import KINDS


@pytest.mark.parametrize("number", range(len(KINDS)), ids=[*KINDS])
def test_a_faulty_command_ends_in_a_result_or_a_sentence(number, ground):
    outcome = tried(number, ground)
    assert outcome.kind == [*KINDS][number]
    assert not outcome.findings, outcome.findings
