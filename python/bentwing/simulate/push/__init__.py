# SPDX-License-Identifier: MIT OR Apache-2.0
"""Runs of a quadrotor whose pilot pushes against structure, with and without the virtual bumper."""
