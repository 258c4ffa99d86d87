//! Checks the frame, rows and columns that the user asked for against the picture.

use crate::error::Error;
use crate::num::index;
use crate::units::{FrameIndex, RowIndex, Size};

/// Most rows and columns of one file: a row of 10 bits is about half a megabyte as VCD.
const MOST: usize = 64;

/// Rows and columns of one frame, each rising.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Selection {
    /// Rows of the picture.
    pub rows: Vec<RowIndex>,
    /// Columns of the picture.
    pub columns: Vec<u32>,
    /// The frame.
    pub frame: FrameIndex,
}

/// What a user asked for; what is left out has a default.
#[derive(Clone, Copy, Debug, Default)]
pub struct Asked<'a> {
    /// As "0,1,2-5"; default: the first two rows.
    pub rows: Option<&'a str>,
    /// As "0,100,639"; default: the first, the middle and the last column.
    pub columns: Option<&'a str>,
    /// Default: the first frame.
    pub frame: Option<u32>,
}

impl Selection {
    /// Checks against the picture's size and the run's frames. Fails on what is not a list of numbers, or outside the picture or the run;
    /// the error names the option and an accepted value.
    pub fn new(asked: Asked<'_>, size: Size, frames: u32) -> Result<Self, Error> {
        let default_rows: Vec<u32> = (0..size.height_px.min(2)).collect();
        let mut default_columns = vec![0, size.width_px / 2, size.width_px - 1];
        default_columns.dedup();
        let rows = list("--wave-rows", asked.rows, default_rows, size.height_px)?;
        let columns = list("--wave-columns", asked.columns, default_columns, size.width_px)?;
        let frame = asked.frame.unwrap_or(0);
        if frame >= frames {
            let reason = format!("the run has {frames} frames; use 0 to {}", frames - 1);
            return Err(Error::key("--wave-frame", frame, reason));
        }
        Ok(Self { rows: rows.into_iter().map(RowIndex).collect(), columns, frame: FrameIndex(frame) })
    }
}

/// Numbers and spans with commas between them, sorted, each once.
fn list(option: &str, text: Option<&str>, default: Vec<u32>, bound: u32) -> Result<Vec<u32>, Error> {
    let Some(text) = text else { return Ok(default) };
    let last = bound - 1;
    let example = if last >= 5 { "0,2-5".to_owned() } else { format!("0-{last}") };
    let refuse = |reason: String| Error::key(option, text, reason);
    let number = |word: &str| {
        let parsed = word.trim().parse::<u32>();
        parsed.map_err(|_| refuse(format!("'{word}' is no number; use a list like {example}")))
    };
    let mut numbers = Vec::new();
    for part in text.split(',') {
        let (from, to) = match part.split_once('-') {
            Some((from, to)) => (number(from)?, number(to)?),
            None => (number(part)?, number(part)?),
        };
        if from > to || to > last {
            return Err(refuse(format!("{part} is out of range; use 0 to {last}")));
        }
        if index(to - from) >= MOST {
            return Err(refuse(format!("{part} are too many; use up to {MOST}")));
        }
        numbers.extend(from..=to);
    }
    numbers.sort_unstable();
    numbers.dedup();
    if numbers.len() > MOST {
        return Err(refuse(format!("these are {}; use up to {MOST}", numbers.len())));
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    const VGA: Size = Size { width_px: 640, height_px: 480 };

    #[test]
    fn lists_and_spans_are_sorted_and_defaults_are_there() {
        let asked = Asked { rows: Some("7,1, 2-5,3"), columns: Some("639,0"), frame: Some(3) };
        let found = Selection::new(asked, VGA, 4).unwrap();
        assert_eq!(found.rows, [1, 2, 3, 4, 5, 7].map(RowIndex));
        assert_eq!((found.columns, found.frame), (vec![0, 639], FrameIndex(3)));
        let found = Selection::new(Asked::default(), VGA, 1).unwrap();
        assert_eq!((found.rows, found.columns), (vec![RowIndex(0), RowIndex(1)], vec![0, 320, 639]));
        let tiny = Size { width_px: 1, height_px: 1 };
        let found = Selection::new(Asked::default(), tiny, 1).unwrap();
        assert_eq!((found.rows, found.columns), (vec![RowIndex(0)], vec![0]));
    }

    #[test]
    fn what_is_beyond_the_picture_or_no_list_is_refused_with_what_would_do() {
        let rows = |text| Selection::new(Asked { rows: Some(text), ..Asked::default() }, VGA, 1);
        let columns = |text| Selection::new(Asked { columns: Some(text), ..Asked::default() }, VGA, 1);
        let frame = Selection::new(Asked { frame: Some(1), ..Asked::default() }, VGA, 1);
        let cases = [
            (rows("480"), "--wave-rows = 480: 480 is out of range; use 0 to 479"),
            (rows("5-2"), "--wave-rows = 5-2: 5-2 is out of range"),
            (rows("0-99"), "use up to 64"),
            (rows("0-40,50-90"), "these are 82; use up to 64"),
            (rows(""), "'' is no number; use a list like 0,2-5"),
            (rows("1;2"), "'1;2' is no number"),
            (columns("640"), "--wave-columns = 640: 640 is out of range; use 0 to 639"),
            (columns("-1"), "'' is no number"),
            (frame, "--wave-frame = 1: the run has 1 frames; use 0 to 0"),
        ];
        for (found, expected) in cases {
            let error = found.unwrap_err();
            assert!(error.to_string().contains(expected), "{error}");
            assert_eq!(error.exit_code(), 2);
        }
    }
}
