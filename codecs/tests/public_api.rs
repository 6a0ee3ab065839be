//! The public interface, item by item, against `public-api.txt`, so that a change is seen before a
//! caller's build breaks. `UPDATE=1 cargo test -p dapple-codec --test main public_api` writes the file.
//!
//! The listing is read from the sources, by the rules that this crate keeps: no macros that make
//! items, no glob imports, types named in `impl` without a path. rustdoc's JSON output would need a
//! nightly compiler of one certain month, and a check that is skipped elsewhere is none.

mod api;

use std::collections::BTreeSet;
use std::path::Path;

/// The file's lines that are missing here, and the lines that are new.
fn difference(file: &str, listing: &str) -> String {
    let lines = |text: &str| text.lines().map(String::from).collect::<BTreeSet<_>>();
    let (old, new) = (lines(file), lines(listing));
    let gone = old.difference(&new).map(|line| format!("- {line}\n"));
    gone.chain(new.difference(&old).map(|line| format!("+ {line}\n")))
        .collect()
}

#[test]
fn the_public_interface_is_as_listed() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let file = package.join("public-api.txt");
    let listing = api::listing(&api::read(&package.join("src/lib.rs")));
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&file, &listing).expect("public-api.txt can be written");
        return;
    }
    let listed = std::fs::read_to_string(&file).unwrap_or_default();
    let listed = listed.replace("\r\n", "\n");
    assert!(
        listed == listing,
        "the public interface has changed; if that is meant, run this test with UPDATE=1 and say \
         so in CHANGELOG.md:\n{}",
        difference(&listed, &listing)
    );
}

/// What a user relies on is in the listing, and what nobody can name is not.
#[test]
fn the_listing_follows_names_and_visibility() {
    let items = |text: &str| {
        let file = syn::parse_file(text).expect("Rust");
        api::Crate::from([(String::new(), file.items)])
    };
    let listing = api::listing(&items(
        "mod inner { pub struct Seen { pub a: u32, b: u8 } pub struct Hidden;
             impl Seen { pub fn f(&mut self, x: &[u8]) -> Option<(u8, Seen)> { None } fn g() {} }
             impl Drop for Seen { fn drop(&mut self) {} }
             impl Hidden { pub fn h() {} } }
         pub mod open { pub use super::inner::Seen as Other; pub const N: usize = 3; }
         pub use inner::Seen;
         #[derive(Debug, Clone)] #[non_exhaustive] pub enum E { A(u8), B { c: u8 } }",
    ));
    let expected = "\
dapple_codec::E: #[derive(Clone)]
dapple_codec::E: #[derive(Debug)]
dapple_codec::E: #[non_exhaustive] pub enum E
dapple_codec::E: variant A(u8)
dapple_codec::E: variant B { c: u8 }
dapple_codec::Seen: impl Drop for Seen
dapple_codec::Seen: pub a: u32
dapple_codec::Seen: pub fn f(&mut self, x: &[u8]) -> Option<(u8, Seen)>
dapple_codec::Seen: pub struct Seen, with private fields
dapple_codec::open: pub mod open
dapple_codec::open::N: pub const N: usize = 3
dapple_codec::open::Other: impl Drop for Seen
dapple_codec::open::Other: pub a: u32
dapple_codec::open::Other: pub fn f(&mut self, x: &[u8]) -> Option<(u8, Seen)>
dapple_codec::open::Other: pub struct Seen, with private fields
";
    assert_eq!(listing, expected, "{}", difference(expected, &listing));
}

/// Traits that no source line names: whether a decoder can go to another thread.
#[test]
fn decoder_and_encoder_go_to_other_threads() {
    fn check<T: Send + Sync + Unpin + 'static>() {}
    check::<dapple_codec::Decoder>();
    check::<dapple_codec::Encoder>();
    check::<dapple_codec::Error>();
    check::<dapple_codec::Event>();
    check::<dapple_codec::LiveTrack>();
    check::<dapple_codec::StateDigest>();
    check::<dapple_codec::Track>();
    check::<dapple_codec::points::State>();
    check::<dapple_codec::points::Hasher>();
    check::<dapple_codec::probes::State>();
}
