//! The sixteen bytes a stream starts with.

use alloc::vec::Vec;

use super::crc::crc32c;
use crate::error::{ErrorDetail, ErrorKind};

/// Catches text-mode and seven-bit transfer damage, as PNG's signature does.
pub const MAGIC: [u8; 8] = [0x89, b'D', b'P', b'L', 0x0d, 0x0a, 0x1a, 0x0a];
/// Size of the preamble.
pub const PREAMBLE_BYTES: usize = 16;
/// The container version that this library reads and writes.
pub const CONTAINER_VERSION: u16 = 1;

/// Profiles: how records travel.
pub mod profile {
    /// An ordered, reliable byte stream or file.
    pub const STREAM: u16 = 0;
    /// Reserved for datagrams; not defined.
    pub const DATAGRAM: u16 = 1;
}

/// The first sixteen bytes of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Preamble {
    /// Container version.
    pub version: u16,
    /// One of [`profile`].
    pub profile: u16,
}

impl Preamble {
    /// Reads a preamble of any version and profile.
    ///
    /// # Errors
    /// 1001 and 1002.
    pub fn read(bytes: &[u8; PREAMBLE_BYTES]) -> crate::Result<Preamble> {
        Preamble::parse(bytes).map_err(|fault| ErrorDetail::from(fault).at(0))
    }

    fn parse(bytes: &[u8; PREAMBLE_BYTES]) -> Result<Preamble, ErrorKind> {
        if bytes[..8] != MAGIC {
            return Err(ErrorKind::Magic);
        }
        let crc = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]);
        if crc32c(&bytes[..12]) != crc {
            return Err(ErrorKind::PreambleChecksum);
        }
        let version = u16::from_le_bytes([bytes[8], bytes[9]]);
        let profile = u16::from_le_bytes([bytes[10], bytes[11]]);
        Ok(Preamble { version, profile })
    }

    /// Reads a preamble that this library can go on from.
    pub(crate) fn read_known(bytes: &[u8; PREAMBLE_BYTES]) -> Result<Preamble, ErrorDetail> {
        let preamble = Preamble::parse(bytes)?;
        if preamble.version != CONTAINER_VERSION {
            return Err(ErrorDetail::found(
                ErrorKind::ContainerVersion,
                preamble.version,
            ));
        }
        if preamble.profile != profile::STREAM {
            return Err(ErrorDetail::found(ErrorKind::Profile, preamble.profile));
        }
        Ok(preamble)
    }

    pub(crate) fn write(self, out: &mut Vec<u8>) {
        let start = out.len();
        out.extend_from_slice(&MAGIC);
        out.extend_from_slice(&self.version.to_le_bytes());
        out.extend_from_slice(&self.profile.to_le_bytes());
        let crc = crc32c(&out[start..]);
        out.extend_from_slice(&crc.to_le_bytes());
    }
}
