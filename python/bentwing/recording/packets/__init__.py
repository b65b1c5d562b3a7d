# SPDX-License-Identifier: MIT OR Apache-2.0
"""Raw packets of lidars, decoded by the makers' libraries or by tables of the models."""
