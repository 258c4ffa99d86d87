//! Writes `characterization.html`: one self-contained page without scripts or network. Every number on it stands in `characterization.json`
//! as well.

use maud::{Markup, html};

use super::Characterization;
use super::defects::Histogram;
use super::map::map;
use super::measure::{PhotonTransfer, TransferPoint};
use super::record::Figure;
use crate::config::inherited::Inherited;
use crate::num::{f64_from_u64, f64_from_usize};
use crate::report::chart::{Axes, Ink, Series, SeriesShape, chart};
use crate::report::html::{document, pair, section};

/// The whole page.
pub fn html(record: &Characterization) -> String {
    let body = html! {
        (header(record))
        main {
            (pair(transfer(record), noise_ratio(record)))
            (figures(record))
            (pair(linearity(record), deviations(record)))
            (pair(dark_mean(record), dark_variance(record)))
            (pair(differential(record), integral(record)))
            (maps(record))
            (pair(profiles(record, true), profiles(record, false)))
            (pair(spectra(record, true), spectra(record, false)))
            (pair(
                histogram(&record.dark_histogram, "Dark signal of pixels", "deviation from the mean in DN"),
                histogram(&record.response_histogram, "Response of pixels, 5 x 5 high pass", "deviation in %"),
            ))
            (configuration(record))
        }
        (footer(" \u{b7} every number on this page stands in characterization.json"))
    };
    document(&format!("{} \u{b7} EMVA 1288", record.name), body).into_string()
}

/// `source` says where the page's numbers stand.
pub(super) fn footer(source: &str) -> Markup {
    html! { footer { "sensel " (env!("CARGO_PKG_VERSION")) (source) } }
}

/// A table that scrolls sideways where it is too wide.
pub(super) fn scrolled(heads: Markup, rows: Markup) -> Markup {
    html! { div.scroll tabindex="0" { table { thead { tr { (heads) } } tbody { (rows) } } } }
}

fn header(record: &Characterization) -> Markup {
    let set = &record.set;
    let longest_s = set.points.last().map_or(0.0, super::set::SeriesExposure::exposure_s);
    let mut chips = vec![
        format!("{} \u{d7} {} px, {} bit", set.size.width_px, set.size.height_px, set.bits),
        format!("{} points, two bright and two dark frames each", set.points.len()),
        format!("stacks of {} frames", set.stack),
        format!("exposures up to {longest_s:.4} s"),
        format!("seed {}, die {}", record.seed, record.die),
    ];
    if !set.channel.is_whole() {
        chips.insert(0, format!("pixels of filter {}", set.channel.name()));
    }
    chips.extend(record.reading.map(str::to_owned));
    let filter = if set.channel.is_whole() { "" } else { " before its filter" };
    let limit = if longest_s > 1.000_001 * set.exposure_limit_s {
        format!(
            " Exposures go beyond the sequencer's longest of {:.4} s, as with a lengthened frame, so that dark current shows.",
            set.exposure_limit_s
        )
    } else {
        String::new()
    };
    let lead = format!(
        "Measured on simulated frames under uniform light of {:.4e} photons per pixel and second{filter}, \
         all effects of the sensor on.{limit}",
        set.photons_per_s
    );
    html! {
        header.top {
            p.kicker { "EMVA 1288 release 4.0" }
            h1 { (record.name) }
            p { (lead) }
            ul.chips { @for chip in chips { li { (chip) } } }
        }
    }
}

pub(super) fn dots(name: &str, ink: Ink, points: Vec<(f64, f64)>) -> Series<'_> {
    Series { name, ink, shape: SeriesShape::Dots, runs: vec![points] }
}

pub(super) fn line(name: &str, ink: Ink, points: Vec<(f64, f64)>) -> Series<'_> {
    Series { name, ink, shape: SeriesShape::Line(2), runs: vec![points] }
}

fn points_of(record: &Characterization, of: impl Fn(&TransferPoint) -> (f64, f64)) -> Vec<(f64, f64)> {
    record.summary.transfer.points.iter().map(of).collect()
}

