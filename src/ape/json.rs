//! Files in JSON, read by people's rules: a name stands once, and what is wrong has a place.

use std::cell::Cell;
use std::fmt;

use serde::de::{DeserializeOwned, DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};

/// Most values in a text, counted with those within others: four times what the largest ensemble has. Each takes far
/// more memory than its text.
const MOST_VALUES: u32 = 200_000;

/// Reads any text, with a byte order mark or without; the error says in which line and column it ends to be JSON, or which
/// name stands there twice.
pub fn parse(text: &str) -> Result<Value, String> {
    let mut deserializer = serde_json::Deserializer::from_str(without_mark(text));
    let value = Reader { left: &Cell::new(MOST_VALUES) }.deserialize(&mut deserializer);
    value.and_then(|value| deserializer.end().map(|()| value)).map_err(|error| quoted(&error))
}

/// The text behind the mark that some programs put before UTF-8.
pub fn without_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
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

/// Makes a value in whose objects every name stands once: serde_json takes the last of several.
#[derive(Clone, Copy)]
struct Reader<'a> {
    /// Values that may still come.
    left: &'a Cell<u32>,
}

impl<'de> DeserializeSeed<'de> for Reader<'_> {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        let Some(left) = self.left.get().checked_sub(1) else {
            return Err(D::Error::custom(format_args!("more than {MOST_VALUES} values")));
        };
        self.left.set(left);
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Reader<'_> {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Value, E> {
        let number = Number::from_f64(value).ok_or_else(|| E::custom("expected a finite number"))?;
        Ok(number.into())
    }

    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut array = Vec::new();
        while let Some(value) = entries.next_element_seed(self)? {
            array.push(value);
        }
        Ok(array.into())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some(name) = entries.next_key::<String>()? {
            if object.contains_key(&name) {
                return Err(A::Error::custom(format_args!("{:?} stands there twice", quoted(&name))));
            }
            object.insert(name, entries.next_value_seed(self)?);
        }
        Ok(object.into())
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
    fn a_mark_is_passed_over_and_too_many_values_are_refused() {
        assert_eq!(parse("\u{feff}[1]").unwrap(), parse("[1]").unwrap());
        let values = |count: u32| format!("[{}0]", "0,".repeat(count as usize - 2));
        assert!(parse(&values(MOST_VALUES)).is_ok());
        let error = parse(&values(MOST_VALUES + 1)).unwrap_err();
        assert!(error.starts_with("more than 200000 values at line 1 column "), "{error}");
        assert_eq!(parse("[1] 2").unwrap_err(), "trailing characters at line 1 column 5");
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
