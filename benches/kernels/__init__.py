# SPDX-License-Identifier: MIT OR Apache-2.0
"""Single kernels, beside those of other packages."""
