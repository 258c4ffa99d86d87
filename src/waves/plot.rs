//! Draws the conversions of the first shown row as a stand-alone SVG: phases, ramp and samples, comparators, counters and codes over one
//! time axis. Letters are text; colours follow the reader's light or dark mode. All values come from the waves.

use super::signals::{Value, Waves};
use crate::num::{f64_from_i64, f64_from_u64, f64_from_usize, greater, index, lesser, u32_truncated, u64_half_even};
use crate::report::escape::{escaped, svg_text as text};

const WIDTH_PX: f64 = 960.0;
const LEFT_PX: f64 = 128.0;
const RIGHT_PX: f64 = 858.0;
/// Where headings and names of lanes begin.
const MARGIN_PX: f64 = 28.0;
/// Height of the panels of the ramp and of the counters.
const PANEL_PX: f64 = 190.0;
/// Height of a comparator's lane, and of its pulse.
const LANE_PX: f64 = 24.0;
const PULSE_PX: f64 = 14.0;
/// Most columns that are drawn: so many colours stay apart.
const MOST_COLUMNS: usize = 6;
/// Points of a curve: more than the panel has pixels, so that a step of a long ramp is lost in a pixel.
const MOST_POINTS: usize = 1200;
/// Names of the sequencer's phases, by the value of its pin `phase`.
const PHASES: [&str; 6] = ["idle", "settle reset", "ramp reset", "settle signal", "ramp signal", "blank"];

/// As in the report's pages.
const STYLE: &str = "svg{--card:#fff;--ink:#16191d;--soft:#555d68;--rule:#c3cad3;--grid:#e9ecf0;--s0:#0064a0;--s1:#b84a00;--s2:#00745a;\
--s3:#7d3f86;--s4:#9a5b00;--s5:#a3263c;font:13px system-ui,-apple-system,'Segoe UI',Roboto,'Noto Sans','Helvetica Neue',Arial,\
sans-serif}@media(prefers-color-scheme:dark){svg{--card:#191d23;--ink:#e9ecf0;--soft:#a9b2be;--rule:#485260;--grid:#282e37;--s0:#64b9ee;\
--s1:#f0a040;--s2:#46c8a2;--s3:#d99ae0;--s4:#e5c15a;--s5:#f28a98}}\
text{fill:var(--ink)}.s{fill:var(--soft);font-size:12px}.h{font-weight:650;font-size:15px}.t{font-weight:650;font-size:20px}\
.e{text-anchor:end}.m{text-anchor:middle}.l{font-size:12px}.g{stroke:var(--grid);fill:none}.r{stroke:var(--rule);fill:none}\
.ramp{stroke:var(--ink);stroke-width:1.4;fill:none}.c{stroke-width:1.6;fill:none;stroke-linejoin:round}.o{opacity:.5}\
.bed{fill:var(--grid);opacity:.55}";

/// A signal over the line: instants in picoseconds with what holds from then on, the first of them at the line's start.
type Curve = Vec<(u64, f64)>;

struct PlotColumn<'a> {
    name: &'a str,
    input_mv: Curve,
    comparator: Curve,
    counter_lsb: Curve,
    /// What the converter gives at the end of the line.
    code: Option<u64>,
}

/// From here to there, in picoseconds.
#[derive(Clone, Copy)]
struct TimeSpan {
    start_ps: u64,
    end_ps: u64,
}

impl TimeSpan {
    fn x_px(self, time_ps: u64) -> f64 {
        let inside_ps = time_ps.clamp(self.start_ps, self.end_ps) - self.start_ps;
        LEFT_PX + (RIGHT_PX - LEFT_PX) * f64_from_u64(inside_ps) / f64_from_u64(self.end_ps - self.start_ps)
    }
}

