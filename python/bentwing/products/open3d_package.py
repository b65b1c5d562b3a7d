# SPDX-License-Identifier: MIT OR Apache-2.0
"""Open3D, which is a gigabyte and therefore optional."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from bentwing.base.errors import UsageError


def require_open3d() -> Any:  # noqa: ANN401 - imported when needed
    """Import Open3D.

    Raises
    ------
    UsageError
        If it is not installed, or a library of the system that it needs is not.
    """
    try:
        return import_module("open3d")
    except ModuleNotFoundError:
        msg = (
            "meshes and clouds of Open3D need the package open3d, which is not installed; run "
            "`pip install bentwing[open3d]` with Python 3.10 to 3.12"
        )
    except ImportError as error:  # of a shared library, which the wheel does not bring
        msg = (
            f"the package open3d is installed but cannot be loaded ({error}); install the library "
            "that it names, on Debian and Ubuntu `apt install libgl1 libgomp1 libusb-1.0-0`"
        )
    raise UsageError(msg) from None