fn transfer(record: &Characterization) -> Markup {
    let transfer = &record.summary.transfer;
    let shot = |point: &TransferPoint| (point.signal_dn(), point.variance_dn2 - point.dark_variance_dn2);
    let k = record.measured("K");
    let last = transfer.sensitivity().last().map_or(0.0, TransferPoint::signal_dn);
    let full = &transfer.points[transfer.saturation()];
    let axes = Axes {
        title: "Photon transfer",
        x_label: "signal in DN",
        y_label: "variance less dark in DN\u{b2}",
        ..Axes::default()
    };
    let slope = format!("K = {k:.5} DN/e-, up to 70 %");
    let series = [
        dots("measured", Ink::One, points_of(record, shot)),
        line(&slope, Ink::Two, vec![(0.0, 0.0), (last, k * last)]),
        dots("saturation: greatest variance", Ink::Three, vec![shot(full)]),
    ];
    let lead = "Shot noise grows in proportion to the signal; the slope is the overall gain K, the peak is saturation.";
    section("Photon transfer", lead, chart(&axes, &series))
}

/// Temporal SNR as measured, its formula from the measured figures, the total with patterns, and the limit of an ideal sensor.
fn noise_ratio(record: &Characterization) -> Markup {
    let of = |name: &str| record.measured(name);
    let efficiency = of("QE") / 100.0;
    let noise_e2 = of("sigma_y_dark") * of("sigma_y_dark") / (of("K") * of("K"));
    let squared = |name: &str| if of(name).is_finite() { of(name) * of(name) } else { 0.0 };
    let (dsnu_e2, prnu2) = (squared("DSNU1288"), squared("PRNU1288") * 1e-4);
    let measured = |point: &TransferPoint| (point.photons, point.signal_dn() / point.variance_dn2.sqrt());
    let curve = |of: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
        let (Some(first), Some(last)) = (record.set.points.first(), record.set.points.last()) else {
            return Vec::new();
        };
        let decades = libm::log10(last.photons / first.photons);
        (0..=60)
            .map(|step| first.photons * libm::pow(10.0, decades * f64::from(step) / 60.0))
            .map(|x| (x, of(x)))
            .collect()
    };
    let temporal = |photons: f64| efficiency * photons / (noise_e2 + efficiency * photons).sqrt();
    let total = |photons: f64| {
        let signal_e = efficiency * photons;
        signal_e / (noise_e2 + dsnu_e2 + signal_e + prnu2 * signal_e * signal_e).sqrt()
    };
    let axes = Axes {
        title: "SNR over photons",
        x_label: "photons per pixel",
        y_label: "SNR",
        x_log: true,
        y_log: true,
        ..Axes::default()
    };
    let below: Vec<(f64, f64)> =
        points_of(record, measured).into_iter().filter(|(photons, _)| *photons <= of("u_p_sat")).collect();
    let series = [
        line("ideal sensor: sqrt(photons)", Ink::Three, curve(&|photons| photons.sqrt())),
        line("temporal, from the figures", Ink::Two, curve(&temporal)),
        line("total, with DSNU and PRNU", Ink::Four, curve(&total)),
        dots("measured up to saturation", Ink::One, below),
    ];
    section("Signal-to-noise ratio", "How far the sensor is from counting every photon.", chart(&axes, &series))
}

fn linearity(record: &Characterization) -> Markup {
    let r = record.measured("R");
    let last = record.summary.transfer.sensitivity().last().map_or(0.0, |point| point.photons);
    let axes =
        Axes { title: "Signal over photons", x_label: "photons per pixel", y_label: "signal in DN", ..Axes::default() };
    let slope = format!("R = {r:.5} DN/photon, up to 70 %");
    let series = [
        dots("measured", Ink::One, points_of(record, |point| (point.photons, point.signal_dn()))),
        line(&slope, Ink::Two, vec![(0.0, 0.0), (last, r * last)]),
    ];
    section("Sensitivity", "Mean signal less dark; its slope is the responsivity R.", chart(&axes, &series))
}

