//! JSON that is only taken apart where it is changed: everything else stays as it was written, digit by
//! digit.

use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

/// A JSON value of which parts may still be text.
#[derive(Clone, Debug)]
pub enum Json {
    Text(Box<RawValue>),
    /// Members in their order.
    Object(Vec<(String, Json)>),
    Array(Vec<Json>),
}

impl Json {
    /// # Errors
    /// Those of the syntax.
    pub fn parse(text: &str) -> serde_json::Result<Json> {
        Ok(Json::Text(RawValue::from_string(text.to_owned())?))
    }

    pub fn object() -> Json {
        Json::Object(Vec::new())
    }

    pub fn array() -> Json {
        Json::Array(Vec::new())
    }

    /// Takes text apart, one level.
    fn open(&mut self) {
        let Json::Text(raw) = self else {
            return;
        };
        let text = raw.get();
        let opened = match text.as_bytes().first() {
            Some(b'{') => serde_json::from_str(text).ok().map(|Members(members)| {
                let members = members.into_iter();
                Json::Object(members.map(|(key, raw)| (key, Json::Text(raw))).collect())
            }),
            Some(b'[') => serde_json::from_str::<Vec<Box<RawValue>>>(text)
                .ok()
                .map(|items| Json::Array(items.into_iter().map(Json::Text).collect())),
            _ => None,
        };
        if let Some(opened) = opened {
            *self = opened;
        }
    }

    /// The members of an object; `None` for anything else.
    pub fn members(&mut self) -> Option<&mut Vec<(String, Json)>> {
        self.open();
        match self {
            Json::Object(members) => Some(members),
            _ => None,
        }
    }

    /// The items of an array; `None` for anything else.
    pub fn items(&mut self) -> Option<&mut Vec<Json>> {
        self.open();
        match self {
            Json::Array(items) => Some(items),
            _ => None,
        }
    }

    /// A member of an object. Of members with one name the last counts.
    pub fn get(&mut self, key: &str) -> Option<&mut Json> {
        let mut members = self.members()?.iter_mut().rev();
        members
            .find(|(name, _)| name == key)
            .map(|(_, value)| value)
    }

    /// What a chain of keys leads to.
    pub fn path(&mut self, keys: &[&str]) -> Option<&mut Json> {
        keys.iter().try_fold(self, |at, key| at.get(key))
    }

    /// An item of an array.
    pub fn item(&mut self, index: usize) -> Option<&mut Json> {
        self.items()?.get_mut(index)
    }

    /// A member that is an object or an array, as `new` is; it takes the place of what is neither.
    /// `self` becomes an object if it is none.
    pub fn member(&mut self, key: &str, new: Json) -> &mut Json {
        if self.members().is_none() {
            *self = Json::object();
        }
        let is_usable = self.get(key).is_some_and(|value| match new {
            Json::Array(_) => value.items().is_some(),
            _ => value.members().is_some(),
        });
        if !is_usable {
            self.set(key, new);
        }
        match self {
            Json::Object(members) => {
                let at = members.iter().rposition(|(name, _)| name == key);
                &mut members[at.unwrap_or(0)].1
            }
            other => other,
        }
    }

    /// Sets a member of an object, in its place if it is there.
    pub fn set(&mut self, key: &str, value: impl Into<Json>) {
        let value = value.into();
        if let Some(slot) = self.get(key) {
            *slot = value;
        } else if let Some(members) = self.members() {
            members.push((key.to_owned(), value));
        }
    }

    /// Takes a member out of an object.
    pub fn remove(&mut self, key: &str) {
        if let Some(members) = self.members() {
            members.retain(|(name, _)| name != key);
        }
    }

    /// A number that is an index or a count, also when it is written as 4.0.
    pub fn index(&self) -> Option<usize> {
        let Json::Text(raw) = self else {
            return None;
        };
        let number: f64 = raw.get().parse().ok()?;
        (number >= 0.0 && number.fract() == 0.0 && number < 9e15).then_some(number as usize)
    }

    /// A string.
    pub fn string(&self) -> Option<String> {
        match self {
            Json::Text(raw) => serde_json::from_str(raw.get()).ok(),
            _ => None,
        }
    }

    /// Appends the text.
    pub fn write(&self, out: &mut String) {
        match self {
            Json::Text(raw) => out.push_str(raw.get()),
            Json::Object(members) => {
                out.push('{');
                for (i, (key, value)) in members.iter().enumerate() {
                    if i > 0 {
                        out.push(',');
                    }
                    out.push_str(&serde_json::Value::from(&key[..]).to_string());
                    out.push(':');
                    value.write(out);
                }
                out.push('}');
            }
            Json::Array(items) => {
                out.push('[');
                for (i, item) in items.iter().enumerate() {
                    if i > 0 {
                        out.push(',');
                    }
                    item.write(out);
                }
                out.push(']');
            }
        }
    }

    pub fn to_text(&self) -> String {
        let mut text = String::new();
        self.write(&mut text);
        text
    }
}

impl From<serde_json::Value> for Json {
    fn from(value: serde_json::Value) -> Json {
        Json::parse(&value.to_string()).unwrap_or(Json::object())
    }
}

impl From<usize> for Json {
    fn from(number: usize) -> Json {
        serde_json::Value::from(number).into()
    }
}

impl From<&str> for Json {
    fn from(text: &str) -> Json {
        serde_json::Value::from(text).into()
    }
}

/// The members of an object as text, in their order.
struct Members(Vec<(String, Box<RawValue>)>);

impl<'de> Deserialize<'de> for Members {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Members, D::Error> {
        struct Collect;
        impl<'de> Visitor<'de> for Collect {
            type Value = Members;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Members, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(Members(members))
            }
        }
        deserializer.deserialize_map(Collect)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"{"b":1.10e2,"a":[ 0.1000000000000000055 , {"é\u0041": -0.0}],"extras":{"deep":[[null]]},"b":2}"#;

    #[test]
    fn untouched_text_stays() {
        let mut json = Json::parse(TEXT).expect("JSON");
        assert_eq!(json.to_text(), TEXT);
        assert_eq!(json.get("b").and_then(|b| b.index()), Some(2));
        json.set("c", 3usize);
        json.member("new", Json::array())
            .items()
            .expect("a list")
            .push("x\"".into());
        let expected = TEXT.strip_suffix('}').expect("an object").to_owned();
        assert_eq!(json.to_text(), expected + r#","c":3,"new":["x\""]}"#);
    }

    #[test]
    fn members_are_changed_in_place() {
        let mut json = Json::parse(r#"{"a":{"b":[4.0,"t"]},"z":0}"#).expect("JSON");
        let list = json.path(&["a", "b"]).expect("a list");
        assert_eq!(list.item(0).and_then(|n| n.index()), Some(4));
        assert_eq!(list.item(1).and_then(|t| t.string()).as_deref(), Some("t"));
        assert!(list.item(2).is_none());
        json.member("a", Json::object()).set("b", 7usize);
        json.member("z", Json::object()).set("c", 8usize);
        assert_eq!(json.to_text(), r#"{"a":{"b":7},"z":{"c":8}}"#);
        json.remove("a");
        assert_eq!(json.to_text(), r#"{"z":{"c":8}}"#);
    }
}
