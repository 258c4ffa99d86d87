//! Pictures as the scene that a camera looks at, as in the paper. Reads PNG or OpenEXR files with times, and returns linear light in
//! lux-equivalents and how long each picture counts for an exposure.
//!
//! A picture has no geometry: it is light by direction, seen from one point at one time. So the only parallax inside an exposure is
//! that between neighbouring pictures, nothing is known between their times, and nothing is above their white.
//!
//! Value 1.0 is the exitance of a white surface under the scenario's illuminance. Files are read and decoded when an exposure
//! needs them, and at most [`CACHE_BYTES`] of decoded pictures are kept (or one, where it is larger: [`decode::PIXELS_MAX`] bounds it).

pub mod blend;
pub mod decode;
pub mod list;

use std::sync::{Arc, Mutex, PoisonError};

pub use blend::Blend;
pub use decode::{Picture, TransferCurve};

pub use super::source::PictureBytes;

use super::light::{BANDS, Illuminant};
use super::lit::ExitanceBounds;
use crate::error::Error;
use crate::num::{f64_from_usize, greater, lesser};
use crate::parallel::collected;
use crate::plane::Plane;
use crate::units::{Size, Span};

/// Decoded pictures that a stream keeps, in bytes.
pub const CACHE_BYTES: usize = 256 << 20;

/// The camera that the pictures were made with: a pinhole with radial-tangential distortion, looking where the sensor's camera looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureCamera {
    /// Horizontal focal length.
    pub fx_px: f64,
    /// Vertical focal length.
    pub fy_px: f64,
    /// Column of the principal point; pixel centres are integers.
    pub cx_px: f64,
    /// Row of the principal point.
    pub cy_px: f64,
    /// Radial distortion k1 and k2, tangential p1 and p2, as OpenCV has them.
    pub distortion: [f64; 4],
}

/// What the files of one camera are and mean, before any of them is decoded.
pub struct StreamParams {
    /// The pictures' files, in the order of their times.
    pub files: Vec<String>,
    /// Files with the depth of each picture; none where there is none, or where the pictures hold it.
    pub depth_files: Option<Vec<String>>,
    /// Steps of a metre in PNG files of depth.
    pub depth_per_m: f64,
    /// Time of each picture in run time, rising.
    pub times_s: Vec<f64>,
    /// What the pictures were made with.
    pub camera: PictureCamera,
    /// How their codes become light; none: by the kind of file.
    pub transfer: Option<TransferCurve>,
    /// What counts between their times.
    pub blend: Blend,
    /// Spectrum of white.
    pub illuminant: Illuminant,
    /// Illuminance under which a white surface has the value 1.
    pub white_lux: f64,
}

/// The pictures of one camera over time.
pub struct ImageStream {
    /// What its files are and mean.
    pub params: StreamParams,
    size: Size,
    /// Least and greatest value of each band, over the pictures of the run.
    range: [[f64; BANDS]; 2],
    /// Share of the values at the greatest code of their files.
    clipped_share: f64,
    has_depth: bool,
    bytes: Arc<dyn PictureBytes>,
    /// Number and content of decoded pictures, the last used one last.
    decoded: Mutex<Vec<(usize, Arc<Picture>)>>,
}

impl ImageStream {
    /// Decodes every picture that counts within `run` once: so sizes, damage and values are known before the first frame, and the planner's
    /// bounds hold. `progress` is told the share done. Fails on a picture that cannot be read, is damaged, has another size than the
    /// first, or holds a value that is no light.
    pub fn new(
        params: StreamParams,
        run: Span,
        bytes: Arc<dyn PictureBytes>,
        progress: &dyn Fn(f64),
    ) -> Result<Self, Error> {
        let counted = params.blend.weights(&params.times_s, run);
        let (first, count) = (counted.first().map_or(0, |(number, _)| *number), counted.len());
        let mut stream = Self {
            params,
            size: Size { width_px: 0, height_px: 0 },
            range: [[f64::MAX; BANDS], [0.0; BANDS]],
            clipped_share: 0.0,
            has_depth: true,
            bytes,
            decoded: Mutex::new(Vec::new()),
        };
        for number in first..first + count {
            let picture = stream.decode(number)?;
            if number == first {
                stream.size = picture.size();
            }
            stream.survey(&stream.params.files[number].clone(), &picture)?;
            progress(f64_from_usize(number + 1 - first) / f64_from_usize(count));
        }
        stream.clipped_share /= f64_from_usize(count.max(1));
        Ok(stream)
    }

