# SPDX-License-Identifier: MIT OR Apache-2.0
"""A run in the rerun viewer: map, path, surfels and the windows over time."""

from bentwing.view.show import view_run

__all__ = ["view_run"]
