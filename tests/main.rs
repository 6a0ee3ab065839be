//! Tests of the whole program and of its parts together, in one binary: linking costs more than
//! most of them.

#[cfg(feature = "encode")]
mod tiny;

#[cfg(feature = "cli")]
mod attach;
#[cfg(feature = "cli")]
mod bake;
#[cfg(feature = "cli")]
mod browser;
#[cfg(feature = "cli")]
mod cli;
#[cfg(feature = "cli")]
mod conformance;
#[cfg(feature = "cli")]
mod demo;
#[cfg(feature = "cli")]
mod embed_shaders;
#[cfg(feature = "render")]
mod instances_queries;
#[cfg(feature = "cli")]
mod outputs;
#[cfg(feature = "encode")]
mod points;
#[cfg(feature = "encode")]
mod points_placing;
#[cfg(feature = "encode")]
mod probes;
#[cfg(feature = "render")]
mod probes_client;
#[cfg(feature = "render")]
mod probes_queries;
#[cfg(feature = "render")]
mod queries;
#[cfg(feature = "render")]
mod regions_queries;
#[cfg(feature = "cli")]
mod shaders;
#[cfg(feature = "cli")]
mod stability;
#[cfg(feature = "cli")]
mod streams;
#[cfg(feature = "render")]
mod vertices_queries;

/// A file that no `main.rs` names would not run.
#[test]
fn every_file_of_tests_is_a_module() {
    let own_binaries = ["main", "memory", "vectors"];
    for folder in ["tests", "codecs/tests", "conformance/tests"] {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        let main = std::fs::read_to_string(folder.join("main.rs")).expect("main.rs");
        let mut files = 0;
        for entry in folder.read_dir().expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path.file_stem().expect("a name").to_string_lossy();
            if path.extension().is_some_and(|e| e == "rs") && !own_binaries.contains(&&*name) {
                assert!(
                    main.contains(&format!("\nmod {name};\n")),
                    "{} is not a module of main.rs",
                    path.display()
                );
                files += 1;
            }
        }
        assert!(files > 0);
    }
}
