// SPDX-License-Identifier: MIT OR Apache-2.0
//! `_core.LazCompressor`: LAZ points without the GIL, which the wheels of `lazrs` hold all the while.

use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom};
use std::path::PathBuf;

use ::laz::{LasZipError, LazItemRecordBuilder, LazVlr, LazVlrBuilder, ParLasZipCompressor};
use numpy::PyReadonlyArray1;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::errors::in_pool;

/// LAZ chunks that are compressed at a time. Only whole ones are compressed beside each other.
const CHUNKS: usize = 4;

/// Appends compressed points to a file whose header is written already.
#[pyclass(module = "bentwing._core")]
pub(crate) struct LazCompressor {
    vlr: LazVlr,
    point_size: usize,
    /// Points that do not fill their chunks yet.
    waiting: Vec<u8>,
    file: Option<ParLasZipCompressor<File>>,
}

#[pymethods]
impl LazCompressor {
    #[new]
    #[pyo3(signature = (point_format, n_extra_bytes, *, own_chunks=false))]
    fn new(point_format: u8, n_extra_bytes: u16, own_chunks: bool) -> PyResult<Self> {
        let items = LazItemRecordBuilder::default_for_point_format_id(point_format, n_extra_bytes);
        let items = items.map_err(|e| PyValueError::new_err(format!("point_format: {e}")))?;
        let builder = LazVlrBuilder::new(items);
        let vlr = if own_chunks {
            builder.with_variable_chunk_size().build()
        } else {
            builder.build()
        };
        let point_size = vlr.items_size() as usize;
        Ok(Self {
            vlr,
            point_size,
            waiting: Vec::new(),
            file: None,
        })
    }

    /// The record that the header of the file must announce.
    fn record_data<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let mut data = Vec::new();
        self.vlr.write_to(&mut data)?;
        Ok(PyBytes::new(py, &data))
    }

    /// Begins behind the first `offset` bytes of the file.
    fn begin(&mut self, path: PathBuf, offset: u64) -> PyResult<()> {
        let mut file = OpenOptions::new().write(true).open(path)?;
        file.seek(SeekFrom::Start(offset))?;
        let compressor = ParLasZipCompressor::new(file, self.vlr.clone()).map_err(os_error)?;
        self.file = Some(compressor);
        Ok(())
    }

    /// Appends points, record after record as LAS has them.
    #[pyo3(signature = (points, *, threads=0))]
    fn compress(
        &mut self,
        py: Python<'_>,
        points: PyReadonlyArray1<'_, u8>,
        threads: usize,
    ) -> PyResult<()> {
        let bytes = points.as_slice()?;
        if self.vlr.uses_variable_size_chunks() {
            let message = "the file has chunks of its own sizes, give them to compress_chunks()";
            return Err(PyValueError::new_err(message));
        }
        if !bytes.len().is_multiple_of(self.point_size) {
            let message = format!(
                "points: expected a multiple of {} bytes, got {}",
                self.point_size,
                bytes.len()
            );
            return Err(PyValueError::new_err(message));
        }
        let (file, waiting) = (begun(&mut self.file)?, &mut self.waiting);
        let whole = CHUNKS * self.vlr.chunk_size() as usize * self.point_size;
        let work = || {
            waiting.extend_from_slice(bytes);
            let n = waiting.len() / whole * whole;
            file.compress_many(&waiting[..n])?;
            waiting.drain(..n);
            Ok::<(), std::io::Error>(())
        };
        in_pool(py, threads, work)?.map_err(io_error)
    }

    /// Appends points as one chunk for each of `counts`, beside each other.
    #[pyo3(signature = (points, counts, *, threads=0))]
    fn compress_chunks(
        &mut self,
        py: Python<'_>,
        points: PyReadonlyArray1<'_, u8>,
        counts: Vec<usize>,
        threads: usize,
    ) -> PyResult<()> {
        let bytes = points.as_slice()?;
        if !self.vlr.uses_variable_size_chunks() {
            let message = "the file has chunks of one size, give the points to compress()";
            return Err(PyValueError::new_err(message));
        }
        let n_points = bytes.len() / self.point_size;
        let announced = counts
            .iter()
            .try_fold(0_usize, |n, count| n.checked_add(*count));
        let is_whole = bytes.len().is_multiple_of(self.point_size);
        if counts.contains(&0) || announced != Some(n_points) || !is_whole {
            let message = format!("counts: expected numbers above 0 of {n_points} points in all");
            return Err(PyValueError::new_err(message));
        }
        let mut rest = bytes;
        let mut chunks = Vec::with_capacity(counts.len());
        for count in counts {
            let (chunk, behind) = rest.split_at(count * self.point_size);
            chunks.push(chunk);
            rest = behind;
        }
        let file = begun(&mut self.file)?;
        in_pool(py, threads, || file.compress_chunks(chunks))?.map_err(io_error)
    }

    /// Writes what is held back and the table of chunks.
    #[pyo3(signature = (*, threads=0))]
    fn finish(&mut self, py: Python<'_>, threads: usize) -> PyResult<()> {
        let (file, waiting) = (begun(&mut self.file)?, &mut self.waiting);
        let work = || {
            if !waiting.is_empty() {
                file.compress_many(waiting).map_err(LasZipError::IoError)?;
            }
            file.done()
        };
        in_pool(py, threads, work)?.map_err(os_error)?;
        self.waiting.clear();
        self.file = None;
        Ok(())
    }
}

fn begun(file: &mut Option<ParLasZipCompressor<File>>) -> PyResult<&mut ParLasZipCompressor<File>> {
    let missing = || PyValueError::new_err("begin() was not called, or finish() was");
    file.as_mut().ok_or_else(missing)
}

/// An `OSError` with its number, by which Python tells a full disk from others.
fn io_error(error: std::io::Error) -> PyErr {
    match error.raw_os_error() {
        Some(number) => PyOSError::new_err((number, error.to_string())),
        None => error.into(),
    }
}

fn os_error(error: LasZipError) -> PyErr {
    match error {
        LasZipError::IoError(e) => io_error(e),
        other => PyOSError::new_err(other.to_string()),
    }
}
