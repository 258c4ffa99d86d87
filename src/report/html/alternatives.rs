//! What raw pixels, features and both cost, from one run: the question that a sensor with compute is built for.

use super::parts::{self, section};
use crate::report::alternatives_record::{Alternative, LeftOut};
use crate::report::html::energy::factor_of;
use crate::report::html::text::{digits, digits_within, escaped, grouped, si};
use crate::report::record::Report;

pub(super) fn alternatives(report: &Report) -> String {
    let table = &report.alternatives;
    if table.rows.is_empty() {
        return String::new();
    }
    let factor = factor_of(report.energy.total_interval);
    let dash = || "\u{2013}".to_owned();
    let row = |row: &Alternative| {
        let milliwatts = |mw: f64| digits_within(mw, factor);
        let (class, keeps_up) = match row.keeps_up {
            Some(true) => ("kept", "yes".to_owned()),
            Some(false) => ("left", "no".to_owned()),
            None => ("soft", dash()),
        };
        let cells = [
            format!("<strong>{}</strong>", milliwatts(row.power_mw)),
            milliwatts(row.analog_mw),
            milliwatts(row.digital_mw),
            milliwatts(row.io_mw),
            digits(row.link_mbit_per_s),
            si(row.latency_us * 1e-6, "s"),
            row.pose_us.map_or_else(dash, |pose_us| si(pose_us * 1e-6, "s")),
            row.host_mj_per_frame.map_or_else(dash, digits),
        ];
        let cells: String = cells.iter().map(|cell| format!("<td class=\"num\">{cell}</td>")).collect();
        let mark = if row.is_run { " <span class=\"soft\">(this run)</span>" } else { "" };
        format!(
            "<tr{}><th scope=\"row\">{}{mark}</th>{cells}<td class=\"{class}\">{keeps_up}</td><td class=\"num\">{}</td></tr>",
            if row.is_run { " class=\"own\"" } else { "" },
            escaped(&row.name),
            row.ate_m.map_or_else(dash, |ate_m| si(ate_m, "m"))
        )
    };
    let left_out =
        |LeftOut { name, reason }: &LeftOut| format!("<li>{} is not possible: {}</li>", escaped(name), escaped(reason));
    let left_out: String = table.left_out.iter().map(left_out).collect();
    let heads = "what is sent|#mW|#analog|#digital|#port|#Mbit/s|#last bit|#pose|#host mJ a frame|keeps up|#ATE";
    let rows: String = table.rows.iter().map(row).collect();
    let left_out = if left_out.is_empty() { left_out } else { format!("<ul class=\"note\">{left_out}</ul>") };
    let content = parts::table("raw, features or both", "alternatives", heads, &rows) + &left_out;
    let lead = format!(
        "One run\u{2019}s events under each way of sending, {} features a camera\u{2019}s frame, all sensors together. The host is {}; \
         times \
         count from the middle of the exposure.",
        grouped(crate::num::f64_from_u64(table.features)),
        table.host
    );
    section("Raw, features or both", &lead, &content)
}
