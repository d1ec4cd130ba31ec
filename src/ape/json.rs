//! Files in JSON, read by people's rules: a name stands once, and what is wrong has a place.

use std::fmt;

use serde::Deserialize;
use serde::de::{DeserializeOwned, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};

/// Reads any text; the error says in which line and column it ends to be JSON, or which name stands there twice.
pub fn parse(text: &str) -> Result<Value, String> {
    let once: Once = serde_json::from_str(text).map_err(|error| quoted(&error))?;
    Ok(once.0)
}

/// Makes what it stands for of the value of the field `name`, or of a whole file where that is empty; the error says at
/// which field within it goes wrong.
pub fn read<T: DeserializeOwned>(name: &str, value: Value) -> Result<T, String> {
    serde_path_to_error::deserialize(value).map_err(|error| {
        let path = match error.path().to_string() {
            whole if whole == "." => name.to_owned(),
            inner if name.is_empty() || inner.starts_with('[') => format!("{name}{inner}"),
            inner => format!("{name}.{inner}"),
        };
        let sentence = error.into_inner();
        quoted(&if path.is_empty() { sentence.to_string() } else { format!("{path}: {sentence}") })
    })
}

/// As much as a sentence can take of what is, or quotes, a part of a file.
pub fn quoted(text: &impl ToString) -> String {
    const MOST: usize = 300;
    let text = text.to_string();
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

/// A value in whose objects every name stands once: serde_json takes the last of several.
struct Once(Value);

impl<'de> Deserialize<'de> for Once {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Once, D::Error> {
        deserializer.deserialize_any(Reader)
    }
}

struct Reader;

impl<'de> Visitor<'de> for Reader {
    type Value = Once;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_unit<E>(self) -> Result<Once, E> {
        Ok(Once(Value::Null))
    }

    fn visit_bool<E>(self, value: bool) -> Result<Once, E> {
        Ok(Once(value.into()))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Once, E> {
        Ok(Once(value.into()))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Once, E> {
        Ok(Once(value.into()))
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Once, E> {
        let number = Number::from_f64(value).ok_or_else(|| E::custom("expected a finite number"))?;
        Ok(Once(number.into()))
    }

    fn visit_str<E>(self, value: &str) -> Result<Once, E> {
        Ok(Once(value.into()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<Once, A::Error> {
        let mut array = Vec::new();
        while let Some(Once(value)) = entries.next_element()? {
            array.push(value);
        }
        Ok(Once(array.into()))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Once, A::Error> {
        let mut object = Map::new();
        while let Some(name) = entries.next_key::<String>()? {
            if object.contains_key(&name) {
                return Err(A::Error::custom(format_args!("{:?} stands there twice", quoted(&name))));
            }
            let Once(value) = entries.next_value()?;
            object.insert(name, value);
        }
        Ok(Once(object.into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_is_what_serde_json_reads() {
        let text = r#"{"a": [null, true, -3, 18446744073709551615, 0.1, 1e300, "ü\n"], "b": {"a": {}, "c": []}}"#;
        assert_eq!(parse(text).unwrap(), serde_json::from_str::<Value>(text).unwrap());
    }

    #[test]
    fn what_is_wrong_has_a_place() {
        assert_eq!(
            parse(r#"{"a": 1, "b": {"c": 1, "c": 2}}"#).unwrap_err(),
            "\"c\" stands there twice at line 1 column 26"
        );
        assert_eq!(parse("[1,\n2,]").unwrap_err(), "trailing comma at line 2 column 3");
        let wrong = || parse(r#"{"a": [[1, 2], [3, "x"]]}"#).unwrap();
        let error = |name| read::<std::collections::BTreeMap<String, Vec<[f64; 2]>>>(name, wrong()).unwrap_err();
        let sentence = "invalid type: string \"x\", expected f64";
        assert_eq!([error(""), error("b")], [format!("a[1][1]: {sentence}"), format!("b.a[1][1]: {sentence}")]);
        let error = |name| read::<u32>(name, Value::Null).unwrap_err();
        assert_eq!([error(""), error("b")], ["", "b: "].map(|at| format!("{at}invalid type: null, expected u32")));
    }
}
