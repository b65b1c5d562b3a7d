# SPDX-License-Identifier: MIT OR Apache-2.0
"""Simulated lidars: where each beam looks, when, and how ranges are reported."""
