# SPDX-License-Identifier: MIT OR Apache-2.0
"""The log: standard `logging` under the name `bentwing`, silent until somebody sets up its output."""

from __future__ import annotations

import logging

# Not in `bentwing` itself: importing it would take ten times as long.
logging.getLogger("bentwing").addHandler(logging.NullHandler())


def get_logger(module: str) -> logging.Logger:
    """Return the logger of a module by its `__name__`."""
    return logging.getLogger(module)
