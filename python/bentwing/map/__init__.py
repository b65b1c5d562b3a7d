# SPDX-License-Identifier: MIT OR Apache-2.0
"""Trajectory and batches in, the point cloud of the map out."""
