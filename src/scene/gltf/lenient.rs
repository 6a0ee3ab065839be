//! Brings a file's JSON into the form that the `gltf` crate's types accept.
//!
//! Those types refuse a whole file for one field. Here each element of the file's arrays is checked
//! alone: a required field that is absent gets a value that names nothing, and a field of a wrong
//! type is left out with a warning.

use super::{Read, shorten};
use ::gltf::json;
use json::Value;
use json::deserialize::from_value;

/// Objects with more fields than this are not examined field by field.
const MAX_FIELDS: usize = 64;

/// The elements of one array.
struct Kind {
    key: &'static str,
    /// How messages call an element.
    noun: &'static str,
    /// Required fields that name nothing. The largest index marks one that is absent.
    absent: &'static str,
    accepts: fn(Value) -> bool,
    /// Arrays within an element.
    nested: &'static [Kind],
}

macro_rules! kind {
    ($key:literal, $noun:literal, $type:ty, $absent:literal $(, $nested:expr)?) => {
        Kind {
            key: $key,
            noun: $noun,
            absent: $absent,
            accepts: |value| from_value::<$type>(value).is_ok(),
            nested: kind!(@nested $($nested)?),
        }
    };
    (@nested) => { &[] };
    (@nested $nested:expr) => { $nested };
}

