//! The engine of `strandlight bake`: many items, each made again only when something it depends on
//! has changed.
//!
//! - [`Manifest`]: the text of a `bake.toml`; [`items`] finds the files that its patterns match and
//!   answers the [`Item`]s, sorted by output.
//! - [`Bakery`]: who knows the kinds of items, their settings, and how to make one. This module
//!   knows nothing of light sets or grooms.
//! - [`judge()`]: is an item up to date, and if not, why? By its [`Record`], a small file in the folder
//!   `.strandlight-bake` beside the output, which holds hashes and settings and no times. There is
//!   one for each item, so that any number of processes may work on one folder.
//! - [`run`]: makes what is stale, with a [`Cache`] if there is one.
//!
//! Outputs are written before their record, and each file whole or not at all. So a run that ends at
//! any moment leaves outputs that are as they were, or new without their record; those are made
//! again, to the same bytes.

mod cache;
mod depfile;
mod engine;
mod failure;
mod farm;
mod html;
mod index;
mod item;
mod judge;
mod record;
mod template;
mod text;
mod walk;

pub use cache::Cache;
pub use depfile::depfile;
pub use engine::{Bakery, Event, Observer, RunOptions, Summary, run};
pub use failure::Failure;
pub use farm::{Farm, Job, farm_job};
pub use html::html;
pub use index::{INDEX_VERSION, index};
pub use item::{Item, Output, Resolved, items, unknown_key};
pub use judge::{Judgement, Reason, State, judge};
pub use record::{BakedItem, FileRecord, Fingerprint, Record};
pub use text::{Entry, KindInfo, Manifest, Place, Setting};
