# SPDX-License-Identifier: MIT OR Apache-2.0
import subprocess
import sys

import pytest

import bentwing


@pytest.mark.parametrize("name", bentwing.__all__)
def test_every_public_name_can_be_had(name):
    assert getattr(bentwing, name) is not None


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        bentwing.nothing  # noqa: B018


def test_importing_the_package_loads_nothing_of_it():
    code = "import sys, bentwing; print([m for m in sys.modules if m.startswith(('bentwing.', 'numpy'))])"
    answer = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True
    )
    assert answer.stdout == "[]\n"
