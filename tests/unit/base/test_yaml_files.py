# SPDX-License-Identifier: MIT OR Apache-2.0
"""YAML that a user may have mistyped."""

from __future__ import annotations

import pytest
import yaml

from bentwing.base.yaml_files import parse_yaml


@pytest.mark.parametrize("value", ["2024-13-45", "!!int x", "!!float x", "!!timestamp x"])
def test_a_value_that_is_not_what_its_form_says_is_refused_with_its_place(value):
    with pytest.raises(yaml.YAMLError, match=r"is no (int|float|timestamp)(.|\n)*line 2"):
        parse_yaml(f"a: 1\nb: {value}\n")
