# SPDX-License-Identifier: MIT OR Apache-2.0
"""What every package uses: errors, files, time, rotations, trajectories, and the values that are passed on."""
