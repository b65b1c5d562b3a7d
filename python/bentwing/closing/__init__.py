# SPDX-License-Identifier: MIT OR Apache-2.0
"""What corrects a whole trajectory: places, pose graphs, global registration, maps and GNSS."""
