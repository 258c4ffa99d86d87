//! Writes the page of a fit: frames of a sensor beside those that the fitted sensor makes under the same exposures and light. One
//! self-contained page without scripts or network.

use maud::{Markup, html};

use super::analysis::{Figures, Summary, figures};
use super::fit::defective::DefectivePixels;
use super::fit::{Fitted, SensorFit, Undetermined};
use super::map::map;
use super::measure::{ChannelMeasurement, StackSums, TransferPoint, centred};
use super::page::{dots, footer, line, meaning, over_frequency, scrolled, significant};
use super::record::unit;
use super::spatial::{spectrogram, transposed};
use super::uncertainty::measured_errors;
use crate::num::{f64_from_u64, f64_from_usize, index};
use crate::report::chart::{Axes, Ink, Series, SeriesShape, chart};
use crate::report::html::{document, pair, section};
use crate::units::Size;

/// Difference in standard errors from which on a figure counts as different: a normal exceeds it in one of 16,000.
const DIFFERENT: f64 = 4.0;

/// Largest part of a frame that is drawn, from its first row and column.
const DRAWN: Size = Size { width_px: 200, height_px: 150 };

/// Most bins of a histogram of codes.
const BINS_MAX: usize = 160;

/// A fit with the frames on both sides.
pub struct Beside<'a> {
    /// Of the folder.
    pub name: &'a str,
    /// What the frames do not determine is that of this sensor.
    pub preset: &'a str,
    /// Depth of the codes.
    pub bits: u32,
    /// The parameters.
    pub fit: &'a SensorFit,
    /// Frames that were read.
    pub measured: &'a ChannelMeasurement,
    /// Frames of the fitted sensor.
    pub simulated: &'a ChannelMeasurement,
    /// Defective pixels of both sides, which are left out of everything else.
    pub defects: [&'a DefectivePixels; 2],
}

/// What both sides' frames say, with standard errors.
struct Side {
    summary: Summary,
    found: Figures,
    errors: Figures,
}

impl Side {
    fn of(measurement: &ChannelMeasurement) -> Self {
        let summary = Summary::of(measurement);
        let found = figures(&summary);
        let errors = measured_errors(&summary, &found);
        Self { summary, found, errors }
    }

    /// A figure with its standard error.
    fn get(&self, name: &str) -> Option<[f64; 2]> {
        let pair = [self.found.get(name).copied()?, self.errors.get(name).copied()?];
        pair.iter().all(|value| value.is_finite()).then_some(pair)
    }
}

/// The whole page.
pub fn html(beside: &Beside<'_>) -> String {
    let sides = [Side::of(beside.measured), Side::of(beside.simulated)];
    let body = html! {
        (header(beside))
        main {
            (parameters(beside.fit))
            (pair(transfer(&sides), signal(&sides)))
            (pair(
                over_exposure(
                    &sides,
                    ["Dark signal", "mean in DN"],
                    "Its slope is the dark current. A sensor file has a black level in whole codes: the sides may lie half a code apart.",
                    |point| point.dark_mean_dn,
                ),
                over_exposure(
                    &sides,
                    ["Dark noise", "variance in DN\u{b2}"],
                    "Its offset is the dark noise, its slope again the dark current.",
                    |point| point.dark_variance_dn2,
                ),
            ))
            (pair(
                histogram("Codes in the dark", [&beside.measured.dark, &beside.simulated.dark]),
                histogram("Codes under light", [&beside.measured.bright, &beside.simulated.bright]),
            ))
            (spectra(beside))
            (pictures(beside))
            (compared(&sides, beside.defects))
            (undetermined(beside))
        }
        (footer(""))
    };
    document(&format!("{} \u{b7} fit", beside.name), body).into_string()
}

fn header(beside: &Beside<'_>) -> Markup {
    let [real, simulated] = [beside.measured, beside.simulated].map(|side| side.dark.size);
    let mut chips = vec![
        format!("{} \u{d7} {} px, {} bit", real.width_px, real.height_px, beside.bits),
        format!("{} points of photon transfer", beside.measured.transfer.points.len()),
        format!("stacks of {} frames", beside.measured.dark.frames),
        format!("preset {}", beside.preset),
    ];
    if real != simulated {
        chips.push(format!("simulated: {} \u{d7} {} px", simulated.width_px, simulated.height_px));
    }
    html! {
        header.top {
            p.kicker { "A sensor from its frames" }
            h1 { (beside.name) }
            p {
                "The frames that were given, beside frames that another die of the fitted sensor makes under the same exposures and light."
            }
            ul.chips { @for chip in chips { li { (chip) } } }
            @for warning in &beside.fit.warnings { p.left { (warning) } }
        }
    }
}