/// The picture; `name` is the sensor's or the scenario's.
pub fn svg(waves: &Waves, name: &str) -> String {
    let row = curve_of(waves, "sequencer", "row", u64::MAX, 0);
    let (start_ps, array_row) = row.first().copied().unwrap_or((0, 0.0));
    let next_ps = row.iter().find(|(time_ps, next)| *time_ps > start_ps && *next != array_row).map(|next| next.0);
    let end_ps = next_ps.or_else(|| unknown_after(waves, start_ps)).unwrap_or(waves.end_ps).max(start_ps + 1);
    let span = TimeSpan { start_ps, end_ps };
    let names: Vec<&str> =
        waves.signals.iter().filter(|signal| signal.name == "comparator").map(|signal| signal.scope.as_str()).collect();
    let columns: Vec<PlotColumn<'_>> =
        names.iter().take(MOST_COLUMNS).map(|scope| column(waves, scope, span)).collect();
    let frame = value_at(waves, "frame", "number", start_ps).unwrap_or(0.0);

    let mut body = String::new();
    text(&mut body, MARGIN_PX, 42.0, "t", name);
    let shown = match names.len() {
        all if all > MOST_COLUMNS => format!("the first {MOST_COLUMNS} of {all} columns"),
        1 => "one column".to_owned(),
        all => format!("{all} columns"),
    };
    text(&mut body, MARGIN_PX, 64.0, "s", &format!("Conversions of array row {array_row} in frame {frame}; {shown}"));
    let mut y_px = phases(&mut body, waves, span, 84.0);
    y_px = ramp(&mut body, waves, &columns, span, y_px + 34.0);
    y_px = comparators(&mut body, &columns, span, y_px + 34.0);
    y_px = counters(&mut body, &columns, span, y_px + 34.0);
    let height_px = axis(&mut body, span, y_px) + 16.0;
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH_PX} {height_px:.0}\" width=\"{WIDTH_PX}\" role=\"img\">\n\
         <title>Conversions of a row: {}</title>\n<style>{STYLE}</style>\n\
         <rect width=\"{WIDTH_PX}\" height=\"{height_px:.0}\" rx=\"12\" style=\"fill:var(--card)\"/>\n{body}</svg>\n",
        escaped(name)
    )
}

/// The first instant after another from which the sequencer's row is not known.
fn unknown_after(waves: &Waves, start_ps: u64) -> Option<u64> {
    let changes = waves.of(waves.find("sequencer", "row")?);
    changes.into_iter().find(|(time_ps, value)| *time_ps > start_ps && *value == Value::Unknown).map(|change| change.0)
}

fn column<'a>(waves: &Waves, scope: &'a str, span: TimeSpan) -> PlotColumn<'a> {
    let curve = |name: &str, factor: f64| -> Curve {
        let values = curve_of(waves, scope, name, span.end_ps, span.start_ps);
        values.into_iter().map(|(time_ps, value)| (time_ps, factor * value)).collect()
    };
    let code = value_at(waves, scope, "code", span.end_ps - 1).map(u64_half_even);
    PlotColumn {
        name: scope,
        input_mv: curve("comparator_input_uv", 1e-3),
        comparator: curve("comparator", 1.0),
        counter_lsb: curve("counter", 1.0),
        code,
    }
}

/// What a signal stands at, at an instant.
fn value_at(waves: &Waves, scope: &str, name: &str, time_ps: u64) -> Option<f64> {
    curve_of(waves, scope, name, time_ps + 1, 0).last().map(|change| change.1)
}

/// The known values of a signal before an instant; what holds at `start_ps` comes first, at that instant.
fn curve_of(waves: &Waves, scope: &str, name: &str, end_ps: u64, start_ps: u64) -> Curve {
    let Some(signal) = waves.find(scope, name) else { return Vec::new() };
    let kind = waves.signals[signal.0].kind;
    let mut curve: Curve = Vec::new();
    for (time_ps, value) in waves.of(signal).into_iter().take_while(|change| change.0 < end_ps) {
        if time_ps <= start_ps {
            curve.clear();
        }
        curve.extend(number(value, kind).map(|value| (time_ps.max(start_ps), value)));
    }
    curve
}

fn number(value: Value, kind: super::SignalKind) -> Option<f64> {
    match (value, kind) {
        (Value::Bits(word), super::SignalKind::Signed(_)) => Some(f64_from_i64(word.cast_signed())),
        (Value::Bits(word), _) => Some(f64_from_u64(word)),
        (Value::Real(real), _) => Some(real),
        (Value::Unknown, _) => None,
    }
}

