# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where paths lead to, and what is no file."""

from __future__ import annotations

import os

import pytest

from bentwing.base.errors import InputError
from bentwing.base.regular_file import require_regular, resolved


def test_links_in_a_circle_lead_somewhere(tmp_path):
    loop = tmp_path / "loop.bag"
    loop.symlink_to("loop.bag")
    assert resolved(loop).name == "loop.bag"


def test_a_link_leads_to_its_file(tmp_path):
    (tmp_path / "there").write_text("")
    (tmp_path / "here").symlink_to("there")
    assert resolved(tmp_path / "here") == resolved(tmp_path / "there")


def test_a_pipe_is_no_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="is not a file"):
        require_regular(tmp_path / "pipe")
