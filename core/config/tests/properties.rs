//! No text makes the parsers panic, and written documents read back bit for bit.

use manifactor_config::{Document, Errors, Format, Node, Value};
use proptest::prelude::*;
use serde_json::Value as Json;

fn any_format() -> impl Strategy<Value = Format> {
    prop::sample::select(Format::ALL.to_vec())
}

/// Texts that resemble documents, so that a parser gets further into them than into random texts.
fn any_text() -> impl Strategy<Value = String> {
    let words = [
        "a",
        "b",
        "key",
        "=",
        ":",
        ": ",
        " ",
        "\n",
        "\n  ",
        "\r\n",
        "\t",
        "- ",
        "[",
        "]",
        "[[",
        "]]",
        "{",
        "}",
        ",",
        ".",
        "'",
        "\"",
        "\"\"\"",
        "1",
        "-",
        "0x",
        "1e9",
        "inf",
        "nan",
        ".nan",
        "true",
        "null",
        "~",
        "&a ",
        "*a",
        "!!str ",
        "|",
        ">",
        "#",
        "---",
        "...",
        "?",
        "é",
        "漢",
        "\u{feff}",
        "\\",
        "\\u",
        "//",
        "1979-05-27",
        "\u{85}",
        "\u{2028}",
        "%",
    ];
    let words = prop::collection::vec(prop::sample::select(words.to_vec()), 0..60).prop_map(|w| w.concat());
    prop_oneof![3 => words, 1 => any::<String>(), 1 => "\\PC{0,80}"]
}

fn any_key() -> impl Strategy<Value = String> {
    prop_oneof![
        "[a-z_]{1,8}",
        "\\PC{1,8}",
        Just("true".into()),
        Just("1".into()),
        Just("~".into()),
        Just("a.b".into())
    ]
}

/// Values that are possible in all three formats.
fn any_json() -> impl Strategy<Value = Json> {
    let finite = any::<f64>().prop_filter("finite", |x| x.is_finite());
    let text = prop_oneof![
        "\\PC{0,20}",
        "[ -~\n\t]{0,30}",
        any_key(),
        prop::sample::select(vec![
            "null", "no", "0x1", "1e3", "-", "", " a ", "a\n", "\n", "a: b", "- a", "#", "1_0"
        ])
        .prop_map(str::to_owned),
    ];
    let leaf = prop_oneof![
        any::<bool>().prop_map(Json::from),
        any::<i64>().prop_map(Json::from),
        finite.prop_map(Json::from),
        text.prop_map(Json::from),
    ];
    let value = leaf.prop_recursive(4, 40, 6, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..6).prop_map(Json::from),
            prop::collection::vec((any_key(), inner), 0..6).prop_map(|fields| fields.into_iter().collect()),
        ]
    });
    prop::collection::vec((any_key(), value), 0..6).prop_map(|fields| fields.into_iter().collect())
}

/// Compares bit for bit, independent of the order of fields.
fn same(a: &Json, b: &Json) -> bool {
    match (a, b) {
        (Json::Array(a), Json::Array(b)) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b)),
        (Json::Object(a), Json::Object(b)) => {
            a.len() == b.len() && a.iter().all(|(k, a)| b.get(k).is_some_and(|b| same(a, b)))
        }
        (Json::Number(a), Json::Number(b)) if a.is_f64() => {
            b.is_f64() && a.as_f64().map(f64::to_bits) == b.as_f64().map(f64::to_bits)
        }
        _ => a == b,
    }
}

/// Checks that every position lies within the text, and scalars within their tables.
fn check_places(node: &Node, text: &str) {
    assert!(text.get(node.place.span()).is_some());
    match &node.value {
        Value::Array(items) => items.iter().for_each(|item| check_places(item, text)),
        Value::Table(table) => table.values().for_each(|field| {
            assert!(text.get(field.key.span()).is_some());
            check_places(&field.node, text);
        }),
        _ => {}
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn no_text_makes_a_parser_panic(format in any_format(), text in any_text()) {
        match Document::parse("file", text, format) {
            Ok(document) => {
                check_places(document.root(), document.source().text());
                let errors = Errors::new();
                let _ = document.root().read::<Vec<f64>>(&errors);
                if let Some(mut section) = document.section(&errors) {
                    let _ = section.required::<String>("key");
                    section.finish();
                }
                let _ = errors.finish(Some(())).map_err(|e| e.to_string());
            }
            Err(errors) => prop_assert!(!errors.to_string().is_empty()),
        }
    }

    #[test]
    fn no_override_panics(format in any_format(), text in any_text(), set in any_text()) {
        if let Ok(mut document) = Document::parse("file", text, format) {
            let _ = document.set(&[set.as_str(), &format!("a{set}"), &format!("{set}=1")]).map_err(|e| e.to_string());
        }
    }

    #[test]
    fn what_is_written_reads_back(format in any_format(), value in any_json()) {
        let text = format.write(&value).unwrap();
        let document = Document::parse("file", text.as_str(), format).map_err(|e| TestCaseError::fail(format!("{e}\n{text}")))?;
        let back = match document.root().value {
            Value::Null => Json::Object(Default::default()),
            _ => document.root().to_json().unwrap(),
        };
        prop_assert!(same(&back, &value), "{text}\n{back}");
    }
}
