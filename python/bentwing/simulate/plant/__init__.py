# SPDX-License-Identifier: MIT OR Apache-2.0
"""The physics of a head that the downdraft of four rotors spins (Kaul 2015, section 3)."""
