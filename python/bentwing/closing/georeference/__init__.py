# SPDX-License-Identifier: MIT OR Apache-2.0
"""The map on the Earth: from GNSS fixes and control points to projected coordinates."""
