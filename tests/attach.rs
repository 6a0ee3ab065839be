//! `dapple attach` as a whole: a stream in the file of its scene, and commands that read it there.

use crate::bake::{folder, refuses, runs};

#[test]
fn attached_stream_is_that_of_its_file() {
    let folder = folder();
    let folder = folder.path();
    runs(folder, "bake a.gltf -o a.dapple --samples 16 --rays 64");
    let stream = std::fs::read(folder.join("a.dapple")).expect("a stream");
    for copy in ["lit.glb", "lit.gltf"] {
        let said = runs(folder, &format!("attach a.gltf a.dapple -o {copy}"));
        assert!(
            said.replace('\u{2009}', "")
                .contains(&format!("{} of them the stream", stream.len())),
            "{said}"
        );
        for command in ["validate", "decode --dump", "inspect"] {
            let of_file = runs(folder, &format!("{command} a.dapple"));
            let of_copy = runs(folder, &format!("{command} {copy}"));
            assert_eq!(of_copy.replace(copy, "a.dapple"), of_file);
        }
    }
    // A scene with its stream needs no second file.
    runs(
        folder,
        "render a.dapple --scene a.gltf -o apart.png --size 32x18",
    );
    runs(
        folder,
        "render --scene lit.glb -o together.png --size 32x18",
    );
    let picture = |name| std::fs::read(folder.join(name)).expect("a picture");
    assert!(picture("apart.png") == picture("together.png"));
}

#[test]
fn streams_that_do_not_fit_are_refused() {
    let folder = folder();
    let folder = folder.path();
    runs(folder, "bake a.gltf -o a.dapple --samples 16 --rays 64");
    let stream = std::fs::read(folder.join("a.dapple")).expect("a stream");
    std::fs::write(folder.join("cut.dapple"), &stream[..stream.len() - 8]).expect("written");
    runs(folder, "attach a.gltf a.dapple -o lit.glb");
    for (code, line, sentence) in [
        (1, "attach a.gltf cut.dapple -o b.glb", "cut.dapple"),
        (
            1,
            "attach lit.glb a.dapple -o b.glb",
            "it has a stream already",
        ),
        (
            1,
            "attach a.gltf a.gltf -o b.glb",
            "a scene without a stream",
        ),
        (
            2,
            "attach a.gltf a.dapple -o b.png",
            "ends with .glb or .gltf",
        ),
        (
            2,
            "attach hall a.dapple -o b.glb",
            "the built-in scene is no glTF file",
        ),
        (2, "attach a.gltf a.dapple -o a.gltf", "a.gltf"),
        (1, "inspect a.gltf", "a scene without a stream"),
        (2, "render --scene a.gltf -o b.png", "name a stream"),
    ] {
        refuses(folder, line, code, sentence);
        assert!(!folder.join("b.glb").exists(), "{line}");
    }
}
