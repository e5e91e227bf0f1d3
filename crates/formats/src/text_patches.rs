//! Changes of pieces of a text, all else of which stays.

use std::ops::Range;

/// Bytes of a text.
pub(crate) type Span = Range<usize>;

/// Pieces of a text and what takes their place.
#[derive(Debug, Default)]
pub(crate) struct Patches(Vec<(Span, String)>);

impl Patches {
    pub fn replace(&mut self, span: Span, with: String) {
        self.0.push((span, with));
    }

    pub fn insert(&mut self, at: usize, text: String) {
        self.0.push((at..at, text));
    }

    pub fn remove(&mut self, span: Span) {
        self.0.push((span, String::new()));
    }

    /// Makes one of removals that have an end and a start in common, such as blank lines between two blocks.
    fn join_removals(&mut self) {
        self.0.dedup_by(|(next, with), (span, before)| {
            let is_shared = span.start < next.start && next.start < span.end && span.end < next.end;
            let is_one = is_shared && with.is_empty() && before.is_empty();
            if is_one {
                span.end = next.end;
            }
            is_one
        });
    }

    /// The changed text; `None` if two pieces overlap. A comment at the end of a line stays in its column where
    /// there is room.
    pub fn apply(mut self, text: &str) -> Option<String> {
        // Stable: what is inserted in one place comes in the order in which it was asked for.
        self.0.sort_by_key(|(span, _)| (span.start, span.end));
        self.join_removals();
        let mut out = String::new();
        // How far the rest of the line has moved.
        let (mut at, mut moved) = (0, 0isize);
        for (ix, (span, with)) in self.0.iter().enumerate() {
            let between = text.get(at..span.start)?;
            if between.contains('\n') {
                moved = 0;
            }
            out.push_str(between);
            out.push_str(with);
            at = span.end;
            let old = text.get(span.clone())?;
            match old.contains('\n') || with.contains('\n') {
                true => moved = 0,
                false => moved += with.chars().count() as isize - old.chars().count() as isize,
            }
            let next = self
                .0
                .get(ix + 1)
                .map_or(text.len(), |(next, _)| next.start);
            if let Some((closed, comment)) = comment_after(text, at).filter(|(_, at)| *at <= next) {
                let blanks = (comment - closed) as isize - moved;
                out.push_str(&text[at..closed]);
                out.push_str(&" ".repeat(blanks.max(1) as usize));
                (at, moved) = (comment, 0);
            }
        }
        out.push_str(text.get(at..)?);
        Some(out)
    }
}

/// Where the blanks before the comment of a line begin and end, if after `at` there are but them and closing brackets.
fn comment_after(text: &str, at: usize) -> Option<(usize, usize)> {
    let rest = text.get(at..)?;
    let comment = rest.find(|c| !matches!(c, ' ' | '\t' | ']' | '}' | ','))?;
    let closed = rest[..comment].trim_end().len();
    let is_apart = closed < comment && rest[comment..].starts_with('#');
    is_apart.then_some((at + closed, at + comment))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_change_and_comments_keep_their_column() {
        let text = "a = [1, 2]   # one\nb = '#'\nc = 3\n";
        let at = |piece: &str| {
            let start = text.find(piece).expect(piece);
            start..start + piece.len()
        };
        let mut patches = Patches::default();
        patches.replace(at("'#'"), "'##'".to_owned());
        patches.replace(at("1"), "10".to_owned());
        patches.replace(at("2"), "2.5".to_owned());
        patches.remove(at("c = 3\n"));
        patches.insert(text.len(), "d = 4\n".to_owned());
        patches.insert(text.len(), "e = 5\n".to_owned());
        let changed = patches.apply(text).expect("apart");
        assert_eq!(changed, "a = [10, 2.5] # one\nb = '##'\nd = 4\ne = 5\n");
        let mut patches = Patches::default();
        patches.remove(at("b = '#'\nc"));
        patches.remove(at("c = 3\n"));
        assert_eq!(patches.apply(text).expect("one"), "a = [1, 2]   # one\n");
        let mut patches = Patches::default();
        patches.remove(at("b = '#'\n"));
        patches.replace(at("'#'"), String::new());
        assert_eq!(patches.apply(text), None);
    }
}