const KINDS: [Kind; 13] = [
    kind!(
        "accessors",
        "accessor",
        json::Accessor,
        r#"{"componentType":0,"type":"","count":0}"#
    ),
    kind!(
        "animations",
        "animation",
        json::Animation,
        r#"{"channels":[],"samplers":[]}"#,
        &[
            kind!(
                "channels",
                "channel",
                json::animation::Channel,
                r#"{"sampler":4294967295,"target":{"node":4294967295,"path":""}}"#
            ),
            kind!(
                "samplers",
                "sampler",
                json::animation::Sampler,
                r#"{"input":4294967295,"output":4294967295}"#
            ),
        ]
    ),
    kind!("buffers", "buffer", json::Buffer, r#"{"byteLength":0}"#),
    kind!(
        "bufferViews",
        "buffer view",
        json::buffer::View,
        r#"{"buffer":4294967295,"byteLength":0}"#
    ),
    kind!("cameras", "camera", json::Camera, r#"{"type":""}"#),
    kind!("images", "image", json::Image, "{}"),
    kind!("materials", "material", json::Material, "{}"),
    kind!(
        "meshes",
        "mesh",
        json::Mesh,
        r#"{"primitives":[]}"#,
        &[kind!(
            "primitives",
            "primitive",
            json::mesh::Primitive,
            r#"{"attributes":{}}"#
        )]
    ),
    kind!("nodes", "node", json::Node, "{}"),
    kind!("samplers", "sampler", json::texture::Sampler, "{}"),
    kind!("scenes", "scene", json::Scene, r#"{"nodes":[]}"#),
    kind!("skins", "skin", json::Skin, r#"{"joints":[]}"#),
    kind!("textures", "texture", json::Texture, "{}"),
];

const LIGHTS: Kind = kind!(
    "lights",
    "light",
    json::extensions::scene::khr_lights_punctual::Light,
    r#"{"type":""}"#
);

/// Reads the JSON of a file. `warn` is told what was left out.
pub(super) fn read(text: &[u8], warn: &dyn Fn(String)) -> Read<json::Root> {
    // Names in other encodings than UTF-8 cost their letters, not the scene.
    let text = String::from_utf8_lossy(text);
    let failed = |e: json::Error| format!("its JSON cannot be read: {e}");
    let mut root: Value = json::deserialize::from_str(&text).map_err(failed)?;
    clean(&mut root);
    let Some(fields) = root.as_object_mut() else {
        return Err("its JSON is not an object".to_owned());
    };
    let version = match fields.get("asset").and_then(|a| a.get("version")) {
        Some(Value::String(version)) => version.clone(),
        Some(Value::Number(version)) => format!("{version}.0"),
        _ => {
            warn("its asset names no version of glTF; it was read as 2.0".to_owned());
            "2.0".to_owned()
        }
    };
    let asset = [("version".to_owned(), Value::from(version))];
    fields.insert("asset".to_owned(), asset.into_iter().collect());
    if let Ok(root) = from_value(root.clone()) {
        return Ok(root);
    }
    fit_fields(&mut root, warn);
    from_value(root).map_err(failed)
}

/// Removes what says nothing (null, and `extras` without a word on foliage), and writes whole numbers such as `4.0` as integers.
fn clean(value: &mut Value) {
    match value {
        Value::Object(fields) => {
            fields.retain(|key, value| {
                let is_known = key != "extras" || value.get("foliage").is_some();
                is_known && !value.is_null()
            });
            fields.values_mut().for_each(clean);
        }
        Value::Array(items) => items.iter_mut().for_each(clean),
        Value::Number(number) => {
            // Integers of this size are exact in double precision; -0.0 stays a float.
            let whole = number
                .as_f64()
                .filter(|v| number.is_f64() && v.fract() == 0.0 && v.abs() < 9e15);
            if let Some(whole) = whole.filter(|v| v.is_sign_positive() || *v != 0.0) {
                *value = Value::from(whole as i64);
            }
        }
        _ => {}
    }
}

/// Makes every field of the root acceptable.
fn fit_fields(root: &mut Value, warn: &dyn Fn(String)) {
    let Some(fields) = root.as_object_mut() else {
        return;
    };
    let mut leave_out = |key: &str, is_right: fn(&Value) -> bool| {
        if fields.get(key).is_some_and(|value| !is_right(value)) {
            warn(format!("{key} is not valid and was left out"));
            fields.remove(key);
        }
    };
    leave_out("scene", |v| v.as_u64().is_some_and(|n| n < u32::MAX.into()));
    leave_out("extensions", Value::is_object);
    for key in ["extensionsUsed", "extensionsRequired"] {
        let is_names = |v: &Value| v.as_array().is_some_and(|a| a.iter().all(Value::is_string));
        leave_out(key, is_names);
    }
    if let Some(extensions) = root.get_mut("extensions").and_then(Value::as_object_mut)
        && let Some(lights) = extensions.get_mut("KHR_lights_punctual")
    {
        if !lights.is_object() {
            *lights = parse("{}");
        }
        fit_array(lights, &LIGHTS, "", warn);
        if lights.get("lights").is_none() {
            lights["lights"] = parse("[]");
        }
    }
    for kind in &KINDS {
        fit_array(root, kind, "", warn);
    }
}

fn parse(text: &str) -> Value {
    json::deserialize::from_str(text).unwrap_or_default()
}

/// Makes the elements of one array of `parent` acceptable; `of` names the parent in messages.
fn fit_array(parent: &mut Value, kind: &Kind, of: &str, warn: &dyn Fn(String)) {
    let Some(array) = parent.get_mut(kind.key) else {
        return;
    };
    let Some(items) = array.as_array_mut() else {
        warn(format!("{}{of} is not a list and was left out", kind.key));
        *array = parse("[]");
        return;
    };
    for (i, item) in items.iter_mut().enumerate() {
        if (kind.accepts)(item.clone()) {
            continue;
        }
        let what = format!("{} {i}{of}", kind.noun);
        for nested in kind.nested {
            fit_array(item, nested, &format!(" of {what}"), warn);
        }
        let mut trial = parse(kind.absent);
        let wanted = std::mem::take(item);
        fit(&mut trial, "", wanted, kind, &|path| {
            let field = path.trim_start_matches('/').replace('/', ".");
            let place = match field.as_str() {
                "" => what.clone(),
                field => format!("{} of {what}", shorten(field, 64)),
            };
            warn(format!("{place} is not valid and was left out"));
        });
        *item = trial;
    }
}

/// Puts `wanted` where `at` points to in `trial`, less the fields with which the element would not
/// be accepted. `lost` is told their paths.
fn fit(trial: &mut Value, at: &str, wanted: Value, kind: &Kind, lost: &dyn Fn(&str)) {
    let Some(slot) = trial.pointer_mut(at) else {
        return lost(at);
    };
    let before = std::mem::replace(slot, wanted.clone());
    if (kind.accepts)(trial.clone()) {
        return;
    }
    let set = |trial: &mut Value, value| {
        if let Some(slot) = trial.pointer_mut(at) {
            *slot = value;
        }
    };
    match wanted {
        Value::Object(fields) if fields.len() <= MAX_FIELDS => {
            let base = if before.is_object() {
                before
            } else {
                parse("{}")
            };
            set(trial, base);
            if !(kind.accepts)(trial.clone()) {
                // It has required fields of its own: one of the others may be what is wrong.
                for key in fields.keys() {
                    let mut fewer = fields.clone();
                    fewer.remove(key);
                    set(trial, Value::Object(fewer));
                    if (kind.accepts)(trial.clone()) {
                        return lost(&format!("{at}/{key}"));
                    }
                }
                set(trial, Value::Null);
                return lost(at);
            }
            for (key, value) in fields {
                let Some(object) = trial.pointer_mut(at).and_then(Value::as_object_mut) else {
                    continue;
                };
                let default = object.get(&key).cloned();
                object.entry(key.clone()).or_insert(Value::Null);
                let path = format!("{at}/{}", key.replace('~', "~0").replace('/', "~1"));
                fit(trial, &path, value, kind, lost);
                if !(kind.accepts)(trial.clone())
                    && let Some(object) = trial.pointer_mut(at).and_then(Value::as_object_mut)
                {
                    match default {
                        Some(default) => object.insert(key, default),
                        None => object.remove(&key),
                    };
                }
            }
        }
        // Lists whose order means nothing.
        Value::Array(items) if at == "/children" || at == "/nodes" => {
            let is_index = |v: &Value| v.as_u64().is_some_and(|n| n < u32::MAX.into());
            let (kept, wrong): (Vec<_>, Vec<_>) = items.into_iter().partition(is_index);
            for _ in wrong {
                lost(at);
            }
            set(trial, Value::Array(kept));
        }
        _ => {
            lost(at);
            set(trial, before);
        }
    }
}
