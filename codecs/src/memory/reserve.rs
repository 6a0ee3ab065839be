//! Buffers that grow within a bound. Memory that cannot be had is an error.

use alloc::vec::Vec;

use crate::error::ErrorKind;

/// Reserves memory for `more` items. Doubles, so that many small steps stay cheap, but goes to no
/// more than `most` items in all, which the caller has checked `more` against.
pub(crate) fn reserve_bounded<T>(
    items: &mut Vec<T>,
    more: usize,
    most: usize,
) -> Result<(), ErrorKind> {
    let needed = items.len() + more;
    if needed > items.capacity() {
        let wanted = grown(items.capacity(), needed, most);
        reserve_exact(items, wanted - items.len())?;
    }
    Ok(())
}

/// Reserves memory for `more` items and no more.
pub(crate) fn reserve_exact<T>(items: &mut Vec<T>, more: usize) -> Result<(), ErrorKind> {
    items.try_reserve_exact(more).map_err(|_| ErrorKind::Memory)
}

/// `count` copies of a value, in exactly as much memory as they take.
pub(crate) fn filled<T: Clone>(count: usize, value: T) -> Result<Vec<T>, ErrorKind> {
    let mut items = Vec::new();
    reserve_exact(&mut items, count)?;
    items.resize(count, value);
    Ok(items)
}

/// What a buffer of `capacity` items grows to for `needed` of them.
pub(crate) fn grown(capacity: usize, needed: usize, most: usize) -> usize {
    needed.max(most.min(2 * capacity))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_steps_and_no_more_than_the_bound() {
        let mut items: Vec<u16> = Vec::new();
        let mut steps = 0;
        for i in 0..1000 {
            let before = items.capacity();
            reserve_bounded(&mut items, 1, 1000).unwrap();
            steps += u32::from(items.capacity() != before);
            assert!(items.capacity() > usize::from(i) && items.capacity() <= 1000);
            items.push(i);
        }
        assert!(steps <= 11, "{steps}");
    }
}
