// SPDX-License-Identifier: MIT OR Apache-2.0
//! Benches of the crates' hot loops, run by `make bench`; this library is empty.
#![forbid(unsafe_code)]
