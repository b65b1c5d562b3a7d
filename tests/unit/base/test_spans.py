# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

from bentwing.base.spans import name_spans, spans_of


def test_neighbouring_steps_are_one_span_that_begins_where_the_step_before_ends():
    flags = [(0.5, True), (1.0, True), (1.5, False), (2.0, True)]
    assert spans_of(flags) == [(0.0, 1.0), (1.5, 2.0)]


def test_steps_without_a_flag_are_no_span():
    assert spans_of([(0.5, False), (1.0, False)]) == []


def test_a_sentence_names_up_to_three_spans():
    assert name_spans([(31.0, 33.5)]) == "from 31.0 to 33.5 s"
    assert name_spans([(1.0, 2.0), (5.0, 6.0)]) == "from 1.0 to 2.0 s and from 5.0 to 6.0 s"


def test_of_many_spans_the_longest_are_named_in_order_of_time():
    spans = [(0.0, 0.1), (1.0, 4.0), (5.0, 5.1), (7.0, 9.0), (10.0, 15.0)]
    assert name_spans(spans) == (
        "from 1.0 to 4.0 s, from 7.0 to 9.0 s, from 10.0 to 15.0 s and 2 shorter times"
    )
