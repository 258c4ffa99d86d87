//! Reads the lists beside pictures: times in seconds from the first picture, intrinsics, and file names.
//!
//! Times are read as whole nanoseconds, so that stamps of 1.5e9 s keep their last digits when the first is taken away.

use crate::error::Error;
use crate::num::{f64_from_i64, i64_half_even};

/// Nanoseconds of a second.
const NS_PER_S: i64 = 1_000_000_000;

/// Digits of a number in a file's name at most; longer ones are time stamps.
const NUMBER_DIGITS_MAX: usize = 9;

/// Times, and names where the list has them.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageList {
    /// The first time as the list has it, in nanoseconds.
    pub first_ns: i64,
    /// Seconds after the first, rising.
    pub times_s: Vec<f64>,
    /// One a time, or none at all.
    pub names: Vec<String>,
    /// Lines that were left out because they repeat a time.
    pub repeated: usize,
}

/// In which unit a list has its times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeUnit {
    /// As `rgb.txt` of TUM.
    Seconds,
    /// As `data.csv` of EuRoC.
    Nanoseconds,
}

fn refused(file: &str, line: usize, reason: impl std::fmt::Display) -> Error {
    Error::content(file, format!("line {line}: {reason}"))
}

/// Reads lines `time` or `time name`, apart by blanks or commas. `#` starts a comment, and a first line of words is a heading; one
/// that says `[ns]` or `_ns` changes the unit. Of repeated times the first is kept. Fails on a time that is no number, or goes back;
/// lines with a name among lines without; no line.
pub fn parse(file: &str, text: &str, mut unit: TimeUnit) -> Result<ImageList, Error> {
    let mut rows: Vec<(i64, Option<String>)> = Vec::new();
    let mut repeated = 0;
    for (index, line) in text.lines().enumerate() {
        let (number, line) = (index + 1, line.trim());
        let mut fields = line.split([',', ';', ' ', '\t']).filter(|field| !field.is_empty());
        let Some(first) = fields.next() else { continue };
        if first.starts_with('#') || (rows.is_empty() && first.starts_with(char::is_alphabetic)) {
            if line.contains("[ns]") || line.contains("_ns") {
                unit = TimeUnit::Nanoseconds;
            }
            continue;
        }
        let Some(time_ns) = nanoseconds(first, unit) else {
            return Err(refused(file, number, format!("'{first}' is not a time")));
        };
        let name = fields.next().map(str::to_owned);
        match rows.last() {
            Some((last_ns, _)) if *last_ns == time_ns => repeated += 1,
            Some((last_ns, _)) if time_ns < *last_ns => {
                let back_s = f64_from_i64(last_ns - time_ns) * 1e-9;
                return Err(refused(file, number, format!("time goes back by {back_s} s; use rising times")));
            }
            Some((_, last)) if last.is_some() != name.is_some() => {
                return Err(refused(file, number, "use a name on every line, or on none"));
            }
            _ => rows.push((time_ns, name)),
        }
    }
    let Some(first_ns) = rows.first().map(|(time_ns, _)| *time_ns) else {
        return Err(refused(file, 1, "there is no time; use one time per line"));
    };
    let times_s = rows.iter().map(|(time_ns, _)| f64_from_i64(time_ns - first_ns) * 1e-9).collect();
    Ok(ImageList { first_ns, times_s, names: rows.into_iter().filter_map(|(_, name)| name).collect(), repeated })
}

/// Times beyond this are mistakes (the year 2096), and below it no difference overflows.
const TIME_NS_MAX: i64 = 4_000_000_000_000_000_000;

/// A decimal number as whole nanoseconds; digits beyond are cut.
fn nanoseconds(text: &str, unit: TimeUnit) -> Option<i64> {
    parsed_ns(text, unit).filter(|time_ns| (-TIME_NS_MAX..=TIME_NS_MAX).contains(time_ns))
}

fn parsed_ns(text: &str, unit: TimeUnit) -> Option<i64> {
    let is_plain = text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    match unit {
        _ if !is_plain => {
            let value: f64 = text.parse().ok()?;
            let per_unit = if unit == TimeUnit::Seconds { 1e9 } else { 1.0 };
            (value * per_unit).abs().lt(&9e18).then(|| i64_half_even(value * per_unit))
        }
        TimeUnit::Nanoseconds => text.split('.').next()?.parse().ok(),
        TimeUnit::Seconds => {
            let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
            let whole: i64 = if whole.is_empty() { 0 } else { whole.parse().ok()? };
            let digits: String = fraction.bytes().map(char::from).chain("000000000".chars()).take(9).collect();
            whole.checked_mul(NS_PER_S)?.checked_add(digits.parse().ok()?)
        }
    }
}

/// Times of pictures at a rate: by the numbers at the end of their names, so that missing pictures leave their time empty, or by their
/// order where a name has none, or a number of more than nine digits. Fails on two pictures of one number.
pub fn at_rate(files: &[String], rate_hz: f64) -> Result<Vec<f64>, Error> {
    let numbers: Option<Vec<u32>> = files.iter().map(|file| number_of(file)).collect();
    let in_order = || (0..files.len()).map(crate::num::u32_from).collect();
    let numbers: Vec<u32> = numbers.unwrap_or_else(in_order);
    if let Some(first) = numbers.windows(2).position(|pair| pair[1] <= pair[0]) {
        let reason = format!("its number is not above that of {}; use rising numbers", files[first]);
        return Err(Error::content(&files[first + 1], reason));
    }
    Ok(numbers.iter().map(|&number| f64::from(number - numbers[0]) / rate_hz).collect())
}

