//! Pictures by a visibility list: only what they show is shaded, and nothing is sampled.

use web_time::Instant;

use super::HairRenderer;
use super::visible_list::{ViewList, VisibleList, list_view};
use crate::invalidation::Inputs;
use crate::passes::lighting::Listed;
#[cfg(not(target_arch = "wasm32"))]
use crate::passes::parts::SOFTWARE_HITS;
use crate::passes::resources::failed;
use crate::passes::visibility::{ListedLight, Made, VisibilityPass};
use strandlight_scene::RenderError;
use strandlight_scene::camera::ViewUniform;

/// What came of drawing a view by list.
#[derive(Clone, Copy)]
pub(crate) enum ListDrawn {
    /// A picture of this view: the one that was asked for, or one that was asked for before and is there only now.
    Of { view: ViewUniform, is_asked: bool },
    /// The device has not answered yet how much there is to list, of this view or of one before.
    NotYet,
    /// The device has no room for the list. Samples need none.
    NoRoom,
}

impl HairRenderer {
    /// Finds out what pictures show before they are shaded, from now on. Lists wait for the device if it `is_waiting`;
    /// else they come some calls later.
    pub(crate) fn use_list(&mut self, is_waiting: bool) -> Result<(), RenderError> {
        if self.visible.is_none() {
            let pass = VisibilityPass::new(&self.context, &self.strands, is_waiting)?;
            self.lighting.use_lists(&self.context)?;
            self.visible = Some(VisibleList {
                pass,
                listed: None,
                making: None,
                n_made: 0,
                asked: (0, false),
                has_submitted: false,
            });
        }
        self.set_waiting(is_waiting);
        Ok(())
    }

    /// As [`HairRenderer::use_list`] says. Answers how it was before.
    pub(crate) fn set_waiting(&mut self, is_waiting: bool) -> bool {
        match &mut self.visible {
            Some(visible) => std::mem::replace(&mut visible.pass.is_waiting, is_waiting),
            None => is_waiting,
        }
    }

    /// Was something submitted for a list since the last call?
    pub(crate) fn has_submitted_list(&mut self) -> bool {
        let visible = self.visible.as_mut();
        visible.is_some_and(|visible| std::mem::take(&mut visible.has_submitted))
    }

