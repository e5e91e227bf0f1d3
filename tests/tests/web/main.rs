//! The viewer in a web page.

mod web_common;
mod web_page;
