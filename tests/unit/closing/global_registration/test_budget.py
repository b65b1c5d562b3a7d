# SPDX-License-Identifier: MIT OR Apache-2.0
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bentwing.closing.global_registration import Budget, GlobalSettings


@given(seconds=st.floats(10.0, 20_000.0), memory=st.floats(300.0, 8000.0))
def test_what_is_planned_fits_or_is_thinned_to_the_least_that_carries(seconds, memory):
    settings = GlobalSettings(memory_mb=memory)
    budget = Budget.of(seconds, settings)
    least = 0.05 * settings.surfels.max_rate * seconds
    assert budget.megabytes <= memory * (1 + 1e-9) or budget.n_surfels == pytest.approx(
        least, abs=2
    )
    assert budget.is_thinned == (budget.rate < settings.surfels.max_rate * (1 - 1e-9))
    assert budget.n_surfels <= settings.surfels.max_rate * seconds + 1


def test_the_equations_stop_growing_where_drift_is_slow_against_the_knots():
    settings = GlobalSettings()
    assert settings.interval_for(60.0) == settings.knot_interval
    long = Budget.of(3 * 3600.0, settings)
    assert long.n_unknowns <= 6 * (settings.max_knots + 3)
    assert long.megabytes <= settings.memory_mb * (1 + 1e-9)


def test_the_sentence_says_what_is_thinned():
    roomy, narrow = (Budget.of(600.0, GlobalSettings(memory_mb=m)) for m in (4000.0, 450.0))
    assert "thinned" not in roomy.sentence()
    assert "thinned to" in narrow.sentence()
    assert "600 s" in narrow.sentence()
