//! What every function of the interface does: no panic leaves it, and pointers are looked at before they
//! are used.

use alloc::alloc::alloc;
use alloc::boxed::Box;
use core::alloc::Layout;
use core::slice;

use crate::error::{ERROR_ARGUMENT, ERROR_PANIC, LastError};

/// 0 or more, or minus an error's id.
pub(crate) type Status = i32;

/// A misused argument.
pub(crate) const ARGUMENT: Status = -(ERROR_ARGUMENT as Status);

/// What a pointer to C is the address of.
pub(crate) trait Handle {
    /// A panic left the object in an unknown state.
    fn broken(&mut self) -> &mut bool;

    /// The last error, which a caller can ask for.
    fn last_error(&mut self) -> &mut LastError;
}

/// Calls `f` with the object of a handle, unless a panic broke that.
///
/// # Safety
/// `handle` is null, or from [`into_handle`] and not freed, and nobody else uses it now.
pub(crate) unsafe fn with<H: Handle>(
    handle: *mut H,
    f: impl FnOnce(&mut H) -> Result<Status, Status>,
) -> Status {
    // SAFETY: the caller's promise.
    let Some(object) = (unsafe { handle.as_mut() }) else {
        return ARGUMENT;
    };
    if *object.broken() {
        return -(ERROR_PANIC as Status);
    }
    match catch(|| f(object)) {
        Some(Ok(status)) => status,
        // SAFETY: as above; the borrow before ended with the call.
        Some(Err(status)) => unsafe { (*handle).last_error().set_status(status) },
        None => {
            // SAFETY: as above; the borrow before ended with the panic.
            let object = unsafe { &mut *handle };
            *object.broken() = true;
            object.last_error().set_status(-(ERROR_PANIC as Status))
        }
    }
}

/// Calls `f`; none where it panics.
#[cfg(feature = "std")]
pub(crate) fn catch<T>(f: impl FnOnce() -> T) -> Option<T> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(f)).ok()
}

/// Without the standard library a panic ends in the program's panic handler.
#[cfg(not(feature = "std"))]
pub(crate) fn catch<T>(f: impl FnOnce() -> T) -> Option<T> {
    Some(f())
}

/// The object in memory of its own; null where there is none.
pub(crate) fn into_handle<H>(object: H) -> *mut H {
    const { assert!(size_of::<H>() > 0) };
    // SAFETY: the size is not 0. The memory has the layout that a box frees.
    unsafe {
        let memory = alloc(Layout::new::<H>()).cast::<H>();
        if !memory.is_null() {
            memory.write(object);
        }
        memory
    }
}

/// Frees what [`into_handle`] made; null is left alone.
///
/// # Safety
/// `handle` is null or from [`into_handle`], and nobody uses it from now on.
pub(crate) unsafe fn free<H>(handle: *mut H) {
    if !handle.is_null() {
        // SAFETY: the caller's promise.
        let _ = catch(|| drop(unsafe { Box::from_raw(handle) }));
    }
}

/// `count` items of the caller's.
///
/// # Safety
/// Where `items` is not null, so many items stay readable and unchanged for `'a`.
pub(crate) unsafe fn items<'a, T>(items: *const T, count: usize) -> Result<&'a [T], Status> {
    if count == 0 {
        return Ok(&[]);
    }
    let fits = count <= isize::MAX as usize / size_of::<T>().max(1);
    match items.is_null() || !items.is_aligned() || !fits {
        true => Err(ARGUMENT),
        // SAFETY: the caller's promise, and the checks above.
        false => Ok(unsafe { slice::from_raw_parts(items, count) }),
    }
}

/// Writes a result to where the caller wants it.
///
/// # Safety
/// `to` is null, or there is memory for a value.
pub(crate) unsafe fn put<T>(to: *mut T, value: T) -> Result<Status, Status> {
    if to.is_null() || !to.is_aligned() {
        return Err(ARGUMENT);
    }
    // SAFETY: the caller's promise.
    unsafe { to.write(value) };
    Ok(0)
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;

    struct Counter {
        calls: u32,
        broken: bool,
        error: LastError,
    }

    impl Handle for Counter {
        fn broken(&mut self) -> &mut bool {
            &mut self.broken
        }

        fn last_error(&mut self) -> &mut LastError {
            &mut self.error
        }
    }

    #[test]
    fn panics_become_an_error_and_break_the_handle() {
        let handle = into_handle(Counter {
            calls: 0,
            broken: false,
            error: LastError::default(),
        });
        let count = |counter: &mut Counter| {
            counter.calls += 1;
            assert!(counter.calls < 2, "the panic of this test");
            Ok(counter.calls as Status)
        };
        // SAFETY: the handle lives until `free`.
        unsafe {
            assert_eq!(with(handle, count), 1);
            assert_eq!(with(handle, count), -(ERROR_PANIC as Status));
            assert_eq!(with(handle, |_| Ok(7)), -(ERROR_PANIC as Status));
            free(handle);
        }
    }

    #[test]
    fn bad_pointers_are_refused() {
        let words = [1u32, 2];
        // SAFETY: what is null, not aligned or too long is not read.
        unsafe {
            assert_eq!(with(core::ptr::null_mut::<Counter>(), |_| Ok(0)), ARGUMENT);
            assert_eq!(items(words.as_ptr(), 2), Ok(&words[..]));
            assert_eq!(items::<u32>(core::ptr::null(), 0), Ok(&[][..]));
            assert_eq!(items::<u32>(core::ptr::null(), 1), Err(ARGUMENT));
            assert_eq!(items(words.as_ptr(), usize::MAX), Err(ARGUMENT));
            let odd = words.as_ptr().cast::<u8>().add(1).cast::<u32>();
            assert_eq!(items(odd, 1), Err(ARGUMENT));
            assert_eq!(put(core::ptr::null_mut(), 1u32), Err(ARGUMENT));
        }
    }
}
