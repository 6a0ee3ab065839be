//! The payload of a `probes` record, written.

use alloc::vec;
use alloc::vec::Vec;

use super::decode::HAS_VISIBILITY;
use super::values::Scales;
use super::{Coding, OPEN, Probe, Volume, contexts, maps, packed, raw};
use crate::container::Compression;
use crate::encoder::Encoder;
use crate::entropy;
use crate::error::{ErrorKind, Result};
use crate::memory::index_set::IndexSet;
use crate::models::ModelKind;
use crate::models::payload_header::{Coverage, write_header};
use crate::wire::put_u32;

/// Content of one track for one frame.
#[derive(Clone, Copy, Debug)]
pub struct Update<'a> {
    /// Id of the track.
    pub track: u32,
    /// All its probes in the last committed frame, which a delta builds on; not looked at in a
    /// keyframe. An absent probe for each where nothing is known: after a keyframe group that left
    /// the track out, say.
    pub base: &'a [Probe],
    /// All its probes in this frame, in the order of [`Volume::index`].
    pub probes: &'a [Probe],
    /// Its visibility block, where it is sent: [`Volume::visibility_bytes`] bytes, in the coding `packed`
    /// rounded by [`Volume::quantize_visibility`]. A keyframe without one has none; a delta without one
    /// keeps it. Of a delta in the coding `packed`, only the maps that change take bytes.
    pub visibility: Option<&'a [u8]>,
}

impl Encoder {
    /// Content of the frame for `probes` tracks, with the same rules as [`Encoder::points`].
    ///
    /// # Errors
    /// 2004, 2019, 2027, 3103, 3104, 4001 for a delta in the first frame of a keyframe group or on
    /// probes that are not those of the last commit, 4008 before the first group, 4009, 4010, 4012
    /// for slices of a wrong length.
    pub fn probes(
        &mut self,
        out: &mut Vec<u8>,
        coverage: Coverage,
        updates: &[Update<'_>],
        compression: Compression,
    ) -> Result<()> {
        let bytes = |update: &Update<'_>| {
            56 * update.probes.len() + update.visibility.map_or(0, <[u8]>::len)
        };
        self.content(
            out,
            (ModelKind::Probes, compression),
            coverage,
            updates,
            bytes,
            |session, base, now, payload| {
                let volume_of = |id| {
                    let track = session.track(id)?;
                    let volume = track.track.volume().ok_or(ErrorKind::TrackModel)?;
                    let state = &session.models.probes.state;
                    Ok(Committed {
                        volume,
                        probes: state.probes_of(track),
                        visibility: state.visibility_of(track),
                    })
                };
                write_payload(base, now, volume_of, payload)
            },
        )
    }
}

/// A declared track of the model as of the last committed frame.
struct Committed<'v> {
    volume: &'v Volume,
    probes: &'v [Probe],
    visibility: Option<&'v [u8]>,
}

/// Appends the payload. `volume_of` finds a declared track of the model.
fn write_payload<'v>(
    base: Option<u32>,
    updates: &[Update<'_>],
    volume_of: impl Fn(u32) -> core::result::Result<Committed<'v>, ErrorKind>,
    out: &mut Vec<u8>,
) -> core::result::Result<(), ErrorKind> {
    let count = |n: usize| u32::try_from(n).map_err(|_| ErrorKind::EncoderUse);
    if !updates.is_sorted_by(|a, b| a.track < b.track) {
        return Err(ErrorKind::EntryOrder);
    }
    write_header(base, count(updates.len())?, out);
    let mut entry = out.len();
    for update in updates {
        put_u32(out, update.track);
        put_u32(out, 0);
        put_u32(out, u32::from(update.visibility.is_some()) * HAS_VISIBILITY);
    }
    for update in updates {
        let committed = volume_of(update.track)?;
        let known = update.base.len() != committed.probes.len() || update.base == committed.probes;
        if base.is_some() && !known {
            return Err(ErrorKind::MissingBase);
        }
        let start = out.len();
        write_track(&committed, base.is_none(), update, out)?;
        let size = count(out.len() - start)?;
        out[entry + 4..entry + 8].copy_from_slice(&size.to_le_bytes());
        entry += 12;
    }
    Ok(())
}

fn write_track(
    committed: &Committed<'_>,
    keyframe: bool,
    update: &Update<'_>,
    out: &mut Vec<u8>,
) -> core::result::Result<(), ErrorKind> {
    let volume = committed.volume;
    let probes = update.probes;
    let base = (!keyframe).then_some(update.base);
    if probes.len() != volume.count() || base.is_some_and(|base| base.len() != probes.len()) {
        return Err(ErrorKind::EncoderUse);
    }
    if let Some(bytes) = update.visibility {
        if bytes.is_empty() || bytes.len() as u64 != volume.visibility_bytes() {
            return Err(ErrorKind::EncoderUse);
        }
        if volume.coding == Coding::Raw {
            out.extend_from_slice(bytes);
        }
    }
    let all = || probes.iter().chain(base.into_iter().flatten());
    match volume.coding {
        Coding::Raw => {
            all().try_for_each(raw::check_probe)?;
            raw::write(base, probes, out);
        }
        Coding::Packed(steps) => {
            let scales = Scales::new(&steps);
            all().try_for_each(|probe| packed::check_probe(&scales, probe))?;
            let mut written = match base {
                Some(base) => base.to_vec(),
                None => vec![Probe::ABSENT; probes.len()],
            };
            let mut marks = vec![0; probes.len()];
            let mut contexts = contexts::initial();
            let mut writer = entropy::Writer::new(out, &mut contexts);
            if let Some(block) = update.visibility {
                let base = committed.visibility.filter(|_| !keyframe);
                write_maps(&mut writer, volume, base, block)?;
            }
            let mut walk = packed::Walk {
                probes: &mut written,
                present: None,
                marks: &mut marks,
                changed: &mut IndexSet::new(probes.len())?,
            };
            packed::code(&mut writer, volume, &scales, Some(probes), &mut walk)?;
            writer.end();
        }
    }
    Ok(())
}

/// Writes the maps of a block that differ from those of `base`; from open ones without it.
fn write_maps(
    writer: &mut entropy::Writer<'_>,
    volume: &Volume,
    base: Option<&[u8]>,
    block: &[u8],
) -> core::result::Result<(), ErrorKind> {
    let wanted = block.as_chunks().0;
    maps::check(volume, wanted)?;
    let mut written = match base {
        Some(base) => base.as_chunks().0.to_vec(),
        None => vec![OPEN; wanted.len()],
    };
    let mut walk = maps::Walk {
        maps: &mut written,
        intra: base.is_none(),
        changed: &mut IndexSet::new(volume.count())?,
    };
    maps::code(writer, volume, Some(wanted), &mut walk)?;
    Ok(())
}
