# SPDX-License-Identifier: MIT OR Apache-2.0
"""Accurate trajectories and 3D maps from lidars that move on their carrier, without GNSS."""
