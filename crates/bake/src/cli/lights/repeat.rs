//! A command line as it is typed into a shell.

use std::fmt::Display;
use std::path::Path;

/// A command line that grows by words, quoted where a shell needs it.
pub struct Line(pub String);

impl Line {
    pub fn new(program: &str) -> Line {
        Line(program.to_owned())
    }

    pub fn word(&mut self, word: &str) {
        self.0.push(' ');
        self.0 += &quoted(word);
    }

    pub fn value(&mut self, flag: &str, value: impl Display) {
        self.word(flag);
        self.word(&value.to_string());
    }

    /// A path after its flag; an empty flag is none.
    pub fn path(&mut self, flag: &str, path: &Path) {
        if !flag.is_empty() {
            self.word(flag);
        }
        self.word(&path.to_string_lossy());
    }
}

fn quoted(word: &str) -> String {
    let is_plain = |sign: char| sign.is_ascii_alphanumeric() || "-_./=:,+@%".contains(sign);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_survive_a_shell() {
        let mut line = Line::new("strandlight lights");
        line.path("", Path::new("my map.hdr"));
        line.path("-o", Path::new("it's.lights"));
        line.value("--layer", "");
        line.value("--max-error", 0.005);
        let wanted =
            "strandlight lights 'my map.hdr' -o 'it'\\''s.lights' --layer '' --max-error 0.005";
        assert_eq!(line.0, wanted);
    }
}