fn deviations(record: &Characterization) -> Markup {
    let transfer = &record.summary.transfer;
    let fitted = transfer.linear(transfer.saturation());
    let found = PhotonTransfer::deviations(fitted, fitted);
    let points: Vec<(f64, f64)> =
        fitted.iter().zip(found).map(|(point, deviation)| (point.photons, deviation)).collect();
    let axes =
        Axes { title: "Linearity error", x_label: "photons per pixel", y_label: "deviation in %", ..Axes::default() };
    let ends = [points.first(), points.last()].into_iter().flatten().map(|point| (point.0, 0.0)).collect();
    let series = [line("no deviation", Ink::Two, ends), dots("measured", Ink::One, points)];
    let lead = "Relative deviation from the line of least relative deviation, 5 to 95 % of saturation.";
    section("Linearity", lead, chart(&axes, &series))
}

/// At most a thousand points: of each run of codes that one stands for, the value farthest from 0.
fn thinned(values: &[f64]) -> Vec<(f64, f64)> {
    let run = values.len().div_ceil(1000).max(1);
    let farthest = |run: &[f64]| {
        run.iter().copied().fold(0.0, |most: f64, value: f64| if value.abs() > most.abs() { value } else { most })
    };
    let point = |(index, part): (usize, &[f64])| (f64_from_usize(index * run), farthest(part));
    values.chunks(run).enumerate().map(point).collect()
}

fn differential(record: &Characterization) -> Markup {
    let found = &record.linearity;
    let axes = Axes { title: "DNL", x_label: "code above the lowest", y_label: "DNL in LSB", ..Axes::default() };
    let lead = format!(
        "Width of each code less 1, by the histogram of a ramp (IEEE 1241) through one column's converter without noise: \
         {:+.3} to {:+.3} LSB, known to {:.3} LSB; {} missing codes.",
        found.dnl_lsb[0], found.dnl_lsb[1], found.error_lsb, found.missing_codes
    );
    section("Converter: codes", &lead, chart(&axes, &[line("DNL", Ink::One, thinned(&record.density.dnl_lsb))]))
}

fn integral(record: &Characterization) -> Markup {
    let found = &record.linearity;
    let axes = Axes { title: "INL", x_label: "code above the lowest", y_label: "INL in LSB", ..Axes::default() };
    let bits =
        found.enob_bits.map_or("none below 4 bits".to_owned(), |bits| format!("{bits:.2} of {} bits", found.bits));
    let lead = format!(
        "Distance of each transition from the line through the first and the last: {:+.3} to {:+.3} LSB. Effective bits of a \
         full-scale sine: {bits}.",
        found.inl_lsb[0], found.inl_lsb[1]
    );
    section("Converter: ramp", &lead, chart(&axes, &[line("INL", Ink::One, thinned(&record.density.inl_lsb))]))
}

fn dark_chart(record: &Characterization, title: &str, label: &str, of: impl Fn(&TransferPoint) -> f64) -> Markup {
    let points = points_of(record, |point| (point.exposure_ns * 1e-6, of(point)));
    let (slope, offset) = super::fits::line(&points);
    let ends = [points.first(), points.last()].into_iter().flatten().map(|&(x, _)| (x, slope * x + offset)).collect();
    let axes = Axes { title, x_label: "exposure in ms", y_label: label, ..Axes::default() };
    chart(&axes, &[dots("measured", Ink::One, points), line("fit", Ink::Two, ends)])
}

fn dark_mean(record: &Characterization) -> Markup {
    let drawn = dark_chart(record, "Dark signal over exposure", "dark signal in DN", |point| point.dark_mean_dn);
    section("Dark signal", "Its slope over exposure time is the dark current.", drawn)
}

fn dark_variance(record: &Characterization) -> Markup {
    let drawn = dark_chart(record, "Dark noise over exposure", "variance in DN\u{b2}", |point| point.dark_variance_dn2);
    section("Dark noise", "Its offset is the temporal dark noise; its slope again the dark current.", drawn)
}