/// A band with the phases' names; gives the height where it ends.
fn phases(body: &mut String, waves: &Waves, span: TimeSpan, top_px: f64) -> f64 {
    let phases = curve_of(waves, "sequencer", "phase", span.end_ps, span.start_ps);
    text(body, MARGIN_PX, top_px + 16.0, "l", "phase");
    for (at, &(time_ps, phase)) in phases.iter().enumerate() {
        let next_ps = phases.get(at + 1).map_or(span.end_ps, |next| next.0);
        let (from_px, to_px) = (span.x_px(time_ps), span.x_px(next_ps));
        let name = PHASES.get(index(u32_truncated(phase))).copied().unwrap_or("");
        *body += &format!(
            "<rect x=\"{from_px:.1}\" y=\"{top_px}\" width=\"{:.1}\" height=\"22\" class=\"bed\"><title>{name}</title></rect>\
             <path d=\"M{from_px:.1} {top_px}v22\" class=\"r\"/>\n",
            to_px - from_px
        );
        // Six and a half pixels a letter; a phase too narrow for its name goes without.
        if to_px - from_px > 6.5 * f64_from_usize(name.len()) {
            text(body, 0.5 * (from_px + to_px), top_px + 15.0, "s m", name);
        }
    }
    top_px + 22.0
}

/// A panel's frame with three marks of its scale; gives back the map from value to height.
fn panel(
    body: &mut String,
    (heading, unit): (&str, &str),
    (least, most): (f64, f64),
    top_px: f64,
) -> impl Fn(f64) -> f64 + use<> {
    text(body, MARGIN_PX, top_px - 14.0, "h", heading);
    let range = greater(most - least, 1e-9);
    let y_px = move |value: f64| top_px + PANEL_PX * (1.0 - (value - least) / range);
    for share in [0.0, 0.5, 1.0] {
        let value = least + share * range;
        let at_px = y_px(value);
        *body += &format!("<path d=\"M{LEFT_PX} {at_px:.1}H{RIGHT_PX}\" class=\"g\"/>\n");
        let digits = if range < 10.0 { 2 } else { usize::from(range < 100.0) };
        text(body, LEFT_PX - 8.0, at_px + 4.0, "s e", &format!("{value:.digits$} {unit}"));
    }
    y_px
}

/// A curve of steps, thinned to what the panel can show; the last value goes on to the end.
fn steps(body: &mut String, curve: &Curve, span: TimeSpan, y_px: &dyn Fn(f64) -> f64, attributes: &str) {
    if curve.is_empty() {
        return;
    }
    let every = curve.len().div_ceil(MOST_POINTS);
    let jump = 8.0 * mean_step(curve);
    let mut path = String::new();
    for (at, &(time_ps, value)) in curve.iter().enumerate() {
        // The ends of a run of steps stay, so that a ramp's return is not thinned away.
        let jumps = at > 0 && (value - curve[at - 1].1).abs() > jump;
        if at % every != 0 && !jumps && at + 1 != curve.len() {
            continue;
        }
        let (x, y) = (span.x_px(time_ps), y_px(value));
        let start = if path.is_empty() { format!("M{x:.1} {y:.1}") } else { format!("H{x:.1}V{y:.1}") };
        path.push_str(&start);
    }
    *body += &format!("<path d=\"{path}H{RIGHT_PX:.1}\" {attributes}/>\n");
}

fn mean_step(curve: &Curve) -> f64 {
    let total: f64 = curve.windows(2).map(|pair| (pair[1].1 - pair[0].1).abs()).sum();
    total / f64_from_usize(curve.len().max(2) - 1)
}

fn range_of<'a>(curves: impl Iterator<Item = &'a Curve>) -> (f64, f64) {
    let values = curves.flatten().map(|point| point.1);
    values.fold((0.0, 0.0), |(least, most), value| (lesser(least, value), greater(most, value)))
}

