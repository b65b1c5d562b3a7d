# SPDX-License-Identifier: MIT OR Apache-2.0
"""Numbers of merit: a trajectory or a map against truth, and a map against itself."""
