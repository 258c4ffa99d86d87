//! The page of a gathered sweep: one file, no network; its table is sorted and filtered by a few lines of script.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::digits::digits;
use super::interaction::{Interaction, with_ends};
use super::picture;
use super::record::label;
use super::table::{Role, Table, TableColumn};
use super::verdicts::{FactorEffect, FigureReport, FrontPoint, LevelDifference, PointVerdict};
use crate::report::chart::{self, Axes, Ink, SeriesShape, chart};
use crate::report::html::{pair, script, style};
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
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { (title) " \u{b7} sensel sweep" }
                (style(STYLE))
            }
            body {
                header {
                    h1 { (title) }
                    p {
                        (table.rows) " finished cells. Intervals are 95 % intervals of the mean over all cells of a level "
                        "(Student's t); they count cells as independent. All numbers stand in cells.parquet."
                    }
                }
                main {
                    @if !verdicts.is_empty() { (verdict_section(verdicts)) }
                    @for picture in pictures { (picture_section(picture)) }
                    @for figure in figures { (figure_section(figure)) }
                    @for (pair, points) in fronts { (front_section(pair, points)) }
                    (table_section(table, figures))
                }
                footer { "sensel " (env!("CARGO_PKG_VERSION")) }
                (script(SCRIPT))
            }
        }
    };
    page.into_string()
}

/// Cells with mean, interval and count.
fn estimate(value: &MeanEstimate) -> Markup {
    html! {
        td.n { (digits(value.mean)) }
        td.n {
            @if let Some([low, high]) = value.interval { (digits(low)) " to " (digits(high)) }
            @else { "no interval of one cell" }
        }
        td.n { (value.count) }
    }
}

fn verdict_section(verdicts: &[PointVerdict]) -> Markup {
    let mut names: Vec<&str> = verdicts.iter().map(|verdict| verdict.specification.as_str()).collect();
    names.dedup();
    html! {
        section {
            h2 { "Specifications" }
            @for name in names {
                h3 { (name) }
                table {
                    thead { tr { th { "point" } th { "verdict" } th { "runs" } } }
                    tbody {
                        @for verdict in verdicts.iter().filter(|verdict| verdict.specification == name) { (verdict_row(verdict)) }
                    }
                }
            }
        }
    }
}

fn verdict_row(verdict: &PointVerdict) -> Markup {
    let word = verdict.judgement.verdict.name();
    html! { tr { td { (verdict.name) } td { (word) } td class=(word) { (verdict.judgement.in_words()) } } }
}