fn maps(record: &Characterization) -> Markup {
    let one = |values: &[f64], what: &str, unit: &str| {
        let squares: f64 = values.iter().map(|value| value * value).sum();
        let sigma = (squares / f64_from_usize(values.len())).sqrt();
        let limit = if sigma > 0.0 { 3.0 * sigma } else { 1.0 };
        let caption = format!("{what}: black to white is \u{b1}{limit:.3} {unit}, three standard deviations");
        map(values, record.set.size, limit, &caption)
    };
    let drawn = pair(
        one(&record.dark_map_dn, "Mean dark frame", "DN"),
        one(&record.response_map_percent, "Response at half saturation", "%"),
    );
    section(
        "Non-uniformity",
        "Mean of the stacks: what stays from frame to frame. What temporal noise is left of it is taken off in the figures.",
        drawn,
    )
}

fn profiles(record: &Characterization, is_dark: bool) -> Markup {
    let (values, heading, label) = if is_dark {
        (&record.dark_map_dn, "Dark profiles", "deviation in DN")
    } else {
        (&record.response_map_percent, "Response profiles", "deviation in %")
    };
    let (across, down) = record.profiles(values);
    let points = |means: Vec<f64>| (0_u32..).zip(means).map(|(number, mean)| (f64::from(number), mean)).collect();
    let axes = Axes { title: heading, x_label: "column or row", y_label: label, ..Axes::default() };
    let series = [
        line("horizontal: means of columns", Ink::One, points(across.mean)),
        line("vertical: means of rows", Ink::Two, points(down.mean)),
    ];
    section(heading, "Means of columns and of rows about the mean of all.", chart(&axes, &series))
}

/// A spectrogram over cycles a pixel, without its value at 0.
pub(super) fn over_frequency(power: Vec<f64>) -> Vec<(f64, f64)> {
    let last = 2.0 * f64_from_usize(power.len() - 1);
    (0_u32..).zip(power).skip(1).map(|(bin, power)| (f64::from(bin) / last, power)).collect()
}

fn spectra(record: &Characterization, is_dark: bool) -> Markup {
    let (values, heading, label) = if is_dark {
        (&record.dark_map_dn, "Dark spectrograms", "power in DN\u{b2}")
    } else {
        (&record.response_map_percent, "Response spectrograms", "power in %\u{b2}")
    };
    let points = |is_vertical: bool| over_frequency(record.spectrum(values, is_vertical));
    let axes = Axes { title: heading, x_label: "cycles a pixel", y_label: label, y_log: true, ..Axes::default() };
    let series = [line("horizontal", Ink::One, points(false)), line("vertical", Ink::Two, points(true))];
    let lead = "White patterns are flat; rows or columns that differ lift one of the two.";
    section(heading, lead, chart(&axes, &series))
}

fn histogram(found: &Histogram, heading: &str, label: &str) -> Markup {
    let counts = found.bins.iter().zip(&found.counts).map(|(&bin, &count)| (bin, f64_from_u64(count))).collect();
    // Below a hundredth of a pixel the normal says nothing and would stretch the axis.
    let normal = found.bins.iter().zip(&found.normal).map(|(&bin, &count)| (bin, count));
    let normal = normal.filter(|(_, count)| *count >= 0.3).collect();
    let axes = Axes { title: heading, x_label: label, y_label: "pixels", y_log: true, ..Axes::default() };
    let lead = format!("{} pixels lie beyond five standard deviations.", found.beyond_5_sigma);
    let series = [dots("pixels", Ink::One, counts), line("normal of the same variance", Ink::Two, normal)];
    section(heading, &lead, chart(&axes, &series))
}

