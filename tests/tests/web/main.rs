//! What a browser shows: the viewer in a web page, reports.

mod bundle;
mod element;
mod measure;
mod report_page;
mod web_common;
mod web_page;
