# SPDX-License-Identifier: MIT OR Apache-2.0
"""The set-up of a sensor head, found from a recording: mount, axes, units, clocks and motor."""

from bentwing.calibrate.set_up.find import find_set_up
from bentwing.calibrate.set_up.set_up import Finding, SetUp

__all__ = ["Finding", "SetUp", "find_set_up"]
