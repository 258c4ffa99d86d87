//! Facts about a scenario before anything is rendered. Each is an interval that holds for every frame, with a note on how it was found.

use glam::{DVec2, DVec3};

use super::sensor::SensorSetup;
use super::world::World;
use crate::effects::regions::{self, LightBounds};
use crate::error::Error;
use crate::facts::{DieSpread, Fact, ScenarioFacts, Tile, readable};
use crate::num::{f64_from_usize, greater, lesser};
use crate::optics::Camera;
use crate::pixel;
use crate::scene::motion::{Motion, MotionError};
use crate::scene::nearest;
use crate::scene::object::MovingObject;
use crate::units::{FrameIndex, RowIndex, Span};

/// Largest number of parts of the run with separate path boxes.
const PATH_PARTS: usize = 128;

/// Parts of the picture along each axis.
const TILES: u32 = 3;

/// Positions along each axis of the picture at which the lens is asked how many pixels a radian takes.
const LENS_POSITIONS: u32 = 17;

/// Between these positions the pixels of a radian grow by less than this share: a mapping is smooth, and its extremes lie in the middle and
/// in the corners, which are among the positions.
const LENS_SLACK: f64 = 0.02;

/// What the facts are made from.
pub(super) struct FactInputs<'a> {
    pub sensor: &'a SensorSetup,
    pub world: &'a World,
    pub motion: &'a Motion,
    /// Cameras with the pixels of the array that are read.
    pub windows: &'a [Camera],
    /// From the first exposure to the end of the last.
    pub run: Span,
    /// Of the rig's dies.
    pub dies: DieSpread,
}

/// What is known of a moving object.
struct ObjectFacts {
    /// Least and greatest distance from a camera.
    depth_m: [f64; 2],
    /// Of any of its points, at most.
    speed_m_per_s: f64,
}

/// The same with its light.
struct Lit<'a> {
    known: &'a FactInputs<'a>,
    light: LightBounds,
    /// Shortest and longest exposure.
    exposures_s: [f64; 2],
}

impl FactInputs<'_> {
    /// All facts, from bounds of the light over the shortest and the longest exposure. Fails on a motion that ends before the run.
    pub fn facts(&self, light: LightBounds, exposures_s: [f64; 2]) -> Result<ScenarioFacts, Error> {
        Lit { known: self, light, exposures_s }.facts()
    }
}

impl<'a> std::ops::Deref for Lit<'a> {
    type Target = FactInputs<'a>;

    fn deref(&self) -> &Self::Target {
        self.known
    }
}

