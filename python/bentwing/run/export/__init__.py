# SPDX-License-Identifier: MIT OR Apache-2.0
"""Finished runs in another form: format, spacing, crop, coordinates, tiles; and their trajectories."""
