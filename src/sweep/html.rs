//! The page of a gathered sweep: one file, no network; its table is sorted and filtered by a few lines of script.

use super::digits::digits;
use super::interaction::{Interaction, LevelMeans, with_ends};
use super::picture;
use super::record::label;
use super::table::{Role, Table};
use super::verdicts::{FactorEffect, FigureReport, FrontPoint, LevelDifference, PointVerdict};
use crate::report::chart::{self, Axes, Ink, SeriesShape, chart};
use crate::report::escape::escaped;
use crate::statistics::MeanEstimate;

/// Columns of the table that a page shows; the others stand in the Parquet file.
const TABLE_ROWS_MAX: usize = 20_000;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// The whole page.
pub(super) fn page(
    title: &str,
    table: &Table,
    figures: &[FigureReport],
    (fronts, pictures): (&[([String; 2], Vec<FrontPoint>)], &[Interaction]),
    verdicts: &[PointVerdict],
) -> String {
    let title = escaped(title);
    let mut body = format!(
        "<header><h1>{title}</h1><p>{} finished cells. Intervals are 95 % intervals of the mean over all cells of a level (Student's t); \
         they count cells as independent. All numbers stand in cells.parquet.</p></header><main>",
        table.rows
    );
    body.push_str(&verdict_section(verdicts));
    for picture in pictures {
        body.push_str(&picture_section(picture));
    }
    for figure in figures {
        body.push_str(&figure_section(figure));
    }
    for (pair, points) in fronts {
        body.push_str(&front_section(pair, points));
    }
    body.push_str(&table_section(table, figures));
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
         <title>{title} \u{b7} sensel sweep</title><style>{STYLE}</style></head><body>{body}</main><footer>sensel {}</footer>\
         <script>{SCRIPT}</script></body></html>\n",
        env!("CARGO_PKG_VERSION")
    )
}

fn estimate(value: &MeanEstimate) -> String {
    let interval = value.interval.map_or_else(
        || "no interval of one cell".to_owned(),
        |[low, high]| format!("{} to {}", digits(low), digits(high)),
    );
    format!(
        "<td class=\"n\">{}</td><td class=\"n\">{interval}</td><td class=\"n\">{}</td>",
        digits(value.mean),
        value.count
    )
}

fn verdict_section(verdicts: &[PointVerdict]) -> String {
    if verdicts.is_empty() {
        return String::new();
    }
    let row = |verdict: &PointVerdict| {
        format!(
            "<tr><td>{}</td><td>{}</td><td class=\"{1}\">{}</td></tr>",
            escaped(&verdict.name),
            verdict.judgement.verdict.name(),
            escaped(&verdict.judgement.in_words())
        )
    };
    let mut section = "<section><h2>Specifications</h2>".to_owned();
    let mut names: Vec<&str> = verdicts.iter().map(|verdict| verdict.specification.as_str()).collect();
    names.dedup();
    for name in names {
        let rows: String = verdicts.iter().filter(|verdict| verdict.specification == name).map(row).collect();
        section.push_str(&format!(
            "<h3>{}</h3><table><thead><tr><th>point</th><th>verdict</th><th>runs</th></tr></thead><tbody>{rows}</tbody></table>",
            escaped(name)
        ));
    }
    section + "</section>"
}

fn picture_section(interaction: &Interaction) -> String {
    let title = escaped(&format!("{} by {}", interaction.label(), interaction.by));
    let picture = picture::svg(interaction).unwrap_or_default();
    let row = |(at, level): (usize, &String)| {
        let of = |series: &LevelMeans| {
            let one = |value: &Option<MeanEstimate>| value.as_ref().map_or_else(|| "<td></td>".to_owned(), ends_cell);
            let ratio = interaction.base.as_ref().map_or_else(String::new, |_| one(&series.ratios[at]));
            one(&series.means[at]) + &ratio
        };
        format!("<tr><td>{}</td>{}</tr>", escaped(level), interaction.series.iter().map(of).collect::<String>())
    };
    let rows: String = interaction.levels.iter().enumerate().map(row).collect();
    let head = |series: &LevelMeans| {
        let base = interaction.base.as_ref();
        let ratio = base.map_or_else(String::new, |base| format!("<th>ratio to {}</th>", escaped(base)));
        format!("<th>{}</th>{ratio}", if series.name.is_empty() { "mean".to_owned() } else { escaped(&series.name) })
    };
    let heads: String = interaction.series.iter().map(head).collect();
    format!(
        "<section><h2>{title}</h2><figure class=\"picture\">{picture}</figure><p class=\"note\">Means with 95 % intervals; ratios are \
         geometric means over pairs of equal draws.</p><div class=\"scroll\"><table><thead><tr><th>{}</th>{heads}</tr></thead>\
         <tbody>{rows}</tbody></table></div></section>",
        escaped(&interaction.by)
    )
}

/// A mean with its interval in one cell.
fn ends_cell(value: &MeanEstimate) -> String {
    format!("<td class=\"n\">{}</td>", with_ends(value))
}

fn figure_section(report: &FigureReport) -> String {
    let name = escaped(&label(&report.figure));
    let effects: String = report.effects.iter().map(|effect| effect_part(effect, &report.figure)).collect();
    format!("<section><h2>{name}</h2>{effects}{}</section>", differences(&report.differences))
}

