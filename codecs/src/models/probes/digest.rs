//! What a `probes` track adds to the state digest (`spec/probes.md` §11).

use super::Probe;
use crate::session::digest::StateDigest;
use crate::session::transforms::Transform;

impl StateDigest {
    /// Adds a `probes` track: its id, its last transform, its probes as they are coded, and its
    /// visibility block.
    pub fn probes(
        &mut self,
        id: u32,
        transform: Option<&Transform>,
        probes: &[Probe],
        visibility: Option<&[u8]>,
    ) {
        self.header(id, transform);
        self.probes_content(probes, visibility);
    }

    pub(super) fn probes_content(&mut self, probes: &[Probe], visibility: Option<&[u8]>) {
        for (index, probe) in probes.iter().enumerate() {
            if probe.level == 0 {
                continue;
            }
            let mut bytes = [0; 64];
            bytes[..4].copy_from_slice(&(index as u32).to_le_bytes());
            bytes[4] = probe.level;
            for (to, code) in bytes[8..]
                .as_chunks_mut::<2>()
                .0
                .iter_mut()
                .zip(probe.codes)
            {
                *to = code.to_le_bytes();
            }
            self.bytes(&bytes);
        }
        self.word(u32::from(visibility.is_some()));
        self.bytes(visibility.unwrap_or(&[]));
    }
}
