//! Errors: ids of the format as they are, and those of this interface.

use core::ffi::c_char;
use core::fmt::{self, Write as _};

use dapple_codec::{Error, ErrorClass, Layer};

use crate::call::Status;
use crate::numbers;

/// An argument is null where it must not be, not aligned, or out of range.
pub const ERROR_ARGUMENT: u32 = 9001;
/// The library stopped at a defect of its own. The handle has to be reset or freed.
pub const ERROR_PANIC: u32 = 9002;
/// There is no such track.
pub const ERROR_NO_TRACK: u32 = 9003;
/// The library was built without what was asked for.
pub const ERROR_NOT_BUILT: u32 = 9004;

/// As where the codec has no memory.
pub(crate) const NO_MEMORY: Status = -4013;

/// What went wrong, and where. All zeros where nothing did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct ErrorInfo {
    /// Stable id: of the format as `spec/README.md` lists it, such as 3005, or `DAPPLE_ERROR_*`.
    pub id: u32,
    /// `DAPPLE_LAYER_*`.
    pub layer: u32,
    /// `DAPPLE_CLASS_*`.
    pub class_: u32,
    /// The limit that is exceeded, `DAPPLE_LIMIT_*`, or 0.
    pub limit: u32,
    /// Byte offset in the stream: of the preamble, the record header or the record payload at fault. For an
    /// encoder, the number of bytes written so far.
    pub offset: u64,
    /// What the stream asks of that limit.
    pub asked: u64,
    /// What the limit allows.
    pub allowed: u64,
    /// The number that the stream has in the place of one that is known, if `has_found` is 1.
    pub found: u64,
    /// Whether `found` has a value.
    pub has_found: u32,
    /// The track whose declaration is at fault, if `has_track` is 1.
    pub track: u32,
    /// Whether `track` has a value.
    pub has_track: u32,
    /// 0.
    pub reserved: u32,
}

impl From<Error> for ErrorInfo {
    fn from(error: Error) -> ErrorInfo {
        let mut info = ErrorInfo {
            id: error.id.into(),
            layer: error.layer.number(),
            class_: error.class.number(),
            offset: error.offset,
            found: error.found.unwrap_or(0),
            has_found: error.found.is_some().into(),
            track: error.track.unwrap_or(0),
            has_track: error.track.is_some().into(),
            ..ErrorInfo::default()
        };
        if let ErrorClass::LimitExceeded {
            which,
            asked,
            allowed,
        } = error.class
        {
            info.limit = which.number();
            info.asked = asked;
            info.allowed = allowed;
        }
        info
    }
}

/// Minus the id of an error.
pub(crate) fn status(error: &Error) -> Status {
    -Status::from(error.id)
}

/// The name of an error of the format by its id.
fn name(id: u32) -> &'static str {
    match id {
        0 => "none",
        ERROR_ARGUMENT => "argument",
        ERROR_PANIC => "panic",
        ERROR_NO_TRACK => "no-track",
        ERROR_NOT_BUILT => "not-built",
        _ => u16::try_from(id).map_or("unknown", |id| {
            // A name depends on the id alone.
            let error = Error {
                layer: Layer::Session,
                class: ErrorClass::Usage,
                id,
                offset: 0,
                found: None,
                track: None,
            };
            error.name()
        }),
    }
}

/// A text of the caller's, of which the last byte is 0: what does not fit is cut off, and counted.
pub(crate) struct Text<'t> {
    out: &'t mut [u8],
    used: usize,
}

impl fmt::Write for Text<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for &byte in text.as_bytes() {
            if self.used + 1 < self.out.len() {
                self.out[self.used] = byte;
            }
            self.used += 1;
        }
        Ok(())
    }
}

/// Writes what `write` writes, and a 0. Returns the bytes that the text has without that.
///
/// # Safety
/// `out` is null, or there are `size` bytes.
pub(crate) unsafe fn text(
    out: *mut c_char,
    size: usize,
    write: impl FnOnce(&mut Text<'_>) -> fmt::Result,
) -> usize {
    let out: &mut [u8] = match out.is_null() || size == 0 {
        true => &mut [],
        // SAFETY: the caller's promise. Bytes that are not written yet are written first.
        false => unsafe {
            core::ptr::write_bytes(out, 0, size);
            core::slice::from_raw_parts_mut(out.cast(), size)
        },
    };
    let mut text = Text { out, used: 0 };
    let _ = write(&mut text);
    text.used
}

/// Writes the short, stable name of an error, such as `header-checksum`, and a 0 to `out`, which has `size`
/// bytes; what does not fit is cut off. Returns the length of the name.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_error_name(id: u32, out: *mut c_char, size: usize) -> usize {
    // SAFETY: the caller's promise.
    unsafe { text(out, size, |text| text.write_str(name(id))) }
}

/// An error as a sentence.
pub(crate) fn sentence(info: &ErrorInfo, of: Option<&Error>, text: &mut Text<'_>) -> fmt::Result {
    match of {
        Some(error) => write!(text, "{error}"),
        None => write!(text, "E{} {}", info.id, name(info.id)),
    }
}

/// The last error of a handle.
#[derive(Clone, Copy, Default)]
pub(crate) struct LastError {
    pub(crate) info: ErrorInfo,
    error: Option<Error>,
}

impl LastError {
    /// Keeps an error of the codec; returns its status.
    pub(crate) fn set(&mut self, error: Error) -> Status {
        self.info = error.into();
        self.error = Some(error);
        status(&error)
    }

    /// Keeps an error of this interface, if it is not that of the codec which is kept; returns the status.
    pub(crate) fn set_status(&mut self, status: Status) -> Status {
        let kept = self
            .error
            .is_some_and(|error| self::status(&error) == status);
        if !kept {
            let (layer, class) = match status == NO_MEMORY {
                true => (numbers::Layer::Session, numbers::Class::OutOfMemory),
                false => (numbers::Layer::Interface, numbers::Class::Usage),
            };
            self.error = None;
            self.info = ErrorInfo {
                id: status.unsigned_abs(),
                layer: layer as u32,
                class_: class as u32,
                ..ErrorInfo::default()
            };
        }
        status
    }

    /// As a sentence.
    pub(crate) fn sentence(&self, text: &mut Text<'_>) -> fmt::Result {
        sentence(&self.info, self.error.as_ref(), text)
    }
}
