//! The committed header is what cbindgen makes of the sources. `UPDATE_HEADER=1 cargo test -p dapple-c header`
//! writes it.

use std::fs;
use std::path::Path;

#[test]
fn the_header_is_that_of_the_sources() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).expect("cbindgen.toml");
    let builder = cbindgen::Builder::new().with_config(config);
    let builder = builder.with_src(folder.join("src/lib.rs"));
    let mut header = Vec::new();
    builder.generate().expect("a header").write(&mut header);
    let header = String::from_utf8(header).expect("text");
    let path = folder.join("include/dapple.h");
    if std::env::var_os("UPDATE_HEADER").is_some() {
        fs::write(&path, &header).expect("the header");
    }
    let committed = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == header,
        "include/dapple.h is not that of src/: UPDATE_HEADER=1 cargo test -p dapple-c header"
    );
}
