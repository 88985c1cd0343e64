//! What a loader could not give, for the user to read: each sentence once, and not more of them than one reads.

const LIMIT: usize = 20;

/// Warnings in the order in which they came up.
#[derive(Default)]
pub(crate) struct Warnings {
    list: Vec<String>,
    more: usize,
}

impl Warnings {
    /// Adds a sentence, unless it is there already.
    pub(crate) fn add(&mut self, sentence: impl Into<String>) {
        let sentence = sentence.into();
        if self.list.contains(&sentence) {
            return;
        }
        if self.list.len() < LIMIT {
            self.list.push(sentence);
        } else {
            self.more += 1;
        }
    }

    /// Adds how many of something there are, unless there are none.
    pub(crate) fn add_count(&mut self, what: &str, count: usize) {
        if count > 0 {
            self.add(format!("{what}: {count}"));
        }
    }

    pub(crate) fn into_list(mut self) -> Vec<String> {
        if self.more > 0 {
            self.list.push(format!("… and {} more warnings of these kinds", self.more));
        }
        self.list
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_are_few_and_different() {
        let mut warnings = Warnings::default();
        for i in 0..1000 {
            warnings.add(format!("warning {}", i / 2));
        }
        let list = warnings.into_list();
        assert_eq!(list.len(), LIMIT + 1);
        assert_eq!(list[1], "warning 1");
        assert!(list[LIMIT].contains("more"), "{}", list[LIMIT]);
    }
}