    /// Lists at most so many pairs of a pixel and a segment together, or a row of pixels.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn set_most_hits(&mut self, most_hits: u32) {
        let is_software = self.context.is_software();
        if let Some(visible) = &mut self.visible {
            visible.pass.most_hits = match is_software {
                true => most_hits.min(SOFTWARE_HITS),
                false => most_hits,
            };
            visible.forget();
        }
    }

    /// Gives the job, which awaits the list of its view, the points that this shows to shade. Answers whether the list
    /// is there.
    pub(super) fn take_list(&mut self) -> Result<bool, RenderError> {
        let Some(awaited) = self.job.as_ref().and_then(|job| job.awaited_list) else {
            return Ok(true);
        };
        self.list(&awaited)?;
        Ok(self.job.as_ref().is_none_or(|job| !job.awaits_list()))
    }

    /// Has the job shade the points of this list alone, which it awaits, or all if there is no room for it.
    fn give_list(&mut self, list: &ViewList) {
        let Some(job) = self.job.as_mut() else {
            return;
        };
        if !job.awaited_list.is_some_and(|view| list.is_of(&view)) {
            return;
        }
        job.awaited_list = None;
        let chunk = job.chunk;
        let visible = self.visible.as_ref().filter(|_| list.is_there);
        let Some(VisibleList { pass, n_made, .. }) = visible else {
            self.lighting.shade_listed(&self.context, None, chunk);
            return self.plan_shading();
        };
        // Drafts of other views have what was lit before, if that looks as it did.
        let is_view_only = !job.dirty.is_new && job.dirty.inputs == Inputs::VIEW;
        let has_scale = self.front_scale == Some(job.view.radiance_scale);
        let before = (is_view_only && has_scale).then_some(self.front);
        (self.lighting).begin_listed(&self.context, before, 1 - self.front);
        let listed = Listed {
            n: list.n_points,
            list: *n_made,
        };
        let points = Some((pass.seen_points(), listed));
        (self.lighting).shade_listed(&self.context, points, chunk);
        self.plan_shading();
    }

    /// Says whether pictures are drawn by list from now on. Samples need all points: they are shaded anew if those
    /// of a list alone were.
    pub(crate) fn set_draws_by_list(&mut self, draws_by_list: bool) {
        self.draws_by_list = draws_by_list;
        let job = self.job.as_mut().filter(|_| !draws_by_list);
        if let Some(job) = job
            && job.awaited_list.take().is_some()
        {
            (self.lighting).shade_listed(&self.context, None, job.chunk);
            self.plan_shading();
        }
        let is_partly_lit = !draws_by_list && self.lighting.listed().is_some();
        self.dirty.mark(Inputs::VIEW, is_partly_lit);
    }

    /// Is the list of `view` there?
    pub(crate) fn has_list(&self, view: &ViewUniform) -> bool {
        let visible = self.visible.as_ref();
        let listed = visible.filter(|visible| visible.making.is_none());
        let listed = listed.and_then(|visible| visible.listed);
        listed.is_some_and(|listed| listed.is_of(&list_view(view)))
    }

    /// Bytes of the list.
    pub(crate) fn list_bytes(&self) -> u64 {
        self.visible.as_ref().map_or(0, VisibleList::bytes)
    }

    /// The list of `view`, as [`list_view`] has it, made unless it is there. Who does not wait gets the list of another
    /// view if one was under way, and [`None`] as long as there is none.
    fn list(&mut self, view: &ViewUniform) -> Result<Option<ViewList>, RenderError> {
        loop {
            let Some(visible) = &mut self.visible else {
                return Ok(Some(ViewList::none(view)));
            };
            if visible.making.is_none() {
                if let Some(listed) = visible.listed.filter(|listed| listed.is_of(view)) {
                    self.give_list(&listed);
                    return Ok(Some(listed));
                }
                self.begin_list(view)?;
                continue;
            }
            let is_waiting = visible.pass.is_waiting;
            match self.proceed_list()? {
                Some(listed) if listed.is_of(view) || !is_waiting => return Ok(Some(listed)),
                Some(_) => {}
                None if is_waiting => self.context.wait("visibility list").map_err(failed)?,
                None => return Ok(None),
            }
        }
    }

    fn begin_list(&mut self, view: &ViewUniform) -> Result<(), RenderError> {
        let Some(visible) = &mut self.visible else {
            return Ok(());
        };
        visible.listed = None;
        visible.making = Some((*view, Instant::now()));
        visible.n_made += 1;
        visible.has_submitted = true;
        let stamp = self.clock.stamp("list");
        let is_narrow = self.lighting.lit_points()[self.front].1.is_some();
        let kind = (self.lighting.shown_proxies(self.front), is_narrow);
        (visible.pass).begin(&self.context, view, &self.strands, kind, stamp)
    }

    /// The list under way, once it is there.
    fn proceed_list(&mut self) -> Result<Option<ViewList>, RenderError> {
        // Before it answers for this list.
        self.take_seen();
        let Some(visible) = &mut self.visible else {
            return Ok(None);
        };
        let proxies = self.lighting.shown_proxies(self.front);
        let clock = &mut self.clock;
        let made = (visible.pass).proceed(&self.context, &self.strands, proxies, || {
            clock.stamp("list")
        })?;
        visible.has_submitted |= matches!(made, Made::Listing | Made::Listed);
        let is_there = match made {
            Made::NotYet | Made::Listing => return Ok(None),
            Made::Listed | Made::Whole => true,
            Made::NoRoom => false,
        };
        let Some((view, start)) = visible.making.take() else {
            return Ok(None);
        };
        visible.listed = Some(ViewList {
            is_there,
            ..ViewList::none(&view)
        });
        if is_there {
            // A tile is not the picture.
            visible.asked = (visible.n_made, view.extent == view.size);
        }
        self.report.ran("list");
        // Who does not wait hears from the pacer what it took.
        if visible.pass.is_waiting {
            self.report.took("list", start.elapsed().as_secs_f64());
        }
        self.take_seen();
        let listed = self.visible.as_ref().and_then(|visible| visible.listed);
        if let Some(listed) = &listed {
            self.give_list(listed);
        }
        Ok(listed)
    }

    /// Notes how much the last list shows, once the device has answered.
    pub(crate) fn take_seen(&mut self) {
        let seen = self.visible.as_mut().and_then(VisibleList::take_seen);
        let Some((list, is_whole, seen)) = seen else {
            return;
        };
        if is_whole {
            self.report.stats.visible_points = u64::from(seen.points);
            self.report.stats.list_entries = u64::from(seen.entries);
        }
        if self.lighting.know_listed(list, seen.points)
            && let Some(job) = &mut self.job
        {
            job.know_points(seen.points);
        }
    }

    /// The list to draw `view` from, as [`ListDrawn`] says; [`HairRenderer::draw_list`] draws it.
    pub(crate) fn find_list(&mut self, view: &ViewUniform) -> Result<ListDrawn, RenderError> {
        let own = list_view(view);
        // What a job awaits comes first: it would never get it while the view keeps turning.
        let awaited = self.job.as_ref().and_then(|job| job.awaited_list);
        let Some(mut list) = self.list(&awaited.unwrap_or(own))? else {
            return Ok(ListDrawn::NotYet);
        };
        let can_be_drawn = |list: &ViewList| {
            list.is_there && (list.view.size, list.view.extent) == (view.size, view.extent)
        };
        if !can_be_drawn(&list) && !list.is_of(&own) {
            let Some(next) = self.list(&own)? else {
                return Ok(ListDrawn::NotYet);
            };
            list = next;
        }
        let is_asked = list.is_of(&own);
        if !can_be_drawn(&list) {
            return Ok(match is_asked {
                true => ListDrawn::NoRoom,
                false => ListDrawn::NotYet,
            });
        }
        Ok(ListDrawn::Of {
            view: ViewUniform {
                radiance_scale: view.radiance_scale,
                margin_px: view.margin_px,
                ..list.view
            },
            is_asked,
        })
    }

    /// Draws the list that is there, lit as shown, into `sums`, one sample a pixel. Points that it shows need not have
    /// been lit if it `may_be_draft`.
    pub(crate) fn draw_list(
        &mut self,
        sums: &wgpu::Buffer,
        may_be_draft: bool,
        observer: &mut dyn FnMut(f64),
    ) -> Result<(), RenderError> {
        let Some(VisibleList { pass, n_made, .. }) = &mut self.visible else {
            return Ok(());
        };
        let is_other = self.front_list.is_some_and(|list| list != *n_made);
        let proxies = self.lighting.shown_proxies(self.front);
        let lit = ListedLight {
            points: self.lighting.lit_points()[self.front],
            even: self.ribbons.even,
            // Without lights all are black.
            is_draft: may_be_draft && is_other && self.lighting.lit().1 > 0,
        };
        let sums = (sums, self.clock.stamp("draw"));
        pass.draw(&self.context, &self.strands, proxies, lit, sums, observer)
    }
}
