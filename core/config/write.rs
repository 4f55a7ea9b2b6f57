//! Writing of documents. Reading them restores all values bit for bit.
use crate::format::Format;
use ::toml::Value;
use manifactor_graph::Key;
use serde::Serialize;

/// Error of writing a document.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// A number that is infinite or NaN, which documents cannot contain.
    #[error("`{path}` is {value}: documents hold finite numbers only")]
    NotFinite {
        /// Path within the value.
        path: String,
        /// The number.
        value: f64,
    },
    /// A graph with a fixed or bounded variable that has no value.
    #[error("the graph fixes or bounds `{key}`, but there is no value for it")]
    MissingValue {
        /// The variable.
        key: Key,
    },
    /// A value that is not possible in all formats: null in an array, integers beyond 64 bits, or keys that
    /// are not strings.
    #[error("cannot be written as {format}: {message}")]
    Inexpressible {
        /// The format.
        format: Format,
        /// Message of the serializer.
        message: String,
    },
}

/// Writes a value as TOML.
///
/// # Errors
/// If a number is not finite, or TOML cannot represent the value.
pub fn to_toml(value: &impl Serialize) -> Result<String, WriteError> {
    Format::Toml.write(value)
}

/// Writes a value as indented JSON.
///
/// # Errors
/// If a number is not finite, or TOML cannot represent the value. The limits of TOML apply to all formats, so
/// that every format holds the same documents.
pub fn to_json(value: &impl Serialize) -> Result<String, WriteError> {
    Format::Json.write(value)
}

/// Writes a value as YAML.
///
/// # Errors
/// If a number is not finite, or TOML cannot represent the value. The limits of TOML apply to all formats, so
/// that every format holds the same documents.
pub fn to_yaml(value: &impl Serialize) -> Result<String, WriteError> {
    Format::Yaml.write(value)
}

impl Format {
    /// Writes a value in this format.
    ///
    /// # Errors
    /// If a number is not finite, or TOML cannot represent the value. The limits of TOML apply to all formats,
    /// so that every format holds the same documents.
    pub fn write(self, value: &impl Serialize) -> Result<String, WriteError> {
        let value = tree(self, value)?;
        let text = match self {
            Format::Toml => ::toml::to_string(&value).map_err(|e| e.to_string()),
            Format::Json => serde_json::to_string_pretty(&value).map(|t| t + "\n").map_err(|e| e.to_string()),
            Format::Yaml => serde_saphyr::to_string(&value).map_err(|e| e.to_string()),
        };
        text.map_err(|message| WriteError::Inexpressible { format: self, message })
    }
}

/// Converts a value to a tree of finite numbers.
pub(crate) fn tree(format: Format, value: &impl Serialize) -> Result<Value, WriteError> {
    let value = Value::try_from(value)
        .map_err(|error| WriteError::Inexpressible { format, message: error.to_string() })?;
    match not_finite(&value) {
        Some((path, value)) => Err(WriteError::NotFinite { path, value }),
        None => Ok(value),
    }
}

fn not_finite(value: &Value) -> Option<(String, f64)> {
    let join = |at: String, (path, value): (String, f64)| match path.as_str() {
        "" => (at, value),
        _ if path.starts_with('[') => (at + &path, value),
        _ => (at + "." + &path, value),
    };
    match value {
        Value::Float(value) if !value.is_finite() => Some((String::new(), *value)),
        Value::Array(items) => {
            let mut items = items.iter().enumerate();
            items.find_map(|(i, item)| Some(join(format!("[{i}]"), not_finite(item)?)))
        }
        Value::Table(table) => {
            table.iter().find_map(|(key, value)| Some(join(key.clone(), not_finite(value)?)))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize)]
    struct Metrics {
        ate: Vec<f64>,
        note: Option<String>,
    }

    #[test]
    fn what_is_not_finite_is_refused_with_its_path() {
        let metrics = Metrics { ate: vec![0.5, f64::NAN], note: None };
        for format in Format::ALL {
            let error = format.write(&metrics).unwrap_err();
            assert_eq!(error.to_string(), "`ate[1]` is NaN: documents hold finite numbers only");
        }
    }

    #[test]
    fn absent_options_are_left_out() {
        let metrics = Metrics { ate: vec![0.1, 1e300], note: None };
        assert_eq!(to_json(&metrics).unwrap(), "{\n  \"ate\": [\n    0.1,\n    1e+300\n  ]\n}\n");
        assert_eq!(to_yaml(&metrics).unwrap(), "ate:\n- 0.1\n- 1.0e+300\n");
        assert!(to_toml(&metrics).unwrap().starts_with("ate = [0.1, 1000000"));
    }

    #[test]
    fn what_a_format_cannot_say_is_refused() {
        assert!(matches!(to_json(&Some(u64::MAX)), Err(WriteError::Inexpressible { .. })));
    }
}
