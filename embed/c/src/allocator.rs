//! The allocator hook: all memory of the library comes from functions of the caller.

use core::alloc::{GlobalAlloc, Layout};
use core::ffi::c_void;
use core::mem;
use core::sync::atomic::{AtomicBool, AtomicPtr, Ordering};
use std::alloc::System;

use crate::call::ARGUMENT;
use crate::error::ERROR_ARGUMENT;

/// Returns `size` bytes at a multiple of `alignment`, a power of two; null where there is no memory.
pub type AllocateFn = Option<unsafe extern "C" fn(size: usize, alignment: usize) -> *mut c_void>;
/// Frees what the other function returned for the same size and alignment.
pub type DeallocateFn =
    Option<unsafe extern "C" fn(memory: *mut c_void, size: usize, alignment: usize)>;

type Allocate = unsafe extern "C" fn(usize, usize) -> *mut c_void;
type Deallocate = unsafe extern "C" fn(*mut c_void, usize, usize);

/// The caller's functions; null before they are set.
static ALLOCATE: AtomicPtr<()> = AtomicPtr::new(core::ptr::null_mut());
static DEALLOCATE: AtomicPtr<()> = AtomicPtr::new(core::ptr::null_mut());
/// Memory was given out, so the functions are settled.
static IN_USE: AtomicBool = AtomicBool::new(false);

struct Hook;

#[global_allocator]
static HOOK: Hook = Hook;

/// The caller's functions, if any.
fn functions() -> Option<(Allocate, Deallocate)> {
    let allocate = ALLOCATE.load(Ordering::Acquire);
    let deallocate = DEALLOCATE.load(Ordering::Acquire);
    match allocate.is_null() || deallocate.is_null() {
        true => None,
        // SAFETY: both came from such functions, in `dapple_set_allocator`.
        false => Some(unsafe {
            (
                mem::transmute::<*mut (), Allocate>(allocate),
                mem::transmute::<*mut (), Deallocate>(deallocate),
            )
        }),
    }
}

// SAFETY: memory comes from the system, or from the caller, who promises what `AllocateFn` says; the choice
// does not change once memory was given out.
unsafe impl GlobalAlloc for Hook {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if !IN_USE.load(Ordering::Relaxed) {
            IN_USE.store(true, Ordering::Release);
        }
        // SAFETY: the promises of this function.
        unsafe {
            match functions() {
                Some((allocate, _)) => allocate(layout.size(), layout.align()).cast(),
                None => System.alloc(layout),
            }
        }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the promises of this function; the choice is settled first.
        unsafe {
            if functions().is_none() {
                IN_USE.store(true, Ordering::Release);
                return System.alloc_zeroed(layout);
            }
            let memory = self.alloc(layout);
            if !memory.is_null() {
                memory.write_bytes(0, layout.size());
            }
            memory
        }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        // SAFETY: the promises of this function.
        unsafe {
            if functions().is_none() {
                return System.realloc(memory, layout, new_size);
            }
            let new_layout = Layout::from_size_align_unchecked(new_size, layout.align());
            let moved = self.alloc(new_layout);
            if !moved.is_null() {
                moved.copy_from_nonoverlapping(memory, layout.size().min(new_size));
                self.dealloc(memory, layout);
            }
            moved
        }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the promises of this function.
        unsafe {
            match functions() {
                Some((_, free)) => free(memory.cast(), layout.size(), layout.align()),
                None => System.dealloc(memory, layout),
            }
        }
    }
}

/// Makes all memory of the library come from these functions, which any thread may call at any time. Call it
/// before any other function: -9001 where the library has memory already, or a function is null.
#[unsafe(no_mangle)]
pub extern "C" fn dapple_set_allocator(allocate: AllocateFn, deallocate: DeallocateFn) -> i32 {
    let (Some(allocate), Some(deallocate)) = (allocate, deallocate) else {
        return ARGUMENT;
    };
    if IN_USE.load(Ordering::Acquire) {
        return -(ERROR_ARGUMENT as i32);
    }
    DEALLOCATE.store(deallocate as *mut (), Ordering::Release);
    ALLOCATE.store(allocate as *mut (), Ordering::Release);
    0
}
