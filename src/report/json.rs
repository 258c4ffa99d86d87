//! Writes a report as JSON with keys in a fixed order, or names the path of a value that is not a number.

use serde_json::Value;

use crate::error::Error;
use crate::report::record::Report;

impl Report {
    /// Indented JSON with a newline at the end. Fails on a number that is not finite, or a figure without a value for which
    /// `not_measurable` holds no reason; the message names its path. (JSON has no NaN: serde writes it as null, and a null without a
    /// reason is how it shows.)
    pub fn to_json(&self) -> Result<String, Error> {
        let value = serde_json::to_value(self).map_err(|error| Error::Run(format!("report.json: {error}")))?;
        if let Some(path) = null_without_reason(&value, "", self) {
            return Err(Error::Run(format!("report.json: '{path}' has no value and no reason for that")));
        }
        let mut text =
            serde_json::to_string_pretty(self).map_err(|error| Error::Run(format!("report.json: {error}")))?;
        text.push('\n');
        Ok(text)
    }

    /// Reads what `to_json` wrote. Fails on text that is no report of this schema; the message names line and key.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let mut reader = serde_json::Deserializer::from_str(text);
        serde_path_to_error::deserialize(&mut reader)
            .map_err(|error| Error::Content { file: "report.json".to_owned(), reason: error.to_string() })
    }
}

/// Path of the first null that is not accounted for; indices of lists are left out of paths.
fn null_without_reason(value: &Value, path: &str, report: &Report) -> Option<String> {
    match value {
        Value::Null if report.not_measurable.contains_key(path) => None,
        Value::Null => Some(path.to_owned()),
        Value::Array(items) => items.iter().find_map(|item| null_without_reason(item, path, report)),
        Value::Object(fields) => fields.iter().find_map(|(key, field)| {
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            null_without_reason(field, &path, report)
        }),
        Value::Bool(_) | Value::Number(_) | Value::String(_) => None,
    }
}