fn parameters(fit: &SensorFit) -> Markup {
    let heads = html! { th { "key" } th.num { "value" } th.num { "95 % interval" } th { "rests on" } };
    let rows = html! {
        @for Fitted { key, value, interval: [low, high], rests_on } in &fit.fitted {
            tr {
                th scope="row" { (key) }
                td.num { (significant(*value)) }
                td.num { (significant(*low)) " to " (significant(*high)) }
                td.note { (rests_on) }
            }
        }
    };
    section("Parameters", "Determined from the frames.", scrolled(heads, rows))
}

/// Both sides' points, the simulated ones as rings.
fn both<'a>(sides: &[Side; 2], of: impl Fn(&TransferPoint) -> (f64, f64)) -> [Series<'a>; 2] {
    let [measured, simulated] = sides.each_ref().map(|side| side.summary.transfer.points.iter().map(&of).collect());
    [
        dots("measured", Ink::One, measured),
        Series { name: "simulated", ink: Ink::Two, shape: SeriesShape::Ring, runs: vec![simulated] },
    ]
}

fn transfer(sides: &[Side; 2]) -> Markup {
    let axes = Axes {
        title: "Photon transfer",
        x_label: "signal in DN",
        y_label: "variance less dark in DN\u{b2}",
        ..Axes::default()
    };
    let series = both(sides, |point| (point.signal_dn(), point.variance_dn2 - point.dark_variance_dn2));
    section("Photon transfer", "The slope is the overall gain, the peak saturation.", chart(&axes, &series))
}

fn signal(sides: &[Side; 2]) -> Markup {
    let axes =
        Axes { title: "Signal over exposure", x_label: "exposure in ms", y_label: "signal in DN", ..Axes::default() };
    let series = both(sides, |point| (point.exposure_ns * 1e-6, point.signal_dn()));
    section("Signal", "Mean under light less mean in the dark.", chart(&axes, &series))
}

fn over_exposure(
    sides: &[Side; 2],
    [heading, label]: [&str; 2],
    lead: &str,
    of: impl Fn(&TransferPoint) -> f64,
) -> Markup {
    let axes = Axes { title: heading, x_label: "exposure in ms", y_label: label, ..Axes::default() };
    let series = both(sides, |point| (point.exposure_ns * 1e-6, of(point)));
    section(heading, lead, chart(&axes, &series))
}

/// Shares of all codes of a stack, in bins of whole codes. Codes beyond the range of either side's last thousandth are left out.
fn histogram(heading: &str, stacks: [&StackSums; 2]) -> Markup {
    let [low, high] = span(stacks);
    let width = (high - low + 1).div_ceil(BINS_MAX);
    let binned = |stack: &StackSums| -> Vec<(f64, f64)> {
        let counts = stack.counts();
        let total = f64_from_u64(counts.iter().sum());
        let bins = (low..=high).step_by(width);
        let share = |start: usize| {
            let end = counts.len().min(start + width);
            f64_from_u64(counts.get(start..end).unwrap_or_default().iter().sum()) / total
        };
        bins.map(|start| (f64_from_usize(start), 100.0 * share(start))).collect()
    };
    let [measured, simulated] = stacks.map(binned);
    // Half of the sum of differences: the share of codes that would have to move.
    let moved = 0.5 * measured.iter().zip(&simulated).map(|(a, b)| (a.1 - b.1).abs()).sum::<f64>();
    let unit = if width == 1 { "code".to_owned() } else { format!("{width} codes") };
    let y_label = format!("% of pixels a {unit}");
    let axes = Axes { title: heading, x_label: "DN", y_label: &y_label, from_zero: true, ..Axes::default() };
    let lead =
        format!("All frames of the stack. {} % of the codes lie elsewhere in the simulated ones.", significant(moved));
    let series = [line("measured", Ink::One, measured), line("simulated", Ink::Two, simulated)];
    section(heading, &lead, chart(&axes, &series))
}

