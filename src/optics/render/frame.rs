//! What all steps of a render share: view, motion and lamps over each row's exposure, and what of an earlier picture is kept.

use super::objects::ObjectInView;
use super::settings::{COLUMNS, ROWS, Sampling};
use super::view::View;
use crate::num::{f32_from_u32, f32_nearest, index, u32_from};
use crate::optics::motion::Timeline;
use crate::parallel::collected;
use crate::plane::Plane;
use crate::pose::Pose;
use crate::scene::light::{BANDS, Bands};
use crate::scene::object::MovingObject;
use crate::units::Span;

/// Strata of time that the level of flickering lamps is known for.
pub const STRATA: usize = 16;

/// Everything that the steps of a render share.
pub struct FrameRender<'a> {
    pub view: View<'a>,
    /// Span of each row.
    pub shutter: &'a [Span],
    pub sampling: Sampling,
    /// The camera's motion over the exposure of each group of rows.
    pub timelines: Vec<Timeline>,
    /// What moves beside the camera.
    pub objects: Vec<ObjectInView>,
    /// What is not rendered; none: all is.
    pub kept: Option<Kept<'a>>,
    per_lux_s: [f64; BANDS],
    /// Level of the flickering lamps in each stratum of each row's exposure.
    pub lamp_levels: Vec<[f32; STRATA]>,
}

/// A picture of which some tiles are kept.
pub struct Kept<'a> {
    /// Which tiles of each group of rows are rendered anew.
    pub tiles: Vec<Vec<bool>>,
    /// Photons of the others.
    pub photons: &'a Plane<f32>,
    /// Mean of their variance over photons.
    pub variance_ratio: f64,
}

/// Rows of each group; those beyond the last repeat it.
pub fn rows_of(group: usize, height: usize) -> [usize; ROWS] {
    std::array::from_fn(|row| (group * ROWS + row).min(height - 1))
}

/// The share of the pixel's width that each of `samples` samples stands for.
pub fn share(samples: u32) -> f32 {
    1.0 / f32_from_u32(samples).sqrt()
}

impl<'a> FrameRender<'a> {
    /// Evaluates the motion and the lamps once for every row.
    pub fn new(
        view: View<'a>,
        objects: &[MovingObject],
        shutter: &'a [Span],
        world_from_body: &(dyn Fn(f64) -> Pose + Sync),
        sampling: Sampling,
    ) -> Self {
        let world_from_camera = |t_s: f64| world_from_body(t_s).then(&view.camera.body_from_camera);
        let groups = shutter.len().div_ceil(ROWS);
        let spans = collected(groups, |group| rows_of(group, shutter.len()).map(|row| shutter[row]));
        let pieces_of = |group: usize| {
            let beside = objects.iter().map(|object| {
                let pose = |t_s: f64| object.world_from_object(t_s).inverse().then(&world_from_camera(t_s));
                Timeline::pieces_for(spans[group][0], &pose)
            });
            beside.fold(Timeline::pieces_for(spans[group][0], &world_from_camera), u32::max)
        };
        // As many for all, so that rays of many rows may share a packet.
        let pieces = collected(groups, pieces_of).into_iter().max().unwrap_or(1);
        let mut timelines = collected(groups, |group| Timeline::of(spans[group], pieces, &world_from_camera));
        let mut objects: Vec<ObjectInView> =
            objects.iter().map(|object| ObjectInView::new(object, &spans, pieces, &world_from_camera)).collect();
        for group in 0..groups {
            let beside = objects.iter_mut().map(|object| &mut object.timelines[group]);
            let mut all: Vec<&mut Timeline> = beside.chain([&mut timelines[group]]).collect();
            if all.iter().any(|timeline| !timeline.is_still) {
                all.iter_mut().for_each(|timeline| timeline.cut_alike(pieces));
            }
        }
        let level = |row: usize| std::array::from_fn(|stratum| lamp_level(&view, shutter[row], stratum, STRATA));
        let lamp_levels = (0..shutter.len()).map(level).collect();
        let per_lux_s = view.camera.photons_per_lux_s(view.scene.illuminant());
        Self { view, shutter, sampling, timelines, objects, kept: None, per_lux_s, lamp_levels }
    }

    /// Pixels of a row.
    pub fn width(&self) -> usize {
        index(self.view.camera.size.width_px)
    }

    /// Whether a pixel is rendered.
    pub fn is_rendered(&self, pixel: usize) -> bool {
        let (x, y) = (pixel % self.width(), pixel / self.width());
        self.kept.as_ref().is_none_or(|kept| kept.tiles[y / ROWS][x / COLUMNS])
    }

    /// Photons of each band per lux-equivalent behind the filter of a pixel, over its row's exposure.
    pub fn photons_per_lux(&self, column: usize, row: usize) -> Bands {
        // To the picosecond, so that equal exposures are equal in every bit whenever they begin.
        let length_s = (self.shutter[row].length_s() * 1e12).round_ties_even() * 1e-12;
        let passed = self.view.camera.mosaic.transmission_at(column, row);
        std::array::from_fn(|band| f32_nearest(self.per_lux_s[band] * passed[band] * length_s))
    }
}

/// Level of the flickering lamps over a stratum of a row's exposure.
pub fn lamp_level(view: &View, span: Span, stratum: usize, strata: usize) -> f32 {
    let share = |edge: usize| f64::from(u32_from(edge)) / f64::from(u32_from(strata));
    let at_s = |edge: usize| span.start_s + span.length_s() * share(edge);
    view.scene.lamp_level(Span { start_s: at_s(stratum), end_s: at_s(stratum + 1) })
}
