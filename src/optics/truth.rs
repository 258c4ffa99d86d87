//! Ground truth of a picture: for the centre of every pixel, the surface that it sees, its range and normal, and where another camera or a
//! later frame sees the same point.
//!
//! A row's truth belongs to the middle of its exposure, so under a rolling shutter every row has its own pose. Everything goes
//! through `Lens::project` and `Lens::unproject`, in f64 but for the search for the triangle; a pixel without a bearing has no truth.

mod matching;
mod surface;
mod view;

pub use matching::{Matches, Visibility, matches};
pub use surface::{Surfaces, surfaces};

pub use view::TruthView;
