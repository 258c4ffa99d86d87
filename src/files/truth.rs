//! Writes ground truth and stage outputs beside a run: one folder a kind, one folder a camera, one file a frame, named by its time in
//! nanoseconds. `ground_truth.json` says what each number means.
//!
//! Frames are written as they come, so memory does not grow with the run. docs/ground_truth.md describes every file.

mod encode;
mod index;
mod keep;
mod tum;

pub use keep::{Keep, KeptOutput};
pub use tum::TumWriter;

use std::path::{Path, PathBuf};

use super::picture::{write_grey_8, write_grey_16};
use super::{make_folder, write};
use crate::error::Error;
use crate::num::u64_half_even;
use crate::optics::truth::{Matches, Surfaces, TruthView, Visibility, matches, surfaces};
use crate::picture::{Channel, to_exr};
use crate::plane::Plane;
use crate::run::{CameraFrame, Frame, Session, Setup};
use crate::scene::motion::imu::ImuSample;
use crate::scene::object::Shapes;
use crate::units::FrameIndex;

/// Kinds under construction in a run's folder.
#[derive(Debug)]
pub struct TruthWriter {
    folder: PathBuf,
    keep: Keep,
    tum: Option<TumWriter>,
}

/// One camera of one frame.
struct CameraCapture<'a> {
    camera: usize,
    timestamp_ns: u64,
    session: &'a Session,
    frame: &'a Frame,
}

impl TruthWriter {
    /// Makes the folders of what is kept inside the run's.
    pub fn create(folder: &Path, keep: &Keep, setup: &Setup) -> Result<Self, Error> {
        if setup.world.scene().is_none() {
            keep.check_for_pictures(setup.world.has_depth())?;
        }
        for kept in keep.all() {
            for leaf in kept.folders(setup.cameras.len()) {
                make_folder(&folder.join(leaf))?;
            }
        }
        let tum = if keep.has(KeptOutput::Tum) { Some(TumWriter::create(&folder.join("tum"))?) } else { None };
        Ok(Self { folder: folder.to_owned(), keep: keep.clone(), tum })
    }

    /// Writes what is kept of one frame, which must be the run's last so far.
    pub fn add_frame(&mut self, session: &Session, frame: &Frame) -> Result<(), Error> {
        let timestamp_ns = u64_half_even(frame.t_s * 1e9);
        for (camera, seen) in frame.cameras.iter().enumerate() {
            let capture = CameraCapture { camera, timestamp_ns, session, frame };
            self.stages(&capture, seen)?;
            self.geometry(&capture)?;
        }
        Ok(())
    }

    /// Lists inertial readings where a folder takes them.
    pub fn add_readings(&mut self, readings: &[ImuSample]) -> Result<(), Error> {
        self.tum.as_mut().map_or(Ok(()), |tum| tum.add_readings(readings))
    }

    /// Writes what is still in memory, and what the numbers mean.
    pub fn finish(self, setup: &Setup) -> Result<(), Error> {
        if let Some(tum) = self.tum {
            tum.finish()?;
        }
        if self.keep.is_empty() {
            return Ok(());
        }
        write(&self.folder.join("ground_truth.json"), index::text(&self.keep, setup)?)
    }

    fn path(&self, folder: &str, capture: &CameraCapture<'_>, extension: &str) -> PathBuf {
        let camera = format!("cam{}", capture.camera);
        self.folder.join(folder).join(camera).join(format!("{}.{extension}", capture.timestamp_ns))
    }

    /// What stages before the codes made.
    fn stages(&self, capture: &CameraCapture<'_>, seen: &CameraFrame) -> Result<(), Error> {
        if self.keep.has(KeptOutput::Photons) {
            write_exr(&self.path("photons", capture, "exr"), [("Y", (*seen.photons).clone())])?;
        }
        if let Some(electrons) = seen.electrons.as_ref().filter(|_| self.keep.has(KeptOutput::Electrons)) {
            write_exr(&self.path("electrons", capture, "exr"), [("Y", electrons.clone())])?;
        }
        if self.keep.has(KeptOutput::Codes) {
            write_grey_16(&self.path("codes", capture, "png"), &seen.codes)?;
        }
        if self.keep.has(KeptOutput::Colour) {
            write_exr(
                &self.path("colour", capture, "exr"),
                capture.session.colour(capture.frame.frame, capture.camera)?,
            )?;
        }
        Ok(())
    }

