//! Warnings: what a user should know although the run goes on. A list in the order of arrival, each text once.

/// Warnings of a setup or a run, without duplicates.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Warnings(Vec<String>);

impl Warnings {
    /// Adds a warning: one sentence in plain words that names key, value and a remedy, without "warning:" in front and without a full
    /// stop. A text that is already there is not added again.
    pub fn add(&mut self, text: impl Into<String>) {
        let text = text.into();
        if !self.0.contains(&text) {
            self.0.push(text);
        }
    }

    /// All texts in the order of arrival.
    pub fn texts(&self) -> &[String] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::Warnings;

    #[test]
    fn a_warning_that_comes_twice_is_listed_once_and_the_order_is_kept() {
        let mut warnings = Warnings::default();
        for text in ["second key", "first key", "second key"] {
            warnings.add(text);
        }
        assert_eq!(warnings.texts(), ["second key", "first key"]);
    }
}
