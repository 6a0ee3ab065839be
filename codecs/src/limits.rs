//! What a stream may ask of the machine that decodes it.

use crate::container::unpack::Unpacker;
use crate::error::{ErrorDetail, ErrorKind, Limit};

/// What is kept of a track without its path: while it is read, in the state, in the pending frame, and among
/// the places that it may leave free.
pub(crate) const TRACK_BYTES: u64 = 3072;
/// Dirty ranges, and lists of free places for no tracks.
const LIST_BYTES: u64 = 64 << 10;

/// Upper bounds that every length in a stream is compared with before memory is reserved for it.
///
/// Together they bound a decoder's memory: [`Limits::heap_bytes`]. Each buffer grows to what was
/// needed and is kept.
///
/// The work of a record is bounded by its unpacked bytes, the state that it changes, and
/// `state_bytes` where it empties tracks or has a digest. That of a stream is bounded by its bytes:
/// see `work_per_byte`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of one record's payload as stored. Default 256 MiB.
    pub stored_bytes: u32,
    /// Bytes of one record's payload unpacked. Default 256 MiB: a keyframe of one
    /// track is one record, and a mesh of a few million points needs that much.
    pub unpacked_bytes: u32,
    /// Unpacked bytes of all model records of one frame. Default 512 MiB.
    pub frame_bytes: u32,
    /// Window of a zstd frame. Default 8 MiB, which RFC 8878 asks every decoder to support.
    pub zstd_window_bytes: u32,
    /// Tracks that are declared and not removed. Default 65 536.
    pub tracks: u32,
    /// UTF-8 bytes of a track's path. Default 1024.
    pub path_bytes: u32,
    /// Bytes of decoded state of all tracks: 32 a bucket and 36 a cell. Default 512 MiB.
    pub state_bytes: u64,
    /// Steps of work ([`crate::Decoder::work`]) for each byte of the stream so far, beyond those that
    /// `state_bytes` allows: one for two bytes of it. Default 400.
    pub work_per_byte: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            stored_bytes: 256 << 20,
            unpacked_bytes: 256 << 20,
            frame_bytes: 512 << 20,
            zstd_window_bytes: 8 << 20,
            tracks: 65_536,
            path_bytes: 1024,
            state_bytes: 512 << 20,
            work_per_byte: 400,
        }
    }
}

impl Limits {
    /// The value of a limit.
    pub fn get(&self, which: Limit) -> u64 {
        match which {
            Limit::StoredBytes => self.stored_bytes.into(),
            Limit::UnpackedBytes => self.unpacked_bytes.into(),
            Limit::FrameBytes => self.frame_bytes.into(),
            Limit::ZstdWindowBytes => self.zstd_window_bytes.into(),
            Limit::Tracks => self.tracks.into(),
            Limit::PathBytes => self.path_bytes.into(),
            Limit::StateBytes => self.state_bytes,
            Limit::WorkPerByte => self.work_per_byte.into(),
        }
    }

    /// Sets a limit. `false`, and no change, where the value is beyond its 32 bits; `state_bytes`
    /// has 64.
    #[must_use]
    pub fn set(&mut self, which: Limit, value: u64) -> bool {
        let field = match which {
            Limit::StoredBytes => &mut self.stored_bytes,
            Limit::UnpackedBytes => &mut self.unpacked_bytes,
            Limit::FrameBytes => &mut self.frame_bytes,
            Limit::ZstdWindowBytes => &mut self.zstd_window_bytes,
            Limit::Tracks => &mut self.tracks,
            Limit::PathBytes => &mut self.path_bytes,
            Limit::WorkPerByte => &mut self.work_per_byte,
            Limit::StateBytes => {
                self.state_bytes = value;
                return true;
            }
        };
        u32::try_from(value).map(|value| *field = value).is_ok()
    }

    /// The limit of the work of a stream of which `bytes` came.
    pub(crate) fn check_work(&self, work: u64, bytes: u64) -> Result<(), ErrorDetail> {
        let more = bytes.saturating_mul(self.work_per_byte.into());
        let allowed = more.saturating_add(self.state_bytes / 2);
        match work <= allowed {
            true => Ok(()),
            false => Err(ErrorDetail::limit(
                ErrorKind::WorkLimit,
                Limit::WorkPerByte,
                work,
                allowed,
            )),
        }
    }

    /// The limits of a record's payload, as stored and unpacked.
    pub(crate) fn check_record(&self, stored: u64, unpacked: u64) -> Result<(), ErrorDetail> {
        for (fault, which, asked) in [
            (ErrorKind::StoredLimit, Limit::StoredBytes, stored),
            (ErrorKind::UnpackedLimit, Limit::UnpackedBytes, unpacked),
        ] {
            let allowed = self.get(which);
            if asked > allowed {
                return Err(ErrorDetail::limit(fault, which, asked, allowed));
            }
        }
        Ok(())
    }

    /// The most bytes that a decoder with these limits ever has allocated at once, whatever it is
    /// fed, through errors, [`crate::Decoder::resume`] and [`crate::Decoder::reset`]. The
    /// decompressors count, in C or not; what an allocator adds to each block does not.
    ///
    /// It is the sum of
    /// - `stored_bytes` for a record that is still arriving,
    /// - `unpacked_bytes` for an unpacked record of any type but `points`,
    /// - `frame_bytes` for the pending frame,
    /// - `state_bytes` for the state,
    /// - 3072 bytes of bookkeeping for each of `tracks`,
    /// - the largest of those five once more: a buffer that grows is copied, and one does so at a
    ///   time,
    /// - `path_bytes` for each of `tracks`, and for one more that is only looked at,
    /// - 64 KiB for lists that no stream makes longer,
    /// - zstd: 192 KiB with the feature `zstd-native`; without it `3 * zstd_window_bytes` and 8 MiB, most of
    ///   which only frames take that claim more sequences than a block can hold.
    pub fn heap_bytes(&self) -> u64 {
        let tracks = u64::from(self.tracks);
        let parts = [
            self.stored_bytes.into(),
            self.unpacked_bytes.into(),
            self.frame_bytes.into(),
            self.state_bytes,
            tracks.saturating_mul(TRACK_BYTES),
        ];
        let paths = tracks
            .saturating_add(1)
            .saturating_mul(self.path_bytes.into());
        let largest = parts.iter().max().copied().unwrap_or(0);
        parts
            .iter()
            .fold(largest, |sum, &part| sum.saturating_add(part))
            .saturating_add(paths)
            .saturating_add(LIST_BYTES)
            .saturating_add(Unpacker::heap_bytes(self.zstd_window_bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::format;

    #[test]
    fn each_limit_sets_the_field_that_it_names() {
        let mut limits = Limits::default();
        for (value, &which) in (1..).zip(Limit::ALL) {
            assert!(limits.set(which, value));
            assert_eq!(limits.get(which), value);
            let text = format!("{limits:?}");
            let field = format!(" {}: {value}", which.name());
            assert!(text.contains(&field), "{field} in {text}");
        }
        // All fields are named here, so a new one cannot be forgotten in `Limit::ALL`.
        let all = Limits {
            stored_bytes: 1,
            unpacked_bytes: 2,
            frame_bytes: 3,
            zstd_window_bytes: 4,
            tracks: 5,
            path_bytes: 6,
            state_bytes: 7,
            work_per_byte: 8,
        };
        assert_eq!(limits, all);
        for &which in Limit::ALL {
            let wide = limits.set(which, 1 << 32);
            assert_eq!(wide, which == Limit::StateBytes);
        }
        assert_eq!((limits.tracks, limits.state_bytes), (5, 1 << 32));
    }
}