    /// What the scene's shape and the motion imply.
    fn geometry(&mut self, capture: &CameraCapture<'_>) -> Result<(), Error> {
        let (session, camera) = (capture.session, capture.camera);
        let setup = session.setup();
        // The motion was checked to cover the whole run before the first frame.
        let pose = |t_s: f64| setup.motion.world_from_body(t_s).expect("the motion covers the run");
        let view = session.view(capture.frame.frame, camera, &pose);
        if self.keep.has(KeptOutput::Poses) {
            write(&self.path("poses", capture, "csv"), encode::pose_table(&view))?;
        }
        let has_tum_depth = self.tum.is_some() && camera == 0;
        if !has_tum_depth && !self.keep.needs_surfaces() {
            return Ok(());
        }
        let Some(scene) = setup.world.dynamic_scene() else { return self.picture_depth(capture) };
        let scene = scene.shapes();
        let seen = surfaces(scene, &view);
        self.shape(capture, scene, &view, &seen)?;
        if let Some(tum) = self.tum.as_mut().filter(|_| camera == 0) {
            let world_from_camera = capture.frame.truth.then(&setup.cameras[0].body_from_camera);
            let codes = &capture.frame.cameras[0].codes;
            let depth = encode::depth_steps(&seen.depth_m(&view));
            tum.add_frame(capture.timestamp_ns, codes, setup.sensor.bits(), &depth, &world_from_camera)?;
        }
        let next = FrameIndex(capture.frame.frame.0 + 1);
        if next.0 < setup.frames && (self.keep.has(KeptOutput::Flow) || self.keep.has(KeptOutput::Visibility)) {
            let found = matches(scene, &view, &seen, &session.view(next, camera, &pose));
            self.to_next(capture, found)?;
        }
        if self.keep.has(KeptOutput::Stereo) {
            for other in 0..setup.cameras.len() {
                if (camera == 0) != (other == 0) {
                    let found = matches(scene, &view, &seen, &session.view(capture.frame.frame, other, &pose));
                    self.to_other(capture, other, found)?;
                }
            }
        }
        Ok(())
    }

    /// Depth of a world of pictures, which have no other shape.
    fn picture_depth(&self, capture: &CameraCapture<'_>) -> Result<(), Error> {
        if !self.keep.has(KeptOutput::Depth) {
            return Ok(());
        }
        let (setup, frame) = (capture.session.setup(), capture.frame);
        let depth_m = setup.world.depth((capture.camera, &setup.cameras[capture.camera]), frame.t_s)?;
        let depth_m = depth_m.expect("a world without depth was refused when the folder was made");
        write_grey_16(&self.path("depth", capture, "png"), &encode::depth_steps(&depth_m))?;
        write_exr(&self.path("depth", capture, "exr"), [("Z", depth_m)])
    }

    fn shape(
        &self,
        capture: &CameraCapture<'_>,
        scene: Shapes<'_>,
        view: &TruthView<'_>,
        seen: &Surfaces,
    ) -> Result<(), Error> {
        if self.keep.has(KeptOutput::Depth) {
            let depth_m = seen.depth_m(view);
            write_grey_16(&self.path("depth", capture, "png"), &encode::depth_steps(&depth_m))?;
            write_exr(&self.path("depth", capture, "exr"), [("Z", depth_m), ("range", seen.range_m())])?;
        }
        if self.keep.has(KeptOutput::Normals) {
            let [x, y, z] = seen.normals(scene, view);
            write_exr(&self.path("normals", capture, "exr"), [("normal.X", x), ("normal.Y", y), ("normal.Z", z)])?;
        }
        if self.keep.has(KeptOutput::Materials) {
            let numbers = seen.materials(scene).map(|number| u16::try_from(number).unwrap_or(u16::MAX));
            write_grey_16(&self.path("materials", capture, "png"), &numbers)?;
        }
        if self.keep.has(KeptOutput::Objects) {
            let instance = |number: u32| scene.object(number).map_or(0, |object| object.instance);
            let numbers = seen.object.map(|number| u16::try_from(instance(number)).unwrap_or(u16::MAX));
            write_grey_16(&self.path("objects", capture, "png"), &numbers)?;
        }
        Ok(())
    }

    fn to_next(&self, capture: &CameraCapture<'_>, found: Matches) -> Result<(), Error> {
        if self.keep.has(KeptOutput::Visibility) {
            write_grey_8(&self.path("visibility", capture, "png"), &codes_of(&found.seen))?;
        }
        if self.keep.has(KeptOutput::Flow) {
            encode::write_flow_16(&self.path("flow", capture, "png"), &found)?;
            write_exr(&self.path("flow", capture, "exr"), [("forward.u", found.dx_px), ("forward.v", found.dy_px)])?;
        }
        Ok(())
    }

    fn to_other(&self, capture: &CameraCapture<'_>, other: usize, found: Matches) -> Result<(), Error> {
        let folder = self.folder.join("stereo").join(keep::pair(capture.camera, other));
        let name = |extension: &str| folder.join(format!("{}.{extension}", capture.timestamp_ns));
        write_grey_8(&name("png"), &codes_of(&found.seen))?;
        write_exr(&name("exr"), [("disparity.x", found.dx_px), ("disparity.y", found.dy_px)])
    }
}

fn codes_of(seen: &Plane<Visibility>) -> Plane<u8> {
    seen.map(|seen| match seen {
        Visibility::Nothing => 0,
        Visibility::Visible => 1,
        Visibility::Occluded => 2,
        Visibility::Outside => 3,
        Visibility::Unsettled => 4,
    })
}

fn write_exr(path: &Path, channels: impl IntoIterator<Item = (&'static str, Plane<f32>)>) -> Result<(), Error> {
    let named = |(name, plane): (&str, Plane<f32>)| Channel { name: name.to_owned(), plane };
    let channels: Vec<Channel> = channels.into_iter().map(named).collect();
    write(path, to_exr(&channels)?)
}
