//! A sort that is short in code: the standard library's are a tenth of what a browser would load.

/// Sorts by a key. Takes `n log n` steps whatever the order, and no memory (heapsort). Equal items may change
/// places.
pub(crate) fn sort_by_key<T, K: Ord>(items: &mut [T], key: impl Fn(&T) -> K) {
    // A heap: no item is larger than the one above it.
    for top in (0..items.len() / 2).rev() {
        sift(items, top, &key);
    }
    for end in (1..items.len()).rev() {
        items.swap(0, end);
        sift(&mut items[..end], 0, &key);
    }
}

/// Moves an item down to where neither below it is larger.
fn sift<T, K: Ord>(items: &mut [T], mut at: usize, key: &impl Fn(&T) -> K) {
    loop {
        let mut below = 2 * at + 1;
        if below + 1 < items.len() && key(&items[below]) < key(&items[below + 1]) {
            below += 1;
        }
        if below >= items.len() || key(&items[at]) >= key(&items[below]) {
            return;
        }
        items.swap(at, below);
        at = below;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    #[test]
    fn lists_of_every_length_are_sorted() {
        for count in 0..200u32 {
            for seed in [0, 1, 7, 1 << 31] {
                let number = |i: u32| (i ^ seed).wrapping_mul(2_654_435_761) >> 25;
                let mut items: Vec<u32> = (0..count).map(number).collect();
                let mut expected = items.clone();
                expected.sort_unstable();
                sort_by_key(&mut items, |&item| item);
                assert_eq!(items, expected);
            }
        }
    }
}