fn picture_section(interaction: &Interaction) -> Markup {
    let base = interaction.base.as_ref();
    html! {
        section {
            h2 { (interaction.label()) " by " (interaction.by) }
            // Plotters escapes the text that it draws.
            figure.picture { (PreEscaped(picture::svg(interaction).unwrap_or_default())) }
            p.note { "Means with 95 % intervals; ratios are geometric means over pairs of equal draws." }
            div.scroll {
                table {
                    thead {
                        tr {
                            th { (interaction.by) }
                            @for series in &interaction.series {
                                th { @if series.name.is_empty() { "mean" } @else { (series.name) } }
                                @if let Some(base) = base { th { "ratio to " (base) } }
                            }
                        }
                    }
                    tbody {
                        @for (at, level) in interaction.levels.iter().enumerate() {
                            tr {
                                td { (level) }
                                @for series in &interaction.series {
                                    (ends_cell(series.means[at].as_ref()))
                                    @if base.is_some() { (ends_cell(series.ratios[at].as_ref())) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A mean with its interval in one cell; empty without a mean.
fn ends_cell(value: Option<&MeanEstimate>) -> Markup {
    html! { @if let Some(value) = value { td.n { (with_ends(value)) } } @else { td {} } }
}

fn figure_section(report: &FigureReport) -> Markup {
    html! {
        section {
            h2 { (label(&report.figure)) }
            @for effect in &report.effects { (effect_part(effect, &report.figure)) }
            @if !report.differences.is_empty() { (differences(&report.differences)) }
        }
    }
}

fn effect_part(effect: &FactorEffect, figure: &str) -> Markup {
    let table = html! {
        table {
            thead { tr { th { (effect.factor) } th { "mean" } th { "95 % interval" } th { "cells" } } }
            tbody { @for (name, _, value) in &effect.levels { tr { td { (name) } (estimate(value)) } } }
        }
        p.note {
            "First-order sensitivity index (correlation ratio): "
            @if let Some(share) = effect.first_order { (format!("{:.1}", 100.0 * share)) " % of the variance" }
            @else { "not measurable" }
            "."
        }
    };
    let points: Option<Vec<(f64, &MeanEstimate)>> =
        effect.levels.iter().map(|(_, position, value)| Some(((*position)?, value))).collect();
    let picture = points.map(|points| level_chart(effect, figure, &points)).unwrap_or_default();
    pair(html! { div { (table) } }, picture)
}

/// Means with their intervals over the levels of a factor of numbers.
fn level_chart(effect: &FactorEffect, figure: &str, points: &[(f64, &MeanEstimate)]) -> Markup {
    let means = points.iter().map(|(x, value)| (*x, value.mean)).collect();
    let bars =
        points.iter().filter_map(|(x, value)| value.interval.map(|[low, high]| vec![(*x, low), (*x, high)])).collect();
    let title = format!("{figure} by {}", effect.factor);
    let axes = Axes { title: &title, x_label: &effect.factor, y_label: &label(figure), ..Axes::default() };
    let mean = chart::Series { name: "mean", ink: Ink::One, shape: SeriesShape::Dots, runs: vec![means] };
    chart(
        &axes,
        &[mean, chart::Series { name: "95 % interval", ink: Ink::One, shape: SeriesShape::Line(2), runs: bars }],
    )
}

fn differences(all: &[LevelDifference]) -> Markup {
    html! {
        h3 { "Paired differences" }
        p.note {
            "Between cells that are equal in all else and have equal draws. The last "
            "column says how many independent seeds one paired seed stands for."
        }
        table {
            thead {
                tr {
                    th { "change" } th { "mean" } th { "95 % interval" } th { "pairs" } th { "decided" } th { "saving in seeds" }
                }
            }
            tbody {
                @for LevelDifference { factor, from, to, change, saving, .. } in all {
                    tr {
                        td { (factor) ": " (from) " \u{2192} " (to) }
                        (estimate(change))
                        td { @if change.is_decided() { "yes" } @else { "no" } }
                        td.n { @if let Some(saving) = saving { (format!("{saving:.1}")) } @else { "not measurable" } }
                    }
                }
            }
        }
    }
}

fn front_section(pair: &[String; 2], points: &[FrontPoint]) -> Markup {
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
    html! {
        section {
            h2 { (title) }
            div.pair {
                (chart(&axes, &series))
                div {
                    p.note {
                        "Both are wanted small. The share says in how many of 400 "
                        "resamples of the replicates a point lies on the front."
                    }
                    table {
                        thead { tr { th { "point" } th { (x_label) } th { (y_label) } th { "on the front" } } }
                        tbody {
                            @for point in sorted {
                                tr {
                                    td { (point.name) }
                                    @for figure in &point.figures { (ends_cell(Some(figure))) }
                                    td.n { (format!("{:.0} %", 100.0 * point.share_on_front)) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn table_section(table: &Table, figures: &[FigureReport]) -> Markup {
    let is_shown = |name: &str, role: Role| match role {
        Role::Factor | Role::Replicate => true,
        Role::Name => name == "status",
        Role::Config => false,
        Role::Figure => figures.iter().any(|figure| figure.figure == name),
    };
    let columns: Vec<_> = table.columns.iter().filter(|column| is_shown(&column.name, column.role)).collect();
    html! {
        section {
            h2 { "Cells" }
            p { label { "Filter by text in any column " input #filter type="search"; } }
            div.scroll tabindex="0" {
                table #cells {
                    thead { tr { @for column in &columns { th { button type="button" { (label(&column.name)) } } } } }
                    tbody {
                        @for row in 0..table.rows.min(TABLE_ROWS_MAX) { tr { @for column in &columns { (cell(column, row)) } } }
                    }
                }
            }
        }
    }
}

/// The exact text is there for the script; figures are shown to a few digits.
fn cell(column: &TableColumn, row: usize) -> Markup {
    let text = column.values.text(row);
    let number = column.values.number(row).filter(|_| column.role == Role::Figure);
    html! { td data-v=(text) { @if let Some(number) = number { (digits(number)) } @else { (text) } } }
}