impl Lit<'_> {
    fn facts(&self) -> Result<ScenarioFacts, Error> {
        let at_run = |error: MotionError| Error::Run(error.to_string());
        let speeds = self.motion.speeds_max(self.run).map_err(at_run)?;
        let of_scene_m = self.depth_m().map_err(at_run)?;
        let objects = self.objects().map_err(at_run)?;
        let depth_m = objects
            .iter()
            .fold(of_scene_m, |[near, far], object| [lesser(near, object.depth_m[0]), greater(far, object.depth_m[1])]);
        let mut facts = self.light_facts();
        facts.push(self.lamps());
        facts.push(self.field_of_view());
        facts.push(Fact {
            name: "depth_m",
            least: depth_m[0],
            greatest: depth_m[1],
            how: match self.world {
                World::Scene(_) => "boxes around the path to the nearest and farthest triangle, and to moving objects",
                #[cfg(feature = "pictures")]
                World::Images(_) => "pictures from elsewhere",
            }
            .to_owned(),
        });
        facts.extend(self.speeds(speeds));
        facts.extend(self.motions_px(speeds, of_scene_m[0], &objects));
        facts.extend(self.charge_facts());
        Ok(ScenarioFacts { facts, tiles: self.tiles() })
    }

    /// Least and greatest mean electrons of a pixel. The planner reckons with lit surfaces; a pixel may also see none.
    fn signal_e(&self) -> [f64; 2] {
        let is_black = self.world.dynamic_scene().is_some_and(|scene| scene.may_be_black());
        let least = if is_black { 0.0 } else { self.light.photons_min };
        [least, self.light.photons_max].map(|photons| photons * self.sensor.electrons_per_photon())
    }

    fn light_facts(&self) -> Vec<Fact> {
        let [least, greatest] = self.signal_e();
        let [short_s, long_s] = self.exposures_s;
        let counted_e = regions::most_e(&self.sensor.parameters, greatest);
        let capped = if counted_e < greatest {
            format!("; the plan counts {} e- at most, twice what pixel and converter hold", readable(counted_e))
        } else {
            String::new()
        };
        let [short, long] = [short_s, long_s].map(|length_s| readable(1e6 * length_s));
        let how = format!(
            "darkest and brightest lit texel times roll-off, filters and quantum efficiency, {short} to {long} us{capped}"
        );
        // Both ends of one exposure.
        let least_of_long_e = least * long_s / short_s;
        let sum_e = least_of_long_e + greatest;
        let contrast = if sum_e > 0.0 { (greatest - least_of_long_e) / sum_e } else { 0.0 };
        let of_signal = "(most - least) / (most + least) of the signal's ends".to_owned();
        vec![
            Fact { name: "signal_e", least, greatest, how },
            Fact { name: "contrast", least: 0.0, greatest: contrast, how: of_signal },
        ]
    }

    fn lamps(&self) -> Fact {
        let (bounds, how) = match self.world.scene() {
            Some(scene) if !scene.is_steady() => {
                let [short, long] = self.exposures_s.map(|length_s| scene.lamp_level_bounds_over(length_s));
                let bounds = [lesser(short[0], long[0]), greater(short[1], long[1])];
                (bounds, "waveform's mean over the exposure at every phase")
            }
            Some(_) => ([1.0; 2], "no lamp flickers"),
            None => ([1.0; 2], "flicker of pictures is in the pictures"),
        };
        Fact { name: "lamp_level", least: bounds[0], greatest: bounds[1], how: how.to_owned() }
    }

    fn field_of_view(&self) -> Fact {
        let widest = |camera: &Camera| 2.0 * libm::acos(camera.cosine_min()).to_degrees();
        let (least, greatest) = ends(self.windows.iter().map(widest));
        Fact { name: "field_of_view_deg", least, greatest, how: "twice the bearing farthest from the axis".to_owned() }
    }

    /// How far any camera is from the body's origin.
    fn reach_m(&self) -> f64 {
        ends(self.windows.iter().map(|camera| camera.body_from_camera.translation_m.length())).1
    }

    /// A part of the run, and the box that holds all cameras in it.
    fn path_box(&self, part: usize, parts: usize) -> Result<(Span, [DVec3; 2]), MotionError> {
        let reach_m = DVec3::splat(self.reach_m());
        let step_s = self.run.length_s() / f64_from_usize(parts);
        let start_s = self.run.start_s + step_s * f64_from_usize(part);
        let span = Span { start_s, end_s: lesser(start_s + step_s, self.run.end_s) };
        let (low_m, high_m) = self.motion.extent_m(span)?;
        Ok((span, [low_m - reach_m, high_m + reach_m]))
    }

    /// Distance along rays to the surfaces that a camera can see: pictures say nothing.
    fn depth_m(&self) -> Result<[f64; 2], MotionError> {
        let Some(lit) = self.world.scene() else { return Ok([0.0, f64::INFINITY]) };
        let bvh = &lit.scene().bvh;
        let root = &bvh.nodes[0];
        let corner = |side: usize| {
            DVec3::from_array([0, 1, 2].map(|axis| {
                let coordinates_m = root.planes_m[axis][side].iter().filter(|coordinate| coordinate.is_finite());
                <[f64; 2]>::from(ends(coordinates_m.map(|&m| f64::from(m))))[side]
            }))
        };
        let scene_m = [corner(0), corner(1)];
        let parts = if matches!(self.motion, Motion::Still(_)) { 1 } else { PATH_PARTS };
        let (mut nearest_m, mut farthest_m) = (f64::INFINITY, 0.0);
        for part in 0..parts {
            let (_, [low_m, high_m]) = self.path_box(part, parts)?;
            nearest_m = lesser(nearest_m, nearest::distance_m(bvh, [low_m, high_m]));
            let far_m = (scene_m[1] - low_m).abs().max((high_m - scene_m[0]).abs());
            farthest_m = greater(farthest_m, far_m.length());
        }
        Ok([nearest_m, farthest_m])
    }

    /// How near moving objects come to a camera, and how fast they pass it.
    fn objects(&self) -> Result<Vec<ObjectFacts>, MotionError> {
        let Some(scene) = self.world.dynamic_scene() else { return Ok(Vec::new()) };
        let of = |object: &MovingObject| {
            let mut depth_m = [f64::INFINITY, 0.0];
            for part in 0..PATH_PARTS {
                let (span, [low_m, high_m]) = self.path_box(part, PATH_PARTS)?;
                let [least_m, most_m] = object.extent_m(span)?;
                let gap_m = (least_m - high_m).max(low_m - most_m).max(DVec3::ZERO);
                let far_m = (most_m - low_m).abs().max((high_m - least_m).abs());
                depth_m = [lesser(depth_m[0], gap_m.length()), greater(depth_m[1], far_m.length())];
            }
            Ok(ObjectFacts { depth_m, speed_m_per_s: object.speed_max_m_per_s(self.run)? })
        };
        scene.objects.iter().map(of).collect()
    }

    fn speeds(&self, [speed, turn]: [f64; 2]) -> [Fact; 2] {
        let how = match self.motion {
            Motion::Still(_) => "nothing moves",
            Motion::Spline(_) => "differences of the path's control poses",
        };
        let of = |name, greatest| Fact { name, least: 0.0, greatest, how: how.to_owned() };
        [of("speed_m_per_s", speed), of("turn_deg_per_s", turn.to_degrees())]
    }

    /// How far the picture of a point can move while it stays in view.
    fn motions_px(&self, [speed, turn]: [f64; 2], nearest_m: f64, objects: &[ObjectFacts]) -> [Fact; 2] {
        let camera_speed = speed + turn * self.reach_m();
        let past = |speed: f64, nearest_m: f64| if speed > 0.0 { speed / nearest_m } else { 0.0 };
        // What passes fastest: the fixed scene or an object.
        let (mut passing, mut passed) = (past(camera_speed, nearest_m), (camera_speed, nearest_m));
        for object in objects {
            let (speed, nearest_m) = (camera_speed + object.speed_m_per_s, object.depth_m[0]);
            if past(speed, nearest_m) > passing {
                (passing, passed) = (past(speed, nearest_m), (speed, nearest_m));
            }
        }
        let per_rad = ends(self.windows.iter().map(px_per_rad_max)).1;
        let px_per_s = per_rad * (turn + passing);
        let [px, turn_deg, past_m, near_m] = [per_rad, turn.to_degrees(), passed.0, passed.1].map(readable);
        let how = format!("{px} px a radian times ({turn_deg} deg/s of turning + {past_m} m/s past {near_m} m)");
        let schedule = &self.sensor.schedule;
        let middle_s = |row: u32| schedule.exposure(FrameIndex(0), RowIndex(row)).middle_s();
        let readout_s = middle_s(self.sensor.size.height_px - 1) - middle_s(0);
        let of = |name, time_s: f64| {
            let greatest = if time_s > 0.0 && px_per_s > 0.0 { px_per_s * time_s } else { 0.0 };
            Fact { name, least: 0.0, greatest, how: format!("{how}, {} us", readable(1e6 * time_s)) }
        };
        [of("motion_over_exposure_px", self.exposures_s[1]), of("motion_over_readout_px", readout_s.abs())]
    }

    fn charge_facts(&self) -> [Fact; 3] {
        let pixel = &self.sensor.parameters.pixel;
        let storage_s = self.sensor.schedule.storage_s_max();
        let [least_e, greatest_e] = self.signal_e();
        let share = 1.0 + pixel::parasitic_share(pixel, self.exposures_s[0], storage_s);
        let greatest = greatest_e * share / pixel.full_well_e;
        let risk = if greatest < 1.0 { "no mean reaches the well of" } else { "bright pixels may pass the well of" };
        let (dark_e, _) = pixel::dark_charge_e(pixel, self.exposures_s[1], storage_s, self.dies);
        let (well_e, temperature_k) = (pixel.full_well_e, pixel.temperature_k);
        let well_how = format!("{risk} {} e-", readable(well_e));
        let dark_how =
            format!("dark current of the darkest of the rig's dies at {temperature_k} K over exposure and storage");
        let of = |name, least, greatest, how| Fact { name, least, greatest, how };
        [
            of("well_filling", least_e / well_e, greatest, well_how),
            of("dark_e", 0.0, dark_e, dark_how),
            of("temperature_k", temperature_k, temperature_k, "as configured".to_owned()),
        ]
    }

    /// The signal of each part of the picture: the whole picture's, by the parts' own roll-off.
    fn tiles(&self) -> Vec<Tile> {
        let size = self.windows[0].size;
        let whole = self.windows[0].roll_off_bounds();
        let part = |count: u32, number: u32| [number * count / TILES, (number + 1) * count / TILES];
        let signal_e = self.signal_e();
        let grid = (0..TILES).flat_map(|row| (0..TILES).map(move |column| (row, column)));
        let tile = |(row, column): (u32, u32)| {
            let (columns, rows) = (part(size.width_px, column), part(size.height_px, row));
            if columns[0] == columns[1] || rows[0] == rows[1] {
                return None;
            }
            let own = self.windows[0].roll_off_bounds_of(columns, rows);
            let of = |end: usize| if whole[end] > 0.0 { signal_e[end] * own[end] / whole[end] } else { signal_e[end] };
            Some(Tile { columns, rows, signal_e: [of(0), of(1)] })
        };
        grid.filter_map(tile).collect()
    }
}

