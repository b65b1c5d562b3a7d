# SPDX-License-Identifier: MIT OR Apache-2.0
"""The map: points of a recording brought into one frame, thinned and written to a file."""