fn number_of(file: &str) -> Option<u32> {
    let stem = file.rsplit('/').next()?.rsplit_once('.')?.0;
    let digits = stem.len() - stem.trim_end_matches(|letter: char| letter.is_ascii_digit()).len();
    (digits <= NUMBER_DIGITS_MAX).then(|| stem[stem.len() - digits..].parse().ok()).flatten()
}

/// Focal lengths and principal point (fx, fy, cx, cy) of a 3 x 3 matrix, row by row. Fails on other than nine numbers, focal lengths that
/// are not positive, or a matrix that is none of intrinsics.
pub fn intrinsics_of_matrix(file: &str, text: &str) -> Result<[f64; 4], Error> {
    let refused = |reason: &str| Error::content(file, reason);
    let fields = text.split([',', ';', ' ', '\t', '\n', '\r', '[', ']']).filter(|field| !field.is_empty());
    let numbers: Result<Vec<f64>, _> = fields.map(str::parse).collect();
    let numbers = numbers.map_err(|_| refused("holds something else than numbers; use a 3 x 3 matrix"))?;
    let [fx_px, skew, cx_px, zero, fy_px, cy_px, below, beside, one] = numbers[..] else {
        return Err(refused("does not hold nine numbers; use a 3 x 3 matrix"));
    };
    if !numbers.iter().all(|number| number.is_finite()) || fx_px <= 0.0 || fy_px <= 0.0 {
        return Err(refused("has a focal length that is not positive and finite"));
    }
    if [skew, zero, below, beside] != [0.0; 4] || one != 1.0 {
        return Err(refused("is not of the form [fx 0 cx; 0 fy cy; 0 0 1]"));
    }
    Ok([fx_px, fy_px, cx_px, cy_px])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(text: &str, unit: TimeUnit) -> Result<ImageList, Error> {
        parse("list", text, unit)
    }

    #[test]
    fn lists_of_three_kinds_are_read_to_the_nanosecond() {
        let tum = "# color images\n# timestamp filename\n1305031102.175304 rgb/1.png\n1305031102.211214 rgb/2.png\n";
        let tum = times(tum, TimeUnit::Seconds).unwrap();
        assert_eq!(tum.names, ["rgb/1.png", "rgb/2.png"]);
        // Whole nanoseconds times 1e-9: one rounding.
        assert!((tum.times_s[1] - 0.035_910).abs() < 1e-17, "{:?}", tum.times_s);
        let euroc = "#timestamp [ns],filename\n1403636579763555584,a.png\n1403636579813555456,b.png\n";
        let euroc = times(euroc, TimeUnit::Nanoseconds).unwrap();
        assert!((euroc.times_s[1] - 0.049_999_872).abs() < 1e-17);
        let own = times("time_s\n0\n.5\n1e0\n", TimeUnit::Seconds).unwrap();
        assert_eq!((own.times_s.as_slice(), own.names.len()), ([0.0, 0.5, 1.0].as_slice(), 0));
        assert_eq!(times("t_ns\n5000000000\n6000000000\n", TimeUnit::Seconds).unwrap().times_s, [0.0, 1.0]);
        let repeated = times("1 a\n1 b\n2 c\n", TimeUnit::Seconds).unwrap();
        assert_eq!((repeated.names, repeated.repeated), (vec!["a".to_owned(), "c".to_owned()], 1));
    }

    #[test]
    fn bad_lists_are_refused_by_line() {
        let mut tried = 0;
        for (text, line) in [
            ("1\n0.5\n", 2),
            ("1 a\n2\n", 2),
            ("1\nx\n", 2),
            ("\n# nothing\n", 1),
            ("1\nNaN\n", 2),
            ("99999999999999999999\n", 1),
        ] {
            let error = times(text, TimeUnit::Seconds).unwrap_err().to_string();
            assert!(error.contains(&format!("line {line}:")), "{text:?}: {error}");
            tried += 1;
        }
        assert_eq!(tried, 6);
    }

    #[test]
    fn numbers_in_names_keep_the_time_of_missing_pictures() {
        let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        assert_eq!(at_rate(&names(&["f/00003.png", "f/00004.png", "f/00008.png"]), 10.0).unwrap(), [0.0, 0.1, 0.5]);
        assert_eq!(at_rate(&names(&["a.png", "b.png"]), 2.0).unwrap(), [0.0, 0.5]);
        assert_eq!(at_rate(&names(&["1403636579763555584.png", "1403636579813555456.png"]), 2.0).unwrap(), [0.0, 0.5]);
        assert!(at_rate(&names(&["a1.png", "b1.png"]), 2.0).unwrap_err().to_string().contains("b1.png"));
    }

    #[test]
    fn a_matrix_of_intrinsics_is_nothing_else() {
        let good = "4.955e+02 0.0 2.695e+02\n0 4.954e+02 1.69e+02\n0 0 1\n";
        assert_eq!(intrinsics_of_matrix("K.txt", good).unwrap(), [495.5, 495.4, 269.5, 169.0]);
        let mut tried = 0;
        for bad in [
            "",
            "1 2 3",
            "500 1 2 0 500 3 0 0 1",
            "-500 0 2 0 500 3 0 0 1",
            "nan 0 2 0 500 3 0 0 1",
            "a b c d e f g h i",
        ] {
            assert!(intrinsics_of_matrix("K.txt", bad).unwrap_err().to_string().contains("K.txt"), "{bad}");
            tried += 1;
        }
        assert_eq!(tried, 6);
    }
}
