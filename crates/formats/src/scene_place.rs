//! Where in the text of a scene file a key stands.

use toml::de::{DeTable, DeValue};

/// Line, from 1, of `key`, such as `hair.eta` or `proxy[0].radii`, or else of the nearest thing
/// around it that is written; `None` where nothing of it is.
pub(crate) fn line_of(text: &str, key: &str) -> Option<usize> {
    let root = DeTable::parse(text).ok()?;
    let mut parts = key.split(['.', '[']).map(|part| part.trim_end_matches(']'));
    let (name, mut value) = entry(root.get_ref(), parts.next()?)?;
    let mut start = name.start;
    for part in parts {
        let next = match value {
            DeValue::Table(table) => entry(table, part),
            DeValue::Array(list) => part
                .parse()
                .ok()
                .and_then(|ix: usize| list.get(ix))
                .map(|item| (item.span(), item.get_ref())),
            _ => None,
        };
        let Some((span, below)) = next else { break };
        start = span.start;
        value = below;
    }
    let before = text.as_bytes().get(..start)?;
    Some(before.iter().filter(|&&byte| byte == b'\n').count() + 1)
}

type Span = std::ops::Range<usize>;

/// The place of `name` in `table`, and its value.
fn entry<'a>(table: &'a DeTable<'a>, name: &str) -> Option<(Span, &'a DeValue<'a>)> {
    let mut entries = table.iter();
    let (key, value) = entries.find(|(key, _)| key.get_ref() == name)?;
    Some((key.span(), value.get_ref()))
}

/// The key whose name or value is written where these bytes begin; `None` if there are none, as in errors of the
/// whole file.
pub(crate) fn key_at(text: &str, bytes: &Span) -> Option<String> {
    if bytes.is_empty() {
        return None;
    }
    let root = DeTable::parse(text).ok()?;
    key_in(root.get_ref(), bytes.start)
}

fn key_in(table: &DeTable<'_>, offset: usize) -> Option<String> {
    table.iter().find_map(|(key, value)| {
        let name = key.get_ref();
        let is_in = |span: Span| span.contains(&offset);
        let below = match value.get_ref() {
            DeValue::Table(table) => key_in(table, offset).map(|below| format!("{name}.{below}")),
            DeValue::Array(list) => list.iter().enumerate().find_map(|(ix, item)| {
                let below = item
                    .get_ref()
                    .as_table()
                    .and_then(|table| key_in(table, offset));
                match below {
                    Some(below) => Some(format!("{name}[{ix}].{below}")),
                    None => is_in(item.span()).then(|| format!("{name}[{ix}]")),
                }
            }),
            _ => None,
        };
        below.or_else(|| (is_in(key.span()) || is_in(value.span())).then(|| name.to_string()))
    })
}

#[cfg(test)]
mod tests {
    use crate::Scene;

    const HEAD: &str = "version = 1\n[groom]\nfile = 'a'\n[lights]\nfile = 'b'\n";

    fn message(lines: &str) -> String {
        let error = Scene::from_bytes(format!("{HEAD}{lines}").as_bytes(), "dir/s.toml".as_ref());
        error.expect_err(lines).to_string()
    }

    #[test]
    fn values_out_of_range_are_told_with_file_line_and_key() {
        for (lines, start) in [
            (
                "[hair]\n\n# index\neta = 9",
                "dir/s.toml:9: hair.eta is 9, must be in",
            ),
            (
                "[hair]\nwidth_deg = { r = 0, tt = 1, trt = 1 }",
                "dir/s.toml:7: hair.width_deg.r is 0",
            ),
            (
                "[hair.width_deg]\nr = 5\ntt = 0\ntrt = 5",
                "dir/s.toml:8: hair.width_deg.tt is 0",
            ),
            (
                "[hair]\npreset = 'red'\neta = 9",
                "dir/s.toml:8: hair.eta is 9",
            ),
            (
                "[hair]\npreset = 'blnd'",
                "dir/s.toml:7: hair.preset is blnd",
            ),
            ("[render]\nsize = [0, 1]", "dir/s.toml:7: render.size is 0"),
            (
                "[[proxy]]\nkind = 'ground'\nheight = 0\n[[proxy]]\nkind = 'ground'\nheight = nan",
                "dir/s.toml:11: proxy[1].height is NaN",
            ),
            (
                "[camera]\nposition = [0, 0, 1]\ntarget = [0, 0, 1]",
                "dir/s.toml:8: camera.target is",
            ),
            // `up` is not written: its section is named.
            (
                "[camera]\nposition = [0, 9, 0]\ntarget = [0, 0, 0]",
                "dir/s.toml:6: camera.up is",
            ),
            (
                "[motion.wind]\ndirection_deg = inf",
                "dir/s.toml:7: motion.wind.direction_deg is",
            ),
        ] {
            let message = message(lines);
            assert!(message.starts_with(start), "{lines}: {message}");
        }
    }

    #[test]
    fn keys_that_do_not_parse_are_told_with_a_suggestion() {
        for (lines, start, end) in [
            (
                "[hair]\netta = 1.5",
                "dir/s.toml:7:1: hair.etta: unknown field",
                "did you mean eta?",
            ),
            (
                "[hair]\neta = 'x'",
                "dir/s.toml:7:7: hair.eta: invalid type",
                "expected a number",
            ),
            (
                "[render]\ntone_map = 'filmc'",
                "dir/s.toml:7:12: render.tone_map: unknown variant",
                "did you mean filmic?",
            ),
            (
                "[hair]\nmelanin = { eumelamin = 1.0 }",
                "dir/s.toml:7:13: hair.melanin.eumelamin: unknown field",
                "did you mean eumelanin?",
            ),
            (
                "[[proxy]]\nkind = 'ground'",
                "dir/s.toml:6:1: proxy[0]: missing field",
                "`height`",
            ),
            (
                "[[proxy]]\nkind = 'ground'\nheight = 0\n[[proxy]]\nkind = 'ground'\n",
                "dir/s.toml:9:1: proxy[1]: missing field",
                "`height`",
            ),
            (
                "[rendr]\nsamples = 4",
                "dir/s.toml:6:2: rendr: unknown field",
                "did you mean render?",
            ),
        ] {
            let message = message(lines);
            assert!(
                message.starts_with(start) && message.ends_with(end),
                "{lines}: {message}"
            );
        }
        // Of the file, whatever stands first in it.
        let text = HEAD.replace("version = 1\n", "");
        let error = Scene::from_bytes(text.as_bytes(), "dir/s.toml".as_ref());
        let message_of_file = error.expect_err("without a version").to_string();
        assert_eq!(message_of_file, "dir/s.toml:1:1: missing field `version`");
        let unknown = message("[hair]\nfrizz = 1");
        assert!(!unknown.contains("did you mean"), "{unknown}");
    }
}
