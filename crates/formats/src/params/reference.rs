//! The tables of the scene reference.

use std::fmt::Write;

use super::{Absent, Kind, ParamSpec, SECTIONS, Shape, Value, Word};

/// Every key of a scene file as Markdown: a heading and a table for each section.
pub fn reference_markdown() -> String {
    let mut text = String::new();
    for section in SECTIONS {
        let kind = section
            .kind()
            .map_or(String::new(), |kind| format!(" of kind `{kind}`"));
        // Writing to a string does not fail.
        let _ = write!(
            text,
            "## `{}`{kind}\n\n{}\n\n\
             | key | symbol | takes | unit | default | what it does |\n\
             |---|---|---|---|---|---|\n",
            section.heading(),
            section.help()
        );
        // Tables of an array are numbered.
        let number = match section.heading().starts_with("[[") {
            true => ".N",
            false => "",
        };
        for (spec, value) in section.specs() {
            let row = [
                format!("`{}{number}.{}`", section.name(), spec.key),
                spec.symbol.to_owned(),
                takes(spec),
                spec.numbers().map_or("", |numbers| numbers.unit).to_owned(),
                default(spec, value),
                what(spec),
            ];
            let _ = writeln!(text, "| {} |", row.join(" | "));
        }
        text.push('\n');
    }
    text
}

fn takes(spec: &ParamSpec) -> String {
    let words = |words: &[Word]| {
        let words: Vec<String> = words
            .iter()
            .map(|(word, ..)| format!("`\"{word}\"`"))
            .collect();
        words.join(", ")
    };
    match spec.kind {
        Kind::Numbers(numbers) => {
            let range = format!("{} .. {}", numbers.min, numbers.max);
            match numbers.shape {
                Shape::Number => range,
                Shape::Whole => format!("whole, {range}"),
                Shape::Size => format!("[width, height], whole, {range}"),
                Shape::Rgb => format!("[r, g, b], {range}"),
                Shape::Vector => format!("[x, y, z], {range}"),
                Shape::PerLobe => format!("{{ r, tt, trt }}, {range}"),
            }
        }
        Kind::Choice(of) => words(of),
        Kind::Choices(of) => format!("list of {}", words(of)),
        Kind::ChoiceOrColor(of, numbers) => {
            format!(
                "{}, [r, g, b] of {} .. {}",
                words(of),
                numbers.min,
                numbers.max
            )
        }
        Kind::Lights => "list of numbers of lights".to_owned(),
        Kind::File => "file".to_owned(),
        Kind::Files => "list of files".to_owned(),
        Kind::Preset => "name of a preset".to_owned(),
    }
}

fn default(spec: &ParamSpec, plain: Option<Value>) -> String {
    match spec.absent {
        Absent::Refused => "must be given".to_owned(),
        Absent::Number(value) => format!("`{value}`"),
        Absent::Words(words) => words.to_owned(),
        Absent::Default => match (plain, spec.kind) {
            (Some(Value::Vector([r, tt, trt])), Kind::Numbers(numbers))
                if numbers.shape == Shape::PerLobe =>
            {
                format!("`{{ r = {r}, tt = {tt}, trt = {trt} }}`")
            }
            (Some(value), _) => format!("`{value}`"),
            (None, _) => "none".to_owned(),
        },
    }
}

/// The help; of words, what each does.
fn what(spec: &ParamSpec) -> String {
    let mut text = spec.help.to_owned();
    if let Kind::Choice(words) | Kind::Choices(words) | Kind::ChoiceOrColor(words, _) = spec.kind {
        if !text.ends_with('.') {
            text.push('.');
        }
        for (word, _, help) in words {
            let _ = write!(text, " `{word}`: {help}");
        }
    }
    text
}
