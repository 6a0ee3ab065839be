//! `-o`: values as a stream.

use super::super::args;
use super::super::inputs::is_dash;
use super::super::limits::LimitArgs;
use super::super::output::Sink;
use crate::Result;
use crate::bake::regions::Regions;
use crate::bake::stream::{Options, check, write};
use crate::bake::{Baked, Plan};
use crate::codec::Compression;
use serde::Serialize;
use std::path::PathBuf;

#[derive(Clone, Debug, clap::Args)]
pub struct StreamArgs {
    /// Where the stream goes; `-` for standard output. Missing folders are made.
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: Option<PathBuf>,
    /// Bits of a value in the stream, 8 or 5; with 5 values are dithered.
    #[arg(long, value_name = "BITS", default_value = "8", value_parser = bits, help_heading = "Stream")]
    bits: u8,
    /// `zstd:LEVEL` (1 to 19) with the lazy strategy; `zstd:LEVEL:auto` with the level's own; `lz4`; or
    /// `none`.
    #[arg(long, value_name = "METHOD", default_value = "zstd:19:auto",
        value_parser = args::compression, help_heading = "Stream")]
    compression: Compression,
    #[command(flatten)]
    limits: LimitArgs,
}

fn bits(text: &str) -> std::result::Result<u8, String> {
    match text {
        "8" => Ok(8),
        "5" => Ok(5),
        _ => Err("expected 8 or 5".into()),
    }
}

/// A stream that was started.
pub struct Stream {
    path: PathBuf,
    sink: Sink,
    options: Options,
}

/// Figures of what was written.
#[derive(Clone, Debug, Serialize)]
pub struct StreamFigures {
    pub file: String,
    pub bytes: u64,
    pub tracks: usize,
    /// With a tolerance: what other choices would have cost.
    pub alternatives: Option<Alternatives>,
}

/// Size, without regions, and held-out error of three choices of rungs.
#[derive(Clone, Debug, Serialize)]
pub struct Alternatives {
    pub chosen: Alternative,
    /// One number for each instance.
    pub cheapest: Alternative,
    /// The most that was tried for each instance.
    pub richest: Alternative,
}

#[derive(Clone, Debug, Serialize)]
pub struct Alternative {
    pub bytes: u64,
    /// Root mean square over held-out samples, by area.
    pub error: Option<f64>,
}

impl StreamArgs {
    /// Whether standard output has the stream.
    pub fn is_stdout(&self) -> bool {
        self.output.as_deref().is_some_and(is_dash)
    }

    /// Starts the stream, if one is asked for; a task of a farm has none.
    ///
    /// # Errors
    /// As [`Sink::create`].
    pub fn create(&self, is_task: bool) -> Result<Option<Stream>> {
        let Some(path) = self.output.as_deref().filter(|_| !is_task) else {
            return Ok(None);
        };
        Ok(Some(Stream {
            path: path.to_owned(),
            sink: Sink::create(path)?,
            options: Options {
                bits: self.bits,
                compression: self.compression,
                limits: self.limits.limits(),
            },
        }))
    }
}

impl Stream {
    /// Refuses what no decoder reads, before anything is traced.
    ///
    /// # Errors
    /// As [`check`].
    pub fn check(&self, plan: &Plan) -> Result<()> {
        check(plan, self.options)
    }

    /// Writes the stream.
    ///
    /// # Errors
    /// `Codec` for more than the limits allow, `Io` where it cannot be written.
    pub fn write(
        mut self,
        plan: &Plan,
        baked: &Baked,
        regions: Option<&Regions>,
    ) -> Result<StreamFigures> {
        let (bytes, tracks) = write(plan, baked, regions, self.options)?;
        self.sink.write(&bytes)?;
        self.sink.finish()?;
        let measured = |baked: &Baked, bytes: usize| Alternative {
            bytes: bytes as u64,
            error: baked.error(),
        };
        let alternative = |baked: &Baked| -> Result<Alternative> {
            Ok(measured(
                baked,
                write(plan, baked, None, self.options)?.0.len(),
            ))
        };
        let alternatives = match plan.settings().tolerance {
            None => None,
            Some(_) => Some(Alternatives {
                chosen: match regions {
                    None => measured(baked, bytes.len()),
                    Some(_) => alternative(baked)?,
                },
                cheapest: alternative(&baked.cheapest())?,
                richest: alternative(&baked.richest())?,
            }),
        };
        Ok(StreamFigures {
            file: self.path.display().to_string(),
            bytes: bytes.len() as u64,
            tracks,
            alternatives,
        })
    }
}
