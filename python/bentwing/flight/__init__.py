# SPDX-License-Identifier: MIT OR Apache-2.0
"""In flight: live odometry, control of carrier and head, planning."""
