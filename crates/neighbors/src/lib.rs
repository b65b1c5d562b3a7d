// SPDX-License-Identifier: MIT OR Apache-2.0
//! neighbors
#![forbid(unsafe_code)]
