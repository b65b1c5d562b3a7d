# SPDX-License-Identifier: MIT OR Apache-2.0
"""Clocks of periodic sensors: what the stamps of a stream say together, and no stamp alone."""
