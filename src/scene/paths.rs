//! Node paths that fit into a stream.

use super::Scene;

/// The most bytes of an instance's name: as many as decoders accept by default for the path of a
/// track (`dapple_codec::Limits::path_bytes`).
pub const MAX_PATH_BYTES: usize = 1024;

/// Shortens the names of instances that are too long for the path of a track, and says so in one
/// warning. Whoever loads the scene again gets the same names.
pub fn shorten_paths(scene: &mut Scene) {
    let mut count = 0;
    for instance in &mut scene.instances {
        if instance.name.len() > MAX_PATH_BYTES {
            instance.name = shortened(&instance.name);
            count += 1;
        }
    }
    if count > 0 {
        scene.warnings.push(format!(
            "{count} node paths are longer than {MAX_PATH_BYTES} bytes; of each the end is kept, after \
             a hash of the whole"
        ));
    }
}

/// A hash of the path, and as much of its end as fits.
fn shortened(path: &str) -> String {
    let hash = format!("{:016x}...", fnv1a(path.as_bytes()));
    let mut start = path.len() - (MAX_PATH_BYTES - hash.len());
    while !path.is_char_boundary(start) {
        start += 1;
    }
    hash + &path[start..]
}

/// FNV-1a of 64 bits.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::Limits;
    use crate::scene::Instance;

    #[test]
    fn long_paths_are_shortened_and_stay_distinct() {
        assert_eq!(MAX_PATH_BYTES, Limits::default().path_bytes as usize);
        let end = "é".repeat(600);
        let names = [
            "short".to_owned(),
            "p".repeat(MAX_PATH_BYTES),
            format!("a/{end}"),
            format!("b/{end}"),
        ];
        let mut scene = Scene::default();
        scene.instances.extend(names.iter().map(|name| Instance {
            name: name.clone(),
            ..Instance::default()
        }));
        shorten_paths(&mut scene);
        let got: Vec<&str> = scene.instances.iter().map(|i| i.name.as_str()).collect();
        assert_eq!(got[..2], names[..2]);
        for (got, name) in got[2..].iter().zip(&names[2..]) {
            assert!((MAX_PATH_BYTES - 1..=MAX_PATH_BYTES).contains(&got.len()));
            assert!(name.ends_with(&got[19..]), "{got}");
        }
        assert_ne!(got[2], got[3]);
        assert_eq!(scene.warnings.len(), 1);
        assert!(scene.warnings[0].starts_with("2 node paths"));
        shorten_paths(&mut scene);
        assert_eq!(scene.warnings.len(), 1);
    }
}