fn effect_part(effect: &FactorEffect, figure: &str) -> String {
    let row = |(name, _, value): &(String, Option<f64>, MeanEstimate)| {
        format!("<tr><td>{}</td>{}</tr>", escaped(name), estimate(value))
    };
    let rows: String = effect.levels.iter().map(row).collect();
    let index = effect
        .first_order
        .map_or_else(|| "not measurable".to_owned(), |share| format!("{:.1} % of the variance", 100.0 * share));
    let table = format!(
        "<table><thead><tr><th>{}</th><th>mean</th><th>95 % interval</th><th>cells</th></tr></thead><tbody>{rows}</tbody></table>\
         <p class=\"note\">First-order sensitivity index (correlation ratio): {index}.</p>",
        escaped(&effect.factor)
    );
    let points: Option<Vec<(f64, &MeanEstimate)>> =
        effect.levels.iter().map(|(_, position, value)| Some(((*position)?, value))).collect();
    let picture = points.map_or_else(String::new, |points| {
        let means = points.iter().map(|(x, value)| (*x, value.mean)).collect();
        let bars = points
            .iter()
            .filter_map(|(x, value)| value.interval.map(|[low, high]| vec![(*x, low), (*x, high)]))
            .collect();
        let title = format!("{figure} by {}", effect.factor);
        let axes = Axes { title: &title, x_label: &effect.factor, y_label: &label(figure), ..Axes::default() };
        let mean = chart::Series { name: "mean", ink: Ink::One, shape: SeriesShape::Dots, runs: vec![means] };
        chart(
            &axes,
            &[mean, chart::Series { name: "95 % interval", ink: Ink::One, shape: SeriesShape::Line(2), runs: bars }],
        )
        .0
    });
    format!("<div class=\"pair\"><div>{table}</div>{picture}</div>")
}

fn differences(all: &[LevelDifference]) -> String {
    if all.is_empty() {
        return String::new();
    }
    let row = |one: &LevelDifference| {
        let saving = one.saving.map_or_else(|| "not measurable".to_owned(), |saving| format!("{saving:.1}"));
        let decided = if one.change.is_decided() { "yes" } else { "no" };
        format!(
            "<tr><td>{}: {} \u{2192} {}</td>{}<td>{decided}</td><td class=\"n\">{saving}</td></tr>",
            escaped(&one.factor),
            escaped(&one.from),
            escaped(&one.to),
            estimate(&one.change)
        )
    };
    format!(
        "<h3>Paired differences</h3><p class=\"note\">Between cells that are equal in all else and have equal draws. The last \
         column says how many independent seeds one paired seed stands for.</p><table><thead><tr><th>change</th><th>mean</th>\
         <th>95 % interval</th><th>pairs</th><th>decided</th><th>saving in seeds</th></tr></thead><tbody>{}</tbody></table>",
        all.iter().map(row).collect::<String>()
    )
}

fn front_section(pair: &[String; 2], points: &[FrontPoint]) -> String {
    let runs = |is_on: bool| {
        let chosen = points.iter().filter(|point| point.is_on_front == is_on);
        vec![chosen.map(|point| (point.figures[0].mean, point.figures[1].mean)).collect::<Vec<_>>()]
    };
    let title = format!("{} against {}", pair[1], pair[0]);
    let (x_label, y_label) = (label(&pair[0]), label(&pair[1]));
    let axes = Axes { title: &title, x_label: &x_label, y_label: &y_label, ..Axes::default() };
    let series = [
        chart::Series { name: "on the front", ink: Ink::One, shape: SeriesShape::Dots, runs: runs(true) },
        chart::Series { name: "beaten in both", ink: Ink::Two, shape: SeriesShape::Dots, runs: runs(false) },
    ];
    let mut sorted: Vec<&FrontPoint> =
        points.iter().filter(|point| point.is_on_front || point.share_on_front > 0.05).collect();
    sorted.sort_by(|a, b| a.figures[0].mean.total_cmp(&b.figures[0].mean));
    let row = |point: &&FrontPoint| {
        let share = 100.0 * point.share_on_front;
        format!(
            "<tr><td>{}</td>{}{}<td class=\"n\">{share:.0} %</td></tr>",
            escaped(&point.name),
            ends_cell(&point.figures[0]),
            ends_cell(&point.figures[1])
        )
    };
    format!(
        "<section><h2>{}</h2><div class=\"pair\">{}<div><p class=\"note\">Both are wanted small. The share says in how many of 400 \
         resamples of the replicates a point lies on the front.</p><table><thead><tr><th>point</th><th>{}</th><th>{}</th>\
         <th>on the front</th></tr></thead>\
         <tbody>{}</tbody></table></div></div></section>",
        escaped(&title),
        chart(&axes, &series).0,
        escaped(&x_label),
        escaped(&y_label),
        sorted.iter().map(row).collect::<String>()
    )
}

fn table_section(table: &Table, figures: &[FigureReport]) -> String {
    let is_shown = |name: &str, role: Role| match role {
        Role::Factor | Role::Replicate => true,
        Role::Name => name == "status",
        Role::Config => false,
        Role::Figure => figures.iter().any(|figure| figure.figure == name),
    };
    let columns: Vec<_> = table.columns.iter().filter(|column| is_shown(&column.name, column.role)).collect();
    let head: String = columns
        .iter()
        .map(|column| format!("<th><button type=\"button\">{}</button></th>", escaped(&label(&column.name))))
        .collect();
    let mut rows = String::new();
    for row in 0..table.rows.min(TABLE_ROWS_MAX) {
        rows.push_str("<tr>");
        for column in &columns {
            let text = column.values.text(row);
            let shown = column
                .values
                .number(row)
                .filter(|_| column.role == Role::Figure)
                .map_or_else(|| escaped(&text), digits);
            rows.push_str(&format!("<td data-v=\"{}\">{shown}</td>", escaped(&text)));
        }
        rows.push_str("</tr>");
    }
    format!(
        "<section><h2>Cells</h2><p><label>Filter by text in any column <input id=\"filter\" type=\"search\"></label></p>\
         <div class=\"scroll\" tabindex=\"0\">\
         <table id=\"cells\"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div></section>"
    )
}