/// Codes that hold all but a thousandth at either end, of both stacks.
fn span(stacks: [&StackSums; 2]) -> [usize; 2] {
    let ends = stacks.map(|stack| {
        let counts = stack.counts();
        let tail = counts.iter().sum::<u64>() / 1000;
        // The first code by which more than the tail was seen.
        let end = |codes: &mut dyn Iterator<Item = usize>| {
            let mut seen = 0;
            for code in codes {
                seen += counts[code];
                if seen > tail {
                    return code;
                }
            }
            0
        };
        [end(&mut (0..counts.len())), end(&mut (0..counts.len()).rev())]
    });
    [ends[0][0].min(ends[1][0]), ends[0][1].max(ends[1][1])]
}

/// What a stack's frames hold, as a picture.
type Content = fn(&ChannelMeasurement) -> Vec<f64>;

fn dark_noise(side: &ChannelMeasurement) -> Vec<f64> {
    side.dark.noise_dn()
}

fn spectra(beside: &Beside<'_>) -> Markup {
    let contents: [(&str, &str, Content, &str); 3] = [
        ("Dark noise", "What differs between two dark frames.", dark_noise, "DN\u{b2}"),
        ("Dark pattern", "The mean of the dark stack.", ChannelMeasurement::dark_pattern_dn, "DN\u{b2}"),
        (
            "Response",
            "The bright stack less the dark one, in % of its mean.",
            ChannelMeasurement::response_percent,
            "%\u{b2}",
        ),
    ];
    let drawn = contents.map(|(what, lead, content, unit)| {
        let sides = [beside.measured, beside.simulated].map(|side| (content(side), index(side.dark.size.width_px)));
        pair(
            spectrum(
                &format!("{what}: spectrum along rows"),
                lead,
                unit,
                sides.each_ref().map(|(v, w)| spectrogram(v, *w)),
            ),
            spectrum(
                &format!("{what}: spectrum along columns"),
                "Rows that differ lift it.",
                unit,
                sides.each_ref().map(|(v, w)| spectrogram(&transposed(v, *w), v.len() / w)),
            ),
        )
    });
    html! { @for pair in drawn { (pair) } }
}

fn spectrum(heading: &str, lead: &str, unit: &str, sides: [Vec<f64>; 2]) -> Markup {
    let y_label = format!("power in {unit}");
    let axes = Axes { title: heading, x_label: "cycles a pixel", y_label: &y_label, y_log: true, ..Axes::default() };
    let [measured, simulated] = sides.map(over_frequency);
    let series = [line("measured", Ink::One, measured), line("simulated", Ink::Two, simulated)];
    section(heading, lead, chart(&axes, &series))
}

/// The first rows and columns of both sides' first frames and means, each pair on one scale of grey.
fn pictures(beside: &Beside<'_>) -> Markup {
    fn first(stack: &StackSums) -> Vec<f64> {
        centred(stack.first().iter().map(|&code| f64::from(code)).collect())
    }
    let contents: [(&str, &str, Content); 4] = [
        ("A dark frame", "DN", |side| first(&side.dark)),
        ("A bright frame", "DN", |side| first(&side.bright)),
        ("Mean of the dark frames", "DN", ChannelMeasurement::dark_pattern_dn),
        ("Response", "%", ChannelMeasurement::response_percent),
    ];
    let drawn = contents.map(|(what, unit, content)| {
        let sides = [beside.measured, beside.simulated].map(|side| cropped(&content(side), side.dark.size));
        let sigmas = sides.each_ref().map(|(values, _)| {
            (values.iter().map(|value| value * value).sum::<f64>() / f64_from_usize(values.len())).sqrt()
        });
        let limit = if sigmas[0] > 0.0 { 3.0 * sigmas[0] } else { 1.0 };
        let one = |side: usize, name: &str| {
            let caption = format!("{what}, {name}: standard deviation {} {unit}", significant(sigmas[side]));
            map(&sides[side].0, sides[side].1, limit, &caption)
        };
        let scale = format!("Black to white is \u{b1}{} {unit} about the mean on both sides.", significant(limit));
        section(what, &scale, html! { div.strip { (one(0, "measured")) (one(1, "simulated")) } })
    });
    let [dark, bright, mean, response] = drawn;
    html! { (pair(dark, bright)) (pair(mean, response)) }
}

