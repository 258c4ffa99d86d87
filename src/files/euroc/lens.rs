//! Reads and writes the lens of a `sensor.yaml`, by the names and orders of Kalibr: pinhole with radtan ("radial-tangential" in EuRoC's
//! own files), equidistant or none; ds and eucm, whose intrinsics begin with two parameters of the model. A measured table has a name
//! that only this program knows.

use super::yaml::{Document, Refusal, shortened};
use crate::optics::lens::{DoubleSphere, Eucm, Intrinsics, Kb4, Lens, Mapping, RadiusTable, Radtan};

pub(super) fn yaml(lens: &Lens) -> String {
    let Intrinsics { fx_px, fy_px, cx_px, cy_px } = lens.intrinsics;
    let focal = format!("{fx_px}, {fy_px}, {cx_px}, {cy_px}");
    let distorted = |model: &str, coefficients: &[f64]| {
        let list = listed(coefficients);
        format!(
            "camera_model: pinhole\nintrinsics: [{focal}] # fu, fv, cu, cv\n\
             distortion_model: {model}\ndistortion_coefficients: {list}\n"
        )
    };
    let own = |model: &str, (first, a): (&str, f64), (second, b): (&str, f64)| {
        format!(
            "camera_model: {model}\nintrinsics: [{a}, {b}, {focal}] # {first}, {second}, fu, fv, cu, cv\ndistortion_model: none\n"
        )
    };
    match &lens.mapping {
        Mapping::Pinhole => distorted("radial-tangential", &[0.0; 4]),
        Mapping::Radtan(Radtan { k1, k2, p1, p2, k3 }) if *k3 == 0.0 => {
            distorted("radial-tangential", &[*k1, *k2, *p1, *p2])
        }
        Mapping::Radtan(Radtan { k1, k2, p1, p2, k3 }) => distorted("radial-tangential", &[*k1, *k2, *p1, *p2, *k3]),
        Mapping::Kb4(kb4) => distorted("equidistant", &kb4.coefficients()),
        Mapping::DoubleSphere(DoubleSphere { xi, alpha }) => own("ds", ("xi", *xi), ("alpha", *alpha)),
        Mapping::Eucm(Eucm { alpha, beta }) => own("eucm", ("alpha", *alpha), ("beta", *beta)),
        Mapping::Table(table) => {
            let (angles_rad, radii): (Vec<f64>, Vec<f64>) = table.points().unzip();
            let (angles_rad, radii) = (listed(&angles_rad), listed(&radii));
            format!(
                "camera_model: table\nintrinsics: [{focal}] # px of a radius of 1: fu, fv, cu, cv\ndistortion_model: none\n\
                 table_angle_rad: {angles_rad}\ntable_radius: {radii}\n"
            )
        }
    }
}

fn listed(numbers: &[f64]) -> String {
    let texts: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    format!("[{}]", texts.join(", "))
}

pub(super) fn parse(document: &Document) -> Result<Lens, Refusal> {
    let model = one_of(document, "camera_model", &["pinhole", "ds", "eucm", "table"])?;
    let distortions: &[&str] =
        if model == "pinhole" { &["radial-tangential", "radtan", "equidistant", "none"] } else { &["none"] };
    let distortion = one_of(document, "distortion_model", distortions)?;
    let (focal, own) = match model {
        "ds" | "eucm" => {
            let [first, second, fx_px, fy_px, cx_px, cy_px] = document.numbers("intrinsics")?;
            ([fx_px, fy_px, cx_px, cy_px], [first, second])
        }
        _ => (document.numbers("intrinsics")?, [0.0; 2]),
    };
    let line = document.get("intrinsics")?.line;
    let [fx_px, fy_px, cx_px, cy_px] = focal;
    if fx_px <= 0.0 || fy_px <= 0.0 {
        return Err((line, "focal lengths are above 0".to_owned()));
    }
    let refused = |would_do: &str| Err((line, format!("{model} with {} and {}; use {would_do}", own[0], own[1])));
    let mapping = match model {
        "ds" if !(own[0].abs() < 1.0 && (0.0..=1.0).contains(&own[1])) => {
            return refused("xi within -1 to 1 and alpha from 0 to 1");
        }
        "eucm" if !((0.0..=1.0).contains(&own[0]) && own[1] > 0.0) => {
            return refused("alpha from 0 to 1 and beta above 0");
        }
        "ds" => Mapping::DoubleSphere(DoubleSphere { xi: own[0], alpha: own[1] }),
        "eucm" => Mapping::Eucm(Eucm { alpha: own[0], beta: own[1] }),
        "table" => Mapping::Table(table(document)?),
        _ => distorted(document, distortion)?,
    };
    Ok(Lens { intrinsics: Intrinsics { fx_px, fy_px, cx_px, cy_px }, mapping })
}

