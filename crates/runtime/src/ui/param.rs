//! Rows of the panel for the parameters of a scene, as `strandlight_formats::params` describes
//! them: label, range, unit, default, help and key are those of the row there.

use egui::Ui;
use strandlight_formats::params::{Absent, Kind, Numbers, Param, Section, Shape, Value, Word};

use super::color::ColorField;
use super::field::{Changes, Field, named};

/// A section of the scene that the panel shows: what is changed, and what a value is reset to.
pub struct Rows<'a, S: 'static> {
    /// What is said of the section.
    pub section: &'static Section<S>,
    /// The section.
    pub target: &'a mut S,
    /// What its values are reset to.
    pub plain: &'a S,
    /// What labels end in, where there are several such sections.
    pub suffix: &'a str,
}

impl<S> Rows<'_, S> {
    /// The whole key of `param`, as files and `--set` have it.
    pub fn key(&self, param: &Param<S>) -> String {
        format!("{}.{}", self.section.name, param.spec.key)
    }

    /// What `param` is reset to.
    fn default(&self, param: &Param<S>) -> Option<Value> {
        match param.spec.absent {
            Absent::Number(value) => Some(Value::Number(value)),
            _ => param.get(self.plain),
        }
    }

    /// The rows of `param`: one for each of its numbers, for its colour, or for its words.
    pub fn show(&mut self, ui: &mut Ui, param: &Param<S>, changes: &mut Changes) {
        match param.spec.kind {
            Kind::Numbers(numbers) if numbers.shape == Shape::Rgb => {
                self.color(ui, param, &numbers, changes);
            }
            Kind::Numbers(_) => self.numbers(ui, param, |field, _| field, changes),
            Kind::Choice(words) => self.words(ui, param, words, changes),
            // The others have rows of their own.
            _ => {}
        }
    }

    /// A row for each number of `param`, dressed by `dress`.
    pub fn numbers(
        &mut self,
        ui: &mut Ui,
        param: &Param<S>,
        dress: impl Fn(Field, usize) -> Field,
        changes: &mut Changes,
    ) {
        let Some(numbers) = param.spec.numbers() else {
            return;
        };
        for (ix, part) in numbers.shape.label_suffixes().iter().enumerate() {
            let label = format!("{}{part}{}", param.spec.label, self.suffix);
            self.number(ui, param, ix, label, |field| dress(field, ix), changes);
        }
    }

    /// A row called `label` for the number `ix` of `param`.
    pub fn number(
        &mut self,
        ui: &mut Ui,
        param: &Param<S>,
        ix: usize,
        label: String,
        dress: impl FnOnce(Field) -> Field,
        changes: &mut Changes,
    ) {
        let (Some(numbers), Some(default)) = (param.spec.numbers(), self.default(param)) else {
            return;
        };
        let Some(value) = param.get(self.target).or(Some(default.clone())) else {
            return;
        };
        let plain = default.number(ix).unwrap_or(numbers.min);
        let mut shown = value.number(ix).unwrap_or(plain);
        let mut key = format!("{}{}", self.key(param), numbers.shape.suffixes()[ix]);
        if !param.spec.symbol.is_empty() {
            key += &format!(" ({})", param.spec.symbol);
        }
        let field = Field::of(label, &key, numbers, plain).help(param.spec.help);
        if dress(field).show(ui, &mut shown, changes) {
            if numbers.shape == Shape::Whole {
                shown = shown.round().clamp(numbers.min, numbers.max);
            }
            let value = value.with_number(ix, shown);
            // What may be absent is absent at its default.
            let is_absent = matches!(param.spec.absent, Absent::Number(_)) && value == default;
            self.put(param, (!is_absent).then_some(value));
        }
    }

    fn color(&mut self, ui: &mut Ui, param: &Param<S>, numbers: &Numbers, changes: &mut Changes) {
        let (Some(Value::Vector(mut rgb)), Some(Value::Vector(default))) =
            (param.get(self.target), self.default(param))
        else {
            return;
        };
        let (label, key) = (
            format!("{}{}", param.spec.label, self.suffix),
            self.key(param),
        );
        let field = ColorField::new(&label, numbers.max, default).key(&key);
        if field.help(param.spec.help).show(ui, &mut rgb, changes) {
            self.put(param, Some(Value::Vector(rgb)));
        }
    }

    fn words(
        &mut self,
        ui: &mut Ui,
        param: &Param<S>,
        words: &'static [Word],
        changes: &mut Changes,
    ) {
        let current = param.get(self.target);
        let mut chosen = None;
        named(
            ui,
            param.spec.label,
            &help(param.spec.help, &self.key(param)),
            |ui| {
                for (word, name, help) in words {
                    let is_current = current == Some(Value::Text((*word).to_owned()));
                    let label = ui.selectable_label(is_current, *name);
                    if label.on_hover_text(*help).clicked() && !is_current {
                        chosen = Some((*word).to_owned());
                        let label = format!("{} {}", param.spec.label, name.to_lowercase());
                        changes.note(&label);
                    }
                }
            },
        );
        if chosen.is_some() {
            self.put(param, chosen.map(Value::Text));
        }
    }

    /// Controls hold values to their ranges; one that is not accepted all the same changes nothing.
    fn put(&mut self, param: &Param<S>, value: Option<Value>) {
        let _ = param.set(self.target, value);
    }
}

/// `text`, and below it the key that files and `--set` have.
pub fn help(text: &str, key: &str) -> String {
    format!("{text}\n{key}")
}
