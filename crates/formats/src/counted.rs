//! Numbers of things, in words.

use std::fmt::Display;

/// `n` and what there are so many of: `1 light`, `2 lights`; a verb can go with it, as in `1 light is` and `2 lights are`.
pub fn counted(n: impl Display, one: &str, many: &str) -> String {
    let n = n.to_string();
    let word = if n == "1" { one } else { many };
    format!("{n} {word}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_not_many() {
        let texts = [0, 1, 2].map(|n| counted(n, "vertex", "vertices"));
        assert_eq!(texts, ["0 vertices", "1 vertex", "2 vertices"]);
    }
}
