//! What a WebAssembly module needs in the place of an operating system: memory, and an end of panics. The
//! functions are for the JavaScript of `embed/js`.

use core::alloc::{GlobalAlloc, Layout};
use core::arch::wasm32::{memory_grow, memory_size, unreachable};
use core::cell::UnsafeCell;
use core::ptr::null_mut;

/// Blocks are multiples of this, and lie at multiples of it.
const UNIT: usize = 16;
/// A page of WebAssembly memory.
const PAGE: usize = 64 << 10;

/// A free block, at its own start. Blocks are linked in the order of their addresses and never touch.
struct Free {
    bytes: usize,
    next: *mut Free,
}

/// First fit among free blocks: small in code, and fast enough for the few blocks that a decoder has.
struct Memory(UnsafeCell<*mut Free>);

// SAFETY: the module has one thread.
unsafe impl Sync for Memory {}

#[global_allocator]
static MEMORY: Memory = Memory(UnsafeCell::new(null_mut()));

/// Bytes of the block of a layout; none where no block is right for it.
fn block_bytes(layout: Layout) -> Option<usize> {
    let bytes = layout.size().checked_next_multiple_of(UNIT)?;
    (layout.align() <= UNIT).then_some(bytes.max(UNIT))
}

// SAFETY: blocks are given out once until they come back, are aligned to 16 bytes, and lie in memory that was
// grown for them.
unsafe impl GlobalAlloc for Memory {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let Some(bytes) = block_bytes(layout) else {
            return null_mut();
        };
        // SAFETY: all pointers in the list are of free blocks.
        unsafe {
            loop {
                let mut at = self.0.get();
                while !(*at).is_null() {
                    let block = *at;
                    if (*block).bytes >= bytes {
                        let rest = (*block).bytes - bytes;
                        if rest == 0 {
                            *at = (*block).next;
                        } else {
                            // The end of the block is given out, so that its head stays.
                            (*block).bytes = rest;
                        }
                        return block.cast::<u8>().add(rest);
                    }
                    at = &raw mut (*block).next;
                }
                let pages = bytes.div_ceil(PAGE);
                let first = memory_grow(0, pages);
                if first == usize::MAX {
                    return null_mut();
                }
                self.give((first * PAGE) as *mut Free, pages * PAGE);
            }
        }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        if let Some(bytes) = block_bytes(layout) {
            // SAFETY: it was a block of so many bytes.
            unsafe { self.give(memory.cast(), bytes) };
        }
    }
}

impl Memory {
    /// Adds a block to the list, and merges it with its neighbours.
    ///
    /// # Safety
    /// Nobody else uses the block.
    unsafe fn give(&self, block: *mut Free, bytes: usize) {
        // SAFETY: the caller's promise; all pointers in the list are of free blocks.
        unsafe {
            let mut at = self.0.get();
            let mut before: *mut Free = null_mut();
            while !(*at).is_null() && *at < block {
                before = *at;
                at = &raw mut (*before).next;
            }
            block.write(Free { bytes, next: *at });
            *at = block;
            merge(block);
            if !before.is_null() {
                merge(before);
            }
        }
    }
}

/// Merges a block with the next one where they touch.
///
/// # Safety
/// The block is in the list.
unsafe fn merge(block: *mut Free) {
    // SAFETY: the caller's promise.
    unsafe {
        let next = (*block).next;
        if !next.is_null() && block.cast::<u8>().add((*block).bytes) == next.cast() {
            (*block).bytes += (*next).bytes;
            (*block).next = (*next).next;
        }
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    unreachable()
}

/// Memory for `size` bytes, at a multiple of 16; 0 where there is none.
#[unsafe(no_mangle)]
pub extern "C" fn dapple_wasm_allocate(size: usize) -> *mut u8 {
    let layout = Layout::from_size_align(size, UNIT);
    // SAFETY: a block is never of 0 bytes.
    layout.map_or(null_mut(), |layout| unsafe { MEMORY.alloc(layout) })
}

/// Frees what [`dapple_wasm_allocate`] gave for `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_wasm_free(memory: *mut u8, size: usize) {
    if let Ok(layout) = Layout::from_size_align(size, UNIT)
        && !memory.is_null()
    {
        // SAFETY: the caller's promise.
        unsafe { MEMORY.dealloc(memory, layout) };
    }
}

/// Bytes of the module's memory.
#[unsafe(no_mangle)]
pub extern "C" fn dapple_wasm_memory() -> usize {
    memory_size(0) * PAGE
}
