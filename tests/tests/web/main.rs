//! What a browser shows: the viewer in a web page, reports.

mod report_page;
mod web_common;
mod web_page;
