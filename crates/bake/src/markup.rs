//! Text in pages of HTML.

/// Text with what HTML reads as its own spelled out; signs that no XML document may hold are left
/// out.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for sign in text.chars() {
        match sign {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\n' | '\t' => out.push(sign),
            sign if sign.is_control() || matches!(sign, '\u{fffe}' | '\u{ffff}') => {
                out.push('\u{fffd}');
            }
            sign => out.push(sign),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_stays_text() {
        let found = escaped("<b> & \"it's\"\u{1b}\n");
        assert_eq!(found, "&lt;b&gt; &amp; &quot;it's&quot;\u{fffd}\n");
    }
}
