//! The index as a page that needs nothing else.

use std::fmt::Write;

use serde_json::Value;

use super::index::WORST_BY;
use crate::markup::escaped;

const STYLE: &str = "body{font:15px/1.4 system-ui,sans-serif;margin:2em;max-width:75em}\
table{border-collapse:collapse;width:100%}\
th,td{text-align:left;padding:.25em .7em;border-bottom:1px solid #8884;vertical-align:top}\
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}\
.failed{color:#b00020}.stale,.missing{color:#8a5a00}\
.bar{display:inline-block;height:.6em;background:#b0002088;margin-right:.5em}\
@media(prefers-color-scheme:dark){body{background:#111;color:#ddd}\
.failed{color:#ff8a80}.stale,.missing{color:#ffd180}}";

/// A page of the document that [`index`](super::index()) makes.
pub fn html(document: &Value) -> String {
    let rows = document["items"].as_array().map_or(&[][..], Vec::as_slice);
    let is_compared = document["removed"].is_array();
    let worst = rows.iter().filter_map(error_of).fold(0.0, f64::max);
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width\">\
         <title>Bake report</title><style>{STYLE}</style></head>\n<body>\n<h1>Bake report</h1>\n<p>{}</p>\n",
        summary(document),
    );
    if is_compared {
        page += &changes(document, rows);
    }
    page += "<table>\n<tr><th>item</th><th>made of</th><th>state</th><th class=\"n\">lights</th>\
             <th class=\"n\">fibre error</th><th class=\"n\">irradiance error</th>";
    page += if is_compared {
        "<th>change</th></tr>\n"
    } else {
        "</tr>\n"
    };
    for row in rows {
        page += &line(row, worst, is_compared);
    }
    page += "</table>\n</body>\n</html>\n";
    page
}

fn error_of(row: &Value) -> Option<f64> {
    row["figures"][WORST_BY].as_f64()
}

fn percent(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| format!("{:.2} %", 100.0 * value))
}

fn text(value: &Value) -> String {
    escaped(value.as_str().unwrap_or_default())
}

fn summary(document: &Value) -> String {
    let counts = document["counts"].as_object().into_iter().flatten();
    let counts: Vec<String> = counts
        .filter(|(_, count)| **count != 0)
        .map(|(state, count)| format!("{count} {state}"))
        .collect();
    format!(
        "{} ({})",
        counts.join(", "),
        text(&document["tool_version"])
    )
}

fn changes(document: &Value, rows: &[Value]) -> String {
    let n = |is: &str| {
        let changes = rows.iter().filter(|row| row["change"]["is"] == is);
        changes.count()
    };
    let removed = document["removed"]
        .as_array()
        .map_or(&[][..], Vec::as_slice);
    let names: Vec<String> = removed.iter().map(text).collect();
    let gone = match names.is_empty() {
        true => String::new(),
        false => format!(": {}", names.join(", ")),
    };
    format!(
        "<p>Since the last report: {} new, {} changed, {} removed{gone}</p>\n",
        n("new"),
        n("changed"),
        removed.len()
    )
}

fn line(row: &Value, worst: f64, is_compared: bool) -> String {
    let error = error_of(row);
    let bar = match error {
        Some(error) if worst > 0.0 => format!(
            "<span class=\"bar\" style=\"width:{:.1}em\"></span>",
            6.0 * error / worst
        ),
        _ => String::new(),
    };
    let figures = &row["figures"];
    let state = text(&row["state"]);
    let why = match text(&row["why"]) {
        why if why.is_empty() => String::new(),
        why => format!(": {why}"),
    };
    let lights = figures["lights"].as_u64();
    let mut line = String::new();
    // Writing to a string does not fail.
    let _ = write!(
        line,
        "<tr><td>{}</td><td>{}</td><td class=\"{state}\">{state}{why}</td><td class=\"n\">{}</td>\
         <td class=\"n\">{bar}{}</td><td class=\"n\">{}</td>",
        text(&row["item"]),
        text(&row["input"]),
        lights.map_or(String::new(), |lights| lights.to_string()),
        percent(error),
        percent(figures["irradiance_error"].as_f64()),
    );
    if is_compared {
        let change = &row["change"];
        let before = percent(change[format!("{WORST_BY}_before")].as_f64());
        let before = match before.is_empty() {
            true => before,
            false => format!(", was {before}"),
        };
        let _ = write!(line, "<td>{}{before}</td>", text(&change["is"]));
    }
    line + "</tr>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_the_page() {
        let document = serde_json::json!({
            "counts": { "done": 1, "stale": 0 },
            "items": [{
                "item": "<script>\"&.lights", "input": "a", "state": "done", "why": "",
                "figures": { "fibre_error": 0.0125, "lights": 40 },
                "change": { "is": "changed", "fibre_error_before": 0.02 },
            }],
            "removed": ["<b>"],
        });
        let page = html(&document);
        assert!(
            !page.contains("<script>") && !page.contains("<b>"),
            "{page}"
        );
        for needle in [
            "&lt;script&gt;&quot;&amp;.lights",
            "1.25 %",
            "was 2.00 %",
            "1 done",
            ">40<",
        ] {
            assert!(page.contains(needle), "{needle}: {page}");
        }
    }
}
