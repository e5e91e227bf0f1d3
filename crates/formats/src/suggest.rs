//! What was meant by a name that is not known.

/// The one of `known` that `word` is a slip of, if there is one.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let most = (word.chars().count() / 3).max(1);
    let distances = known.into_iter().map(|name| (distance(word, name), name));
    let (least, name) = distances.min_by_key(|(distance, _)| *distance)?;
    (least <= most).then_some(name)
}

/// `did you mean ...?` for serde's complaint about an unknown field or variant, which lists the
/// known ones in backticks.
pub fn did_you_mean(message: &str) -> Option<String> {
    let at = ["unknown field `", "unknown variant `"]
        .into_iter()
        .find_map(|start| message.find(start))?;
    // Inside the backticks is every second piece.
    let mut names = message[at..].split('`').skip(1).step_by(2);
    let word = names.next()?;
    Some(format!("did you mean {}?", nearest(word, names)?))
}

/// Letters to put in, take out, replace or swap with their neighbour to make `b` of `a`, whatever
/// their case.
fn distance(a: &str, b: &str) -> usize {
    let letters = |text: &str| -> Vec<char> { text.to_lowercase().chars().take(64).collect() };
    let (a, b) = (letters(a), letters(b));
    let mut rows: Vec<Vec<usize>> = vec![(0..=b.len()).collect()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replaced = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut least = replaced.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            let is_swap = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
            if is_swap {
                least = least.min(rows[i - 2][j - 2] + 1);
            }
            row.push(least);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_seen_through_and_strangers_are_not() {
        let known = ["eta", "sigma_a", "eccentricity", "modes"];
        for (word, expected) in [
            ("etta", Some("eta")),
            ("eat", Some("eta")),
            ("Eta", Some("eta")),
            ("sigma_b", Some("sigma_a")),
            ("excentricity", Some("eccentricity")),
            ("colour", None),
            ("", None),
        ] {
            assert_eq!(nearest(word, known), expected, "{word}");
        }
        assert_eq!(nearest("a", []), None);
    }

    #[test]
    fn complaints_of_serde_get_a_suggestion() {
        let message = "unknown field `etta`, expected one of `sigma_a`, `eta`";
        assert_eq!(did_you_mean(message).as_deref(), Some("did you mean eta?"));
        let message = "unknown variant `filmc`, expected `filmic` or `none`";
        assert_eq!(
            did_you_mean(message).as_deref(),
            Some("did you mean filmic?")
        );
        assert_eq!(did_you_mean("unknown field `colour`, expected `eta`"), None);
        assert_eq!(
            did_you_mean("invalid type: string \"a\", expected f64"),
            None
        );
    }
}