/// The member of a closed set that a key names.
fn one_of<'a>(document: &Document, key: &str, known: &[&'a str]) -> Result<&'a str, Refusal> {
    let entry = document.get(key)?;
    known.iter().find(|name| **name == entry.text).copied().ok_or_else(|| {
        let reason = format!("{key} = '{}' is not known; known: {}", shortened(&entry.text), known.join(", "));
        (entry.line, reason)
    })
}

fn distorted(document: &Document, distortion: &str) -> Result<Mapping, Refusal> {
    if distortion == "none" {
        return Ok(Mapping::Pinhole);
    }
    let key = "distortion_coefficients";
    if distortion == "equidistant" {
        return Ok(Mapping::Kb4(Kb4::new(document.numbers(key)?)));
    }
    // OpenCV's fifth number is optional.
    if document.list(key)?.len() == 5 {
        let [k1, k2, p1, p2, k3] = document.numbers(key)?;
        return Ok(Mapping::Radtan(Radtan { k1, k2, p1, p2, k3 }));
    }
    let [k1, k2, p1, p2] = document.numbers(key)?;
    Ok(Mapping::Radtan(Radtan { k1, k2, p1, p2, k3: 0.0 }))
}

fn table(document: &Document) -> Result<RadiusTable, Refusal> {
    let (angles_rad, radii) = (document.list("table_angle_rad")?, document.list("table_radius")?);
    let line = document.get("table_radius")?.line;
    if angles_rad.len() != radii.len() {
        return Err((line, format!("{} radii for {} angles", radii.len(), angles_rad.len())));
    }
    let points: Vec<(f64, f64)> = angles_rad.into_iter().zip(radii).collect();
    RadiusTable::new(&points).map_err(|error| (line, error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens(mapping: Mapping) -> Lens {
        Lens { intrinsics: Intrinsics { fx_px: 190.978_477, fy_px: 190.973, cx_px: 254.93, cy_px: 256.897 }, mapping }
    }

    fn mappings() -> [Mapping; 6] {
        [
            Mapping::Radtan(Radtan { k1: -0.28, k2: 0.07, p1: 1e-4, p2: 1.761_871_14e-5, k3: 0.0 }),
            Mapping::Radtan(Radtan { k1: -0.28, k2: 0.07, p1: 1e-4, p2: 1.761_871_14e-5, k3: -0.01 }),
            Mapping::Kb4(Kb4::new([0.003_482_389, 7.150_348e-4, -0.002_053_236, 2.029_367e-4])),
            Mapping::DoubleSphere(DoubleSphere { xi: -0.172_130_86, alpha: 0.593_117_759 }),
            Mapping::Eucm(Eucm { alpha: 0.6, beta: 1.1 }),
            Mapping::Table(RadiusTable::new(&[(0.3, 0.31), (0.9, 0.87), (1.7, 1.5)]).unwrap()),
        ]
    }

    #[test]
    fn every_model_returns_from_its_text_bit_by_bit() {
        let mut tried = 0;
        for mapping in mappings() {
            let text = yaml(&lens(mapping));
            assert_eq!(parse(&Document::parse(&text).unwrap()).unwrap(), lens(mapping), "{text}");
            tried += 1;
        }
        assert_eq!(tried, 6);
        let bare = "camera_model: pinhole\ndistortion_model: none\nintrinsics: [1.0, 1.0, 0.0, 0.0]\n";
        assert_eq!(parse(&Document::parse(bare).unwrap()).unwrap().mapping, Mapping::Pinhole);
    }

    #[test]
    fn what_is_no_lens_is_refused_with_its_line() {
        let [_, _, _, ds, eucm, table] = mappings().map(|mapping| yaml(&lens(mapping)));
        for (text, from, to, line, message) in [
            (&ds, "-0.17213086", "1.5", 2, "xi within -1 to 1"),
            (&eucm, "1.1", "-1.1", 2, "beta above 0"),
            (&ds, "distortion_model: none", "distortion_model: radtan", 3, "not known; known: none"),
            (&table, "0.87", "0.2", 5, "both rise"),
            (&table, "0.87, ", "", 5, "2 radii for 3 angles"),
        ] {
            assert!(text.contains(from), "{text}");
            let refusal = parse(&Document::parse(&text.replacen(from, to, 1)).unwrap()).unwrap_err();
            assert!(refusal.0 == line && refusal.1.contains(message), "{from} {to}: {refusal:?}");
        }
    }
}