/// The part that is drawn, about its own mean.
fn cropped(values: &[f64], size: Size) -> (Vec<f64>, Size) {
    let drawn = Size { width_px: size.width_px.min(DRAWN.width_px), height_px: size.height_px.min(DRAWN.height_px) };
    let rows = values.chunks_exact(index(size.width_px)).take(index(drawn.height_px));
    (centred(rows.flat_map(|row| &row[..index(drawn.width_px)]).copied().collect()), drawn)
}

/// A figure of both sides with the standard error of their difference.
struct Compared<'a> {
    name: &'a str,
    meaning: &'a str,
    unit: &'a str,
    values: [f64; 2],
    error: f64,
}

impl Compared<'_> {
    /// In standard errors.
    fn distance(&self) -> f64 {
        (self.values[1] - self.values[0]) / self.error
    }

    fn is_different(&self) -> bool {
        self.distance().abs() > DIFFERENT
    }
}

/// Defective pixels per million of both sides, by kind.
fn defects([measured, simulated]: [&DefectivePixels; 2]) -> [Compared<'static>; 4] {
    let counts: [(&str, &str, fn(&DefectivePixels) -> usize); 4] = [
        ("hot pixels", "beyond 6 sigma in the dark stack", |side| side.hot.len()),
        ("noisy pixels", "variance in the dark beyond chance", |side| side.noisy.len()),
        ("dead pixels", "a fifth of the response or less", |side| side.dead.len()),
        ("stuck pixels", "at one end of the range in all frames", |side| side.stuck.len()),
    ];
    counts.map(|(name, meaning, count)| {
        let [a, b] = [measured, simulated].map(|side| [count(side), side.pixels].map(f64_from_usize));
        let share = (a[0] + b[0]) / (a[1] + b[1]);
        let error = 1e6 * (share * (1.0 - share) * (1.0 / a[1] + 1.0 / b[1])).sqrt();
        Compared { name, meaning, unit: "ppm", values: [a, b].map(|[count, pixels]| 1e6 * count / pixels), error }
    })
}

fn compared(sides: &[Side; 2], pixels: [&DefectivePixels; 2]) -> Markup {
    let [measured, simulated] = sides;
    let figures = measured.found.iter().filter_map(|(name, _)| {
        let ([a, a_error], [b, b_error]) = (measured.get(name)?, simulated.get(name)?);
        let unit = if unit(name) == "1" { "" } else { unit(name) };
        Some(Compared { name, meaning: meaning(name), unit, values: [a, b], error: libm::hypot(a_error, b_error) })
    });
    let all: Vec<Compared<'_>> = figures.chain(defects(pixels)).filter(|figure| figure.error > 0.0).collect();
    let different = all.iter().filter(|figure| figure.is_different()).count();
    let lead = format!(
        "EMVA 1288 figures of both sides. {different} of {} differ by more than {DIFFERENT} standard errors of both; those are effects \
         that the fitted sensor does not have, or that its preset has and the frames do not. Defective pixels, last in the table, are left \
         out of all other figures of this page.",
        all.len()
    );
    let heads = html! {
        th { "figure" } th { "meaning" } th.num { "measured" } th.num { "simulated" } th.num { "standard errors apart" }
    };
    let rows = html! {
        @for figure in &all {
            tr {
                th scope="row" { (figure.name) }
                td.note { (figure.meaning) }
                @for value in figure.values { td.num { (significant(value)) " " (figure.unit) } }
                td.num.left[figure.is_different()] { (format!("{:+.1}", figure.distance())) }
            }
        }
    };
    section("Figures", &lead, scrolled(heads, rows))
}

fn undetermined(beside: &Beside<'_>) -> Markup {
    let rows = html! {
        @for Undetermined { key, reason } in &beside.fit.undetermined { tr { th scope="row" { (key) } td.note { (reason) } } }
    };
    let lead = format!("Left to the preset {}, or assumed.", beside.preset);
    section("What the frames do not determine", &lead, scrolled(html! { th { "key" } th { "why" } }, rows))
}
