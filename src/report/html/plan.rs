//! Which effects the scene called for, and what leaving the others out can change at most.

use crate::report::html::section;
use crate::report::html::text::{digits, escaped};
use crate::report::record::{OmittedEffect, Report};

pub(super) fn plan(report: &Report) -> String {
    let plan = &report.plan;
    let lead = format!(
        "{} effects simulated, {} left out. Together the absent ones change a pixel by at most {} e\u{2212} \
         systematically and {} e\u{2212} (sigma) at random.",
        plan.kept.len(),
        plan.omitted.len(),
        digits(plan.bias_e),
        digits(plan.sigma_e)
    );
    let kept: String = plan.kept.iter().map(|name| kept_row(name, plan.kept_reasons.get(name))).collect();
    let omitted: String = plan.omitted.iter().map(omitted_row).collect();
    let table = format!(
        "<div class=\"scroll\"><table><thead><tr><th scope=\"col\">effect</th><th scope=\"col\">decision</th>\
         <th scope=\"col\" class=\"num\">bias, e\u{2212}</th>\
         <th scope=\"col\" class=\"num\">sigma, e\u{2212}</th><th scope=\"col\">reason</th></tr></thead>\
         <tbody>{kept}{omitted}</tbody></table></div>"
    );
    section("Effects: only what the scene calls for", &lead, &table)
}

fn kept_row(name: &str, reason: Option<&String>) -> String {
    let reason = reason.map_or("simulated in every pixel", String::as_str);
    format!(
        "<tr><th scope=\"row\">{}</th><td class=\"kept\">kept</td><td class=\"num\">\u{2013}</td>\
         <td class=\"num\">\u{2013}</td><td class=\"note\">{}</td></tr>",
        escaped(&name.replace('_', " ")),
        escaped(reason)
    )
}

fn omitted_row(effect: &OmittedEffect) -> String {
    format!(
        "<tr><th scope=\"row\">{}</th><td class=\"left\">left out</td><td class=\"num\">{}</td><td class=\"num\">{}\
         </td><td class=\"note\">{}</td></tr>",
        escaped(&effect.name.replace('_', " ")),
        digits(effect.bias_e),
        digits(effect.sigma_e),
        escaped(&effect.reason)
    )
}
