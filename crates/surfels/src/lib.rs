// SPDX-License-Identifier: MIT OR Apache-2.0
//! surfels
#![forbid(unsafe_code)]
