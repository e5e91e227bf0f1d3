//! Parts of pages that are made from tables in the code.

use std::fs;
use std::path::Path;

/// The part of `page` between `<!-- name -->` and `<!-- end of name -->` is `generated`.
/// `STRANDLIGHT_UPDATE_DOCS=1` writes it.
pub fn check_part(page: &Path, name: &str, generated: &str) {
    let text = fs::read_to_string(page).expect("UTF-8");
    let [start, end] = [
        format!("<!-- {name} -->\n"),
        format!("<!-- end of {name} -->"),
    ];
    let (before, rest) = text.split_once(&start).expect("the part's start");
    let (_, after) = rest.split_once(&end).expect("the part's end");
    let expected = format!("{before}{start}{generated}{end}{after}");
    if std::env::var_os("STRANDLIGHT_UPDATE_DOCS").is_some() {
        fs::write(page, expected).expect("writable");
        return;
    }
    assert!(
        text == expected,
        "{}: run with STRANDLIGHT_UPDATE_DOCS=1:\n{generated}",
        page.display()
    );
}