fn ramp(body: &mut String, waves: &Waves, columns: &[PlotColumn<'_>], span: TimeSpan, top_px: f64) -> f64 {
    let ramp_mv: Curve = curve_of(waves, "ramp", "ramp_uv", span.end_ps, span.start_ps)
        .into_iter()
        .map(|(time_ps, ramp_uv)| (time_ps, 1e-3 * ramp_uv))
        .collect();
    let inputs = columns.iter().map(|column| &column.input_mv);
    let y_px = panel(body, ("Ramp and samples", "mV"), range_of(inputs.chain([&ramp_mv])), top_px);
    steps(body, &ramp_mv, span, &y_px, "class=\"ramp\"");
    for (at, column) in columns.iter().enumerate() {
        steps(body, &column.input_mv, span, &y_px, &format!("class=\"c\" stroke=\"var(--s{at})\""));
        for &time_ps in &rises(&column.comparator) {
            let Some(ramp) = ramp_mv.iter().take_while(|point| point.0 <= time_ps).last() else { continue };
            let (x, y) = (span.x_px(time_ps), y_px(ramp.1));
            *body += &format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"var(--s{at})\"/>\n");
        }
    }
    top_px + PANEL_PX
}

/// When a pin goes from low to high.
fn rises(pin: &Curve) -> Vec<u64> {
    pin.windows(2).filter(|pair| pair[0].1 < 0.5 && pair[1].1 > 0.5).map(|pair| pair[1].0).collect()
}

fn comparators(body: &mut String, columns: &[PlotColumn<'_>], span: TimeSpan, top_px: f64) -> f64 {
    text(body, MARGIN_PX, top_px - 8.0, "h", "Comparators");
    for (at, column) in columns.iter().enumerate() {
        let low_px = top_px + LANE_PX * f64_from_usize(at) + PULSE_PX + 4.0;
        text(body, LEFT_PX - 8.0, low_px - 2.0, "l e", &column.name.replace('_', " "));
        let y_px = move |value: f64| low_px - PULSE_PX * value;
        steps(body, &column.comparator, span, &y_px, &format!("class=\"c\" stroke=\"var(--s{at})\""));
    }
    top_px + LANE_PX * f64_from_usize(columns.len())
}

fn counters(body: &mut String, columns: &[PlotColumn<'_>], span: TimeSpan, top_px: f64) -> f64 {
    let y_px =
        panel(body, ("Counters and codes", "LSB"), range_of(columns.iter().map(|column| &column.counter_lsb)), top_px);
    // Codes that would stand on each other move apart, from the bottom up.
    let mut free_px = f64::INFINITY;
    let mut by_code: Vec<usize> = (0..columns.len()).collect();
    by_code.sort_by_key(|&at| columns[at].code);
    for at in by_code {
        let column = &columns[at];
        steps(body, &column.counter_lsb, span, &y_px, &format!("class=\"c\" stroke=\"var(--s{at})\""));
        let (Some(code), Some(last)) = (column.code, column.counter_lsb.last()) else { continue };
        let at_px = lesser(y_px(last.1) + 4.0, free_px);
        free_px = at_px - 14.0;
        text(body, RIGHT_PX + 8.0, at_px, "l", &format!("code {code}"));
    }
    top_px + PANEL_PX
}

/// Microseconds since the line's start; gives the height below them.
fn axis(body: &mut String, span: TimeSpan, top_px: f64) -> f64 {
    let length_ps = span.end_ps - span.start_ps;
    for part in 0..=5 {
        let time_ps = length_ps / 5 * part;
        let x_px = span.x_px(span.start_ps + time_ps);
        *body += &format!("<path d=\"M{x_px:.1} {top_px:.1}v5\" class=\"r\"/>\n");
        let unit = if part == 5 { " \u{b5}s" } else { "" };
        text(body, x_px, top_px + 20.0, "s m", &format!("{:.2}{unit}", 1e-6 * f64_from_u64(time_ps)));
    }
    text(body, MARGIN_PX, top_px + 20.0, "s", "in the line");
    top_px + 24.0
}