/// Least and greatest of some values; of none infinity and 0.
fn ends(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| (lesser(least, value), greater(most, value)))
}

/// The most pixels that a radian takes in any direction anywhere in the picture: the inverse of the least singular value of the bearing's
/// derivative by the position.
fn px_per_rad_max(camera: &Camera) -> f64 {
    let side = |count: u32, step: u32| f64::from(count) * f64::from(step) / f64::from(LENS_POSITIONS - 1) - 0.5;
    let mut most: f64 = 0.0;
    for row in 0..LENS_POSITIONS {
        for column in 0..LENS_POSITIONS {
            let position_px = DVec2::new(side(camera.size.width_px, column), side(camera.size.height_px, row));
            let Some((_, jacobian)) = camera.lens.unproject_with_jacobian(position_px) else { continue };
            let by = |axis: usize| DVec3::from_array(jacobian.map(|line| line[axis]));
            let (by_x, by_y) = (by(0), by(1));
            let (xx, xy, yy) = (by_x.length_squared(), by_x.dot(by_y), by_y.length_squared());
            let least_square = 0.5 * (xx + yy - ((xx - yy) * (xx - yy) + 4.0 * xy * xy).sqrt());
            most = greater(most, 1.0 / least_square.sqrt());
        }
    }
    (1.0 + LENS_SLACK) * most
}
