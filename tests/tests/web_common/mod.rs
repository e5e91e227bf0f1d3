//! A web server, a browser and pictures of what it shows.

pub mod browser;
pub mod server;
