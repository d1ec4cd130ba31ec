#![cfg(not(target_arch = "wasm32"))]
//! `ape evaluate` against figures computed by independent code (tests/reference), key by key.

use std::process::Command;

use serde_json::Value;

/// Every number of `expected` stands in `found` under the same keys, to 1e−7 (uncapped: 1e−5) relative.
fn compare(expected: &Value, found: &Value, path: &str) -> usize {
    match expected {
        Value::Object(fields) => fields.iter().map(|(k, v)| compare(v, &found[k], &format!("{path}/{k}"))).sum(),
        Value::Array(items) => {
            assert_eq!(items.len(), found.as_array().map_or(0, Vec::len), "{path}");
            items.iter().enumerate().map(|(i, v)| compare(v, &found[i], &format!("{path}/{i}"))).sum()
        }
        _ => {
            let (expected, found) = (expected.as_f64().unwrap(), found.as_f64().unwrap_or(f64::NAN));
            let tolerance = if path.ends_with("uncapped_return") { 1e-5 } else { 1e-7 };
            let is_close = (expected - found).abs() <= tolerance * expected.abs();
            assert!(is_close, "{path}: {found} instead of {expected}");
            1
        }
    }
}

#[test]
fn ape_evaluate_agrees_with_every_case() {
    let mut cases = 0;
    for entry in std::fs::read_dir("tests/reference").unwrap() {
        let case: Value = serde_json::from_str(&std::fs::read_to_string(entry.unwrap().path()).unwrap()).unwrap();
        let file = format!("{}/case{cases}.json", env!("CARGO_TARGET_TMPDIR"));
        std::fs::write(&file, case["policy"].to_string()).unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_ape")).args(["evaluate", &file]).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let found: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(compare(&case["figures"], &found, "") >= 20);
        cases += 1;
    }
    assert!(cases >= 4);
}
