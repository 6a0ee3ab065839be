//! A stream in the file of its scene: the extension `DAPPLE_stream` (`spec/gltf.md`).

use super::document::Document;
use super::json::Json;
use crate::scene::{GltfFile as File, STREAM_EXTENSION};
use serde_json::json;
use std::collections::BTreeMap;

/// Ids of the tracks of each node of a file.
pub type TracksOfNodes = BTreeMap<usize, Vec<u32>>;

/// Where a stream goes.
#[derive(Clone, Debug, Default)]
pub struct Attached<'a> {
    /// All bytes of the stream.
    pub stream: &'a [u8],
    pub tracks: TracksOfNodes,
}

/// A copy of a file with a stream in it.
///
/// # Errors
/// A sentence for a file that cannot be read or has a stream already.
pub fn attach(file: &File, attached: &Attached<'_>) -> Result<Document, String> {
    let mut document = Document::new(file)?;
    let extension = document.root().path(&["extensions", STREAM_EXTENSION]);
    if extension.is_some() {
        return Err("it has a stream already; attach another to the file without it".to_owned());
    }
    let view = document.push_view(attached.stream, json!({}));
    set_extension(document.root(), json!({ "bufferView": view }));
    for (&node, tracks) in &attached.tracks {
        if let Some(node) = document.element("nodes", node) {
            set_extension(node, json!({ "tracks": tracks }));
        }
    }
    let used = document.root().member("extensionsUsed", Json::array());
    if let Some(names) = used.items() {
        names.push(json!(STREAM_EXTENSION).into());
    }
    Ok(document)
}

fn set_extension(element: &mut Json, extension: serde_json::Value) {
    let extensions = element.member("extensions", Json::object());
    extensions.set(STREAM_EXTENSION, extension);
}

#[cfg(test)]
mod tests {
    use super::super::tests::{glb, square, without_changes};
    use super::*;
    use crate::scene::{GltfFile, LoadOptions, Scene};
    use serde_json::Value;

    const STREAM: &[u8] = b"a stream of odd length.";

    fn attached() -> (Value, Vec<u8>) {
        let (document, data) = square();
        let bytes = glb(&document, &data);
        let options = LoadOptions::default();
        let file = GltfFile::open(&bytes, None, &options).expect("a file");
        assert_eq!(file.stream(), Ok(None));
        let tracks = BTreeMap::from([(0, vec![4, 5]), (1, vec![9])]);
        let stream = STREAM;
        let copy = attach(&file, &Attached { stream, tracks }).expect("attached");
        (document, copy.to_glb().expect("a binary file"))
    }

    #[test]
    fn stream_is_read_back_and_the_rest_stays() {
        let (document, bytes) = attached();
        let options = LoadOptions::default();
        let file = GltfFile::open(&bytes, None, &options).expect("a file");
        assert_eq!(file.stream().expect("read").as_deref(), Some(STREAM));
        let (text, _) = file.chunks().expect("chunks");
        let mut copy: Value = serde_json::from_str(&text).expect("JSON");
        let of = |value: &Value| value["extensions"][STREAM_EXTENSION]["tracks"].clone();
        assert_eq!(of(&copy["nodes"][0]), json!([4, 5]));
        assert_eq!(of(&copy["nodes"][1]), json!([9]));
        assert_eq!(of(&copy["nodes"][2]), Value::Null);
        let used = copy["extensionsUsed"].as_array_mut().expect("names");
        assert_eq!(used.pop(), Some(STREAM_EXTENSION.into()));
        for element in [0, 1].map(|node| format!("/nodes/{node}")) {
            let node = copy.pointer_mut(&element).expect("a node");
            node.as_object_mut().expect("a node").remove("extensions");
        }
        let extensions = copy["extensions"].as_object_mut().expect("extensions");
        extensions.remove(STREAM_EXTENSION);
        assert_eq!(without_changes(&copy), without_changes(&document));
        let scene = Scene::from_bytes("a copy", &bytes, None).expect("a scene");
        let names = scene
            .warnings
            .iter()
            .filter(|w| w.contains(STREAM_EXTENSION));
        assert_eq!(names.count(), 0, "{:?}", scene.warnings);
    }

    #[test]
    fn second_stream_is_refused() {
        let (_, bytes) = attached();
        let options = LoadOptions::default();
        let file = GltfFile::open(&bytes, None, &options).expect("a file");
        let error = attach(&file, &Attached::default()).err();
        assert!(error.is_some_and(|e| e.contains("a stream already")));
    }

    #[test]
    fn wrong_extensions_are_one_sentence() {
        let (mut document, data) = square();
        for (extension, sentence) in [
            (json!({}), "neither a buffer view nor a URI"),
            (json!({"bufferView": 0, "uri": "a"}), "or both"),
            (json!({"bufferView": -1}), "is no index"),
            (json!({"bufferView": 99}), "buffer view"),
            (json!({"uri": "data:,"}), "is not base64"),
            (json!({"uri": 7}), "neither a buffer view nor a URI"),
        ] {
            document["extensions"][STREAM_EXTENSION] = extension;
            let bytes = glb(&document, &data);
            let options = LoadOptions::default();
            let file = GltfFile::open(&bytes, None, &options).expect("a file");
            let error = file.stream().expect_err("refused");
            assert!(error.contains(sentence), "{error}");
        }
        document["extensions"][STREAM_EXTENSION] = json!({"uri": "data:;base64,YWJj"});
        let bytes = glb(&document, &data);
        let options = LoadOptions::default();
        let file = GltfFile::open(&bytes, None, &options).expect("a file");
        assert_eq!(file.stream().expect("read").as_deref(), Some(&b"abc"[..]));
    }
}
