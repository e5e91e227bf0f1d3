//! Pictures by a visibility list: only what they show is shaded, and nothing is sampled.

use web_time::Instant;

use super::visible_list::VisibleList;
use super::{DirtyFlags, HairRenderer};
use crate::invalidation::Inputs;
use crate::passes::lighting::Listed;
use crate::passes::visibility::{ListedLight, Seen, VisibilityPass};
use strandlight_scene::RenderError;
use strandlight_scene::camera::ViewUniform;

impl HairRenderer {
    /// Finds out what pictures show before they are shaded, from now on.
    pub(crate) fn use_list(&mut self) -> Result<(), RenderError> {
        if self.visible.is_none() {
            let pass = VisibilityPass::new(&self.context, &self.strands)?;
            self.visible = Some(VisibleList {
                pass,
                listed: None,
                n_made: 0,
            });
        }
        Ok(())
    }

    /// Lists at most so many pairs of a pixel and a segment together, or a row of pixels.
    pub(crate) fn set_most_hits(&mut self, most_hits: u32) {
        if let Some(visible) = &mut self.visible {
            visible.pass.most_hits = most_hits;
            visible.forget();
        }
    }

    /// Has the job to come, for what is `dirty`, shade only the points that `view` shows, where these are all that is
    /// drawn, or all.
    pub(super) fn list_visible(
        &mut self,
        view: &ViewUniform,
        dirty: &DirtyFlags,
    ) -> Result<(), RenderError> {
        let seen = match self.draws_by_list {
            true => self.list(view)?,
            false => None,
        };
        let Some((seen, VisibleList { pass, n_made, .. })) = seen.zip(self.visible.as_ref()) else {
            self.lighting.shade_listed(&self.context, None);
            return Ok(());
        };
        // Drafts of other views have what was lit before, if that looks as it did.
        let is_view_only = !dirty.is_new && dirty.inputs == Inputs::VIEW;
        let has_scale = self.front_scale == Some(view.radiance_scale);
        let before = (is_view_only && has_scale).then_some(self.front);
        (self.lighting).begin_listed(&self.context, before, 1 - self.front);
        let listed = Listed {
            n: seen.points,
            list: *n_made,
        };
        let points = Some((pass.seen_points(), listed));
        self.lighting.shade_listed(&self.context, points);
        Ok(())
    }

    /// Says whether pictures are drawn by list from now on. Samples need all points: they are shaded anew if those
    /// of a list alone were.
    pub(crate) fn set_draws_by_list(&mut self, draws_by_list: bool) {
        self.draws_by_list = draws_by_list;
        let is_partly_lit = !draws_by_list && self.lighting.n_listed().is_some();
        self.dirty.mark(Inputs::VIEW, is_partly_lit);
    }

    /// Bytes of the list.
    pub(crate) fn list_bytes(&self) -> u64 {
        self.visible.as_ref().map_or(0, VisibleList::bytes)
    }

    /// Makes the list of `view`, unless it is there. [`None`] if none is made, or the device has no room for it.
    fn list(&mut self, view: &ViewUniform) -> Result<Option<Seen>, RenderError> {
        // Light does not matter.
        let view = ViewUniform {
            radiance_scale: 1.0,
            margin_px: 0.0,
            ..*view
        };
        let Some(visible) = &mut self.visible else {
            return Ok(None);
        };
        if let Some((_, seen)) = visible.listed.filter(|(before, _)| *before == view) {
            return Ok(seen);
        }
        visible.listed = None;
        visible.n_made += 1;
        let start = Instant::now();
        let stamp = self.clock.stamp("list");
        let is_narrow = self.lighting.lit_points()[self.front].1.is_some();
        let kind = (self.lighting.shown_proxies(self.front), is_narrow);
        let (context, strands) = (&self.context, &self.strands);
        let seen = (visible.pass).list(context, &view, strands, kind, &stamp)?;
        visible.listed = Some((view, seen));
        // A tile is not the picture.
        if let Some(seen) = seen.filter(|_| view.extent == view.size) {
            self.report.stats.visible_points = u64::from(seen.points);
            self.report.stats.list_entries = u64::from(seen.entries);
        }
        self.report.ran("list");
        self.report.took("list", start.elapsed().as_secs_f64());
        Ok(seen)
    }

    /// Draws `view`, lit as shown, into `sums`, one sample a pixel. Points that it shows need not have been lit if it
    /// `may_be_draft`. Answers whether the device could; otherwise it takes samples.
    pub(crate) fn draw_visible(
        &mut self,
        view: &ViewUniform,
        sums: &wgpu::Buffer,
        may_be_draft: bool,
        observer: &mut dyn FnMut(f64),
    ) -> Result<bool, RenderError> {
        if self.list(view)?.is_none() {
            return Ok(false);
        }
        let start = Instant::now();
        if let Some(VisibleList { pass, n_made, .. }) = &mut self.visible {
            let is_other = self.front_list.is_some_and(|list| list != *n_made);
            let proxies = self.lighting.shown_proxies(self.front);
            let lit = ListedLight {
                points: self.lighting.lit_points()[self.front],
                even: self.ribbons.even,
                // Without lights all are black.
                is_draft: may_be_draft && is_other && self.lighting.lit().1 > 0,
            };
            pass.draw(&self.context, &self.strands, proxies, lit, sums, observer)?;
            self.report.ran("draw");
            self.report.took("draw", start.elapsed().as_secs_f64());
        }
        Ok(true)
    }
}