    fn survey(&mut self, file: &str, picture: &Picture) -> Result<(), Error> {
        let (size, own) = (self.size, picture.size());
        if own != size {
            let own = format!("has {} x {} px", own.width_px, own.height_px);
            let first = format!("the first picture {} x {}", size.width_px, size.height_px);
            return Err(Error::content(file, format!("{own} and {first}; use pictures of one size")));
        }
        let [least, greatest] = picture.range();
        for band in 0..BANDS {
            self.range[0][band] = lesser(self.range[0][band], least[band]);
            self.range[1][band] = greater(self.range[1][band], greatest[band]);
        }
        self.clipped_share += picture.clipped_share;
        self.has_depth &= picture.depth_m.is_some();
        Ok(())
    }

    /// Width and height of the pictures.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Least and greatest light of any pixel of the run's pictures.
    pub fn exitance_bounds(&self) -> ExitanceBounds {
        let [least, greatest] = self.range.map(|corner| corner.map(|value| value * self.params.white_lux));
        ExitanceBounds { least, greatest, emitted: [0.0; BANDS] }
    }

    /// Share of the values at the end of their file's codes: light that the file clipped.
    pub fn clipped_share(&self) -> f64 {
        self.clipped_share
    }

    /// Whether every picture of the run has its depth.
    pub fn has_depth(&self) -> bool {
        self.has_depth
    }

    /// Pictures and the seconds that each counts for a span of run time, which must lie within [`Blend::covered`].
    pub fn weights(&self, span: Span) -> Vec<(usize, f64)> {
        self.params.blend.weights(&self.params.times_s, span)
    }

    /// Run time of a picture.
    pub fn time_s(&self, number: usize) -> f64 {
        self.params.times_s[number]
    }

    /// The picture nearest in time.
    pub fn nearest(&self, t_s: f64) -> usize {
        blend::nearest(&self.params.times_s, t_s)
    }

    /// How many decoded pictures are held at once.
    pub fn pictures_at_once(&self) -> usize {
        let bytes = 4 * self.size.pixel_count() * (BANDS + usize::from(self.has_depth));
        (CACHE_BYTES / bytes.max(1)).max(1)
    }

    /// These pictures, at most [`ImageStream::pictures_at_once`], decoded or from the cache. Fails on a file that changed since the run
    /// began.
    pub fn pictures(&self, numbers: &[usize]) -> Result<Vec<Arc<Picture>>, Error> {
        let mut cache = self.decoded.lock().unwrap_or_else(PoisonError::into_inner);
        let missing: Vec<usize> =
            numbers.iter().copied().filter(|number| !cache.iter().any(|(known, _)| known == number)).collect();
        // Room first, so that the bound holds while the missing ones are decoded.
        let room = self.pictures_at_once().saturating_sub(missing.len());
        while cache.len() > room {
            let Some(idle) = cache.iter().position(|(known, _)| !numbers.contains(known)) else { break };
            cache.remove(idle);
        }
        let decoded = collected(missing.len(), |missing_index| self.decode(missing[missing_index]));
        for (number, picture) in missing.iter().zip(decoded) {
            let picture = picture?;
            if picture.size() != self.size {
                let file = &self.params.files[*number];
                return Err(Error::content(file, "has another size than when the run began"));
            }
            cache.push((*number, Arc::new(picture)));
        }
        let find = |number: &usize| {
            let (_, picture) = cache.iter().find(|(known, _)| known == number).expect("decoded above");
            picture.clone()
        };
        Ok(numbers.iter().map(find).collect())
    }

    fn decode(&self, number: usize) -> Result<Picture, Error> {
        let file = &self.params.files[number];
        let mut picture = Picture::decode(file, &self.bytes.read(file)?, self.params.transfer)?;
        if let Some(files) = &self.params.depth_files {
            let depth_m = decode::depth_m(&files[number], &self.bytes.read(&files[number])?, self.params.depth_per_m)?;
            picture = picture.with_depth(&files[number], depth_m)?;
        }
        Ok(picture)
    }

    /// Depth of the picture nearest in time, on its own pixels; none where the pictures have none.
    pub fn depth_m(&self, t_s: f64) -> Result<Option<Plane<f32>>, Error> {
        let picture = &self.pictures(&[self.nearest(t_s)])?[0];
        Ok(picture.depth_m.clone())
    }
}

/// One stream a camera of the rig.
pub struct ImageSequence {
    /// In the order of the cameras.
    pub streams: Vec<ImageStream>,
}

/// A pinhole of a field of view across the whole width, its axis in the picture's middle.
pub fn pinhole(size: Size, horizontal_fov_rad: f64, distortion: [f64; 4]) -> PictureCamera {
    let (width_px, height_px) = (f64::from(size.width_px), f64::from(size.height_px));
    let focal_px = 0.5 * width_px / libm::tan(0.5 * horizontal_fov_rad);
    let (cx_px, cy_px) = (0.5 * (width_px - 1.0), 0.5 * (height_px - 1.0));
    PictureCamera { fx_px: focal_px, fy_px: focal_px, cx_px, cy_px, distortion }
}
