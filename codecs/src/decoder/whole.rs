//! Decoding of what is there already, in one call.

use super::{Decoder, Event};
use crate::Limits;
use crate::error::Result;

impl Decoder {
    /// Pushes all of `input`, and calls `each` with every event but [`Event::NeedInput`]. Returns when the
    /// input is used up; more may follow.
    ///
    /// # Errors
    /// As [`Decoder::push`], with the same choice of what to do then: [`Decoder::position`] tells how much
    /// was used.
    pub fn push_all(
        &mut self,
        input: &[u8],
        mut each: impl FnMut(&mut Decoder, Event),
    ) -> Result<()> {
        let mut rest = input;
        loop {
            let (used, event) = self.push(rest)?;
            rest = &rest[used..];
            match event {
                Event::NeedInput => return Ok(()),
                Event::End if rest.is_empty() => {
                    each(self, event);
                    return Ok(());
                }
                _ => each(self, event),
            }
        }
    }
}

/// Decodes a whole stream, such as a file, and calls `each` with every event. Returns the decoder with the
/// state of the last frame.
///
/// ```
/// # use dapple_codec::{Event, Limits, Result, decode_all};
/// # fn frames(bytes: &[u8]) -> Result<u32> {
/// let mut frames = 0;
/// decode_all(bytes, Limits::default(), |decoder, event| {
///     if let Event::Frame(_) = event {
///         // Here `decoder` has the state of this frame.
///         frames += 1;
///     }
/// })?;
/// # Ok(frames)
/// # }
/// ```
///
/// # Errors
/// As [`Decoder::push`] and [`Decoder::finish`].
pub fn decode_all(
    bytes: &[u8],
    limits: Limits,
    each: impl FnMut(&mut Decoder, Event),
) -> Result<Decoder> {
    let mut decoder = Decoder::new(limits);
    decoder.push_all(bytes, each)?;
    decoder.finish()?;
    Ok(decoder)
}
