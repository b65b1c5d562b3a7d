# SPDX-License-Identifier: MIT OR Apache-2.0
"""GNSS fixes that other programs have written: receivers in NMEA 0183, post-processing by RTKLIB."""