/// What a figure is, for a reader of the table.
pub(super) fn meaning(name: &str) -> &'static str {
    match name {
        "K" => "overall system gain",
        "R" => "responsivity",
        "QE" => "quantum efficiency, fill factor included",
        "sigma_d" => "temporal dark noise",
        "sigma_y_dark" => "temporal dark noise at the output",
        "u_I_mean" => "dark current from the mean",
        "u_I_var" => "dark current from the variance",
        "u_e_sat" | "u_p_sat" => "saturation capacity",
        "u_e_min" | "u_p_min" => "absolute sensitivity threshold",
        "SNR_max" | "SNR_max_dB" => "greatest signal-to-noise ratio",
        "DR_dB" => "dynamic range",
        "LE_min" | "LE_max" => "linearity error",
        "x_k3_ratio" => "third cumulant over Poisson's",
        "x_rho_frame" => "correlation of noise between frames",
        "x_rho_row" => "temporal variance common to a row",
        "x_rho_col" => "temporal variance common to a column",
        _ if name.ends_with("_row") => "part of rows",
        _ if name.ends_with("_col") => "part of columns",
        _ if name.ends_with("_pixel") => "part of single pixels",
        _ if name.starts_with("DSNU") => "dark signal non-uniformity",
        _ => "photo response non-uniformity",
    }
}

/// Why some figures have no expected value, each reason once.
fn reasons(record: &Characterization) -> Markup {
    let mut reasons: Vec<&String> =
        record.figures.iter().filter_map(|(_, figure)| figure.not_expected.as_ref()).collect();
    reasons.sort();
    reasons.dedup();
    html! { @for reason in reasons { p.note { (reason) } } }
}

fn figures(record: &Characterization) -> Markup {
    let heads = html! {
        th { "figure" } th { "meaning" } th.num { "measured" } th.num { "standard error" }
        th.num { "expected, 4.5 standard errors" } th.num { "configured" }
    };
    let rows = html! {
        @for (name, figure) in record.figures.iter() { tr { th { (name) } td { (meaning(name)) } (cells(figure)) } }
    };
    section(
        "Figures",
        "Measured on the frames, with the standard error that their number leaves, beside what the configuration implies.",
        html! { (scrolled(heads, rows)) (reasons(record)) },
    )
}

fn cells(figure: &Figure) -> Markup {
    if let Some(reason) = &figure.not_measurable {
        return html! { td.note colspan="4" { "not measurable: " (reason) } };
    }
    let number = |value: Option<f64>| value.map_or(String::new(), significant);
    let want = figure.truth.clone().unwrap_or_default();
    html! {
        td.num { (number(figure.value)) " " @if figure.unit != "1" { (figure.unit) } }
        td.num { (number(figure.standard_error)) }
        td.num {
            @if let Some(reason) = &figure.not_expected {
                span.note { "nothing: " (reason.split(": ").next().unwrap_or_default()) }
            } @else if let (Some(value), Some(tolerance)) = (want.value, want.abs_tol) {
                (significant(value)) " \u{b1} " (significant(tolerance))
            } @else {
                (number(want.min)) " to " (number(want.max))
            }
        }
        td.num { (number(want.configured)) }
    }
}

/// Four significant digits.
pub(super) fn significant(value: f64) -> String {
    let size = value.abs();
    if size >= 1e6 || (size > 0.0 && size < 1e-3) {
        return format!("{value:.2e}");
    }
    let digits = [(1e3, 0), (1e2, 1), (1e1, 2), (1.0, 3)];
    let decimals = digits.into_iter().find(|(least, _)| size >= *least).map_or(4, |(_, decimals)| decimals);
    format!("{value:.decimals$}")
}

fn configuration(record: &Characterization) -> Markup {
    let lead = format!(
        "Sensor: {}. Quantum efficiency: {}. The same configuration, seed and version give the same frames.",
        record.sensor, record.efficiency
    );
    let content = html! {
        (inherited(&record.inherited))
        details { summary { "Effective configuration" } pre { (toml::to_string(&record.config).unwrap_or_default()) } }
        p.hash.note { "config " (record.config_hash) }
    };
    section("Configuration", &lead, content)
}

/// What the sensor has from presets and defaults, with the location of each value.
fn inherited(values: &[Inherited]) -> Markup {
    html! {
        details {
            summary { (values.len()) " inherited values of the sensor" }
            table {
                tbody {
                    @for Inherited { key, value, layer, line } in values {
                        tr { th scope="row" { (key) } td { (value.to_string()) } td { (layer) ":" (line) } }
                    }
                }
            }
        }
    }
}
