# SPDX-License-Identifier: MIT OR Apache-2.0
"""Sensor heads: how IMU and lidar hang on their carrier, nominally and in truth."""
