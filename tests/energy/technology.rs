//! Technology files as users write them, right and wrong.

use sensel::energy::{Constant, Scaling, Technology};
use sensel::error::Error;

/// Files by name.
fn load(files: &[(&str, &str)]) -> Result<Technology, Error> {
    let read = |name: &str| {
        let found = files.iter().find(|(known, _)| *known == name);
        found.map(|(_, text)| (*text).to_owned()).ok_or_else(|| Error::Run(format!("{name} is not there")))
    };
    Technology::load(files[0].0, &read)
}

#[test]
fn every_node_has_every_constant_and_follows_the_rule() {
    let base = Technology::by_name("65nm").unwrap();
    assert!(Technology::names().count() >= 9);
    for name in Technology::names() {
        let node = Technology::by_name(name).unwrap();
        let ratio = node.node_nm / base.node_nm;
        for &constant in Constant::ALL {
            let power = match base.of(constant).scaling {
                Scaling::None => 0.0,
                Scaling::Analog => base.value(Constant::AnalogExponent),
                Scaling::Digital => base.value(Constant::DigitalExponent),
            };
            let expected = base.value(constant) * libm::pow(ratio, power);
            // One rounding each of a power and a product.
            assert!((node.value(constant) - expected).abs() <= 1e-12 * expected, "{name} {}", constant.name());
            assert!(node.of(constant).uncertainty_factor >= base.of(constant).uncertainty_factor);
            assert!(node.of(constant).source.len() > 10);
        }
    }
}

#[test]
fn an_unknown_technology_is_refused_with_the_known_ones() {
    let message = Technology::by_name("7nm").unwrap_err().to_string();
    assert!(message.contains("65nm") && message.contains("28nm"), "{message}");
}

#[test]
fn a_file_of_the_user_s_own_changes_what_it_names_and_scales_the_rest() {
    let text = "node_nm = 40\nextends = \"90nm\"\n[constant.link_byte]\npj = 12\nsource = \"measured\"\n";
    let made = load(&[("my.toml", text)]).unwrap();
    assert_eq!((made.value(Constant::LinkByte), made.of(Constant::LinkByte).source.as_str()), (12.0, "measured"));
    let direct = Technology::by_name("40nm").unwrap();
    for constant in [Constant::DatapathBit, Constant::ColumnBias, Constant::Pad] {
        // Scaling twice is scaling once but for four roundings.
        assert!((made.value(constant) / direct.value(constant) - 1.0).abs() < 1e-14, "{}", constant.name());
    }
    assert_eq!(made.core_voltage_v, 1.1);
}

#[test]
fn a_broken_file_is_refused_with_file_line_key_value_and_a_valid_value() {
    for (text, parts) in [
        (
            "node_nm = 40\n[constant.link_byte]\npj = -3.0\n",
            ["my.toml:3", "constant.link_byte.pj", "-3", "use 0 to 1e9"],
        ),
        (
            "node_nm = 40\n[constant.link_byte]\nfurlong = 3\n",
            ["my.toml:3", "link_byte.furlong", "unknown unit", "use pj"],
        ),
        ("node_nm = 40\n[constant.link_byte]\nmw = 3\n", ["my.toml:3", "link_byte.mw", "given in pj", "use pj"]),
        ("name = \"x\"\n[constant.link_byte]\npj = 3\n", ["my.toml", "node_nm", "is missing", "as in 65"]),
        ("node_nm = 0\n", ["my.toml:1", "node_nm", "0", "use 5 to 1000"]),
        (
            "node_nm = 40\n\n[constant.link_bite]\npj = 3\n",
            ["my.toml:3", "constant.link_bite", "unknown constant", "link_byte"],
        ),
        ("node_nm = 40\nextends = \"7nm\"\n", ["my.toml:2", "extends", "7nm", "use one of 180nm"]),
        (
            "node_nm = 40\n[constant.pll]\nmw = 1.0\nscaling = \"cube\"\n",
            ["my.toml:4", "pll.scaling", "cube", "use none"],
        ),
        (
            "node_nm = 40\n[constant.pll]\nuncertainty_factor = 0.5\n",
            ["my.toml:3", "pll.uncertainty_factor", "0.5", "use 1 to"],
        ),
        ("node_nm = nan\n", ["my.toml:1", "node_nm", "nan", "use 5 to 1000"]),
        ("node_nm = 40\ncolour = 1\n", ["my.toml:2", "colour", "unknown key", "use name"]),
        ("node_nm = = 1\n", ["my.toml", "line 1", "", ""]),
        ("node_nm = 65\nextends = \"my.toml\"\n", ["my.toml:2", "extends", "cycle of scaling rules", "use 65nm"]),
    ] {
        let message = load(&[("my.toml", text)]).unwrap_err().to_string();
        for part in parts {
            assert!(message.contains(part), "'{part}' is not in '{message}'");
        }
    }
}

#[test]
fn files_that_extend_one_another_in_a_circle_are_refused() {
    let files =
        [("a.toml", "node_nm = 65\nextends = \"b.toml\"\n"), ("b.toml", "node_nm = 40\nextends = \"a.toml\"\n")];
    let message = load(&files).unwrap_err().to_string();
    assert!(message.contains("b.toml:2") && message.contains("a.toml -> b.toml -> a.toml"), "{message}");
}

#[test]
fn a_key_of_a_scenario_sets_a_constant_and_refuses_what_a_file_would() {
    let mut made = Technology::by_name("65nm").unwrap();
    made.set("link_byte", "pj", 12.0).unwrap();
    assert_eq!(made.value(Constant::LinkByte), 12.0);
    for (name, unit, value, part) in [
        ("link_byte", "pj", -1.0, "use 0 to"),
        ("link_byte", "pj", f64::NAN, "use 0 to"),
        ("link_byte", "mw", 1.0, "use pj"),
        ("link", "pj", 1.0, "link_byte"),
        ("pll", "uncertainty_factor", 0.0, "use 1 to"),
    ] {
        let message = made.set(name, unit, value).unwrap_err().to_string();
        assert!(message.contains(part) && message.contains(&format!("energy.constant.{name}.{unit}")), "{message}");
    }
}

#[test]
fn the_node_of_a_design_follows_its_supply_before_its_year() {
    assert_eq!(Technology::auto_name(Some(1.8), Some(2020)), "180nm");
    assert_eq!(Technology::auto_name(Some(1.1), None), "40nm");
    assert_eq!(Technology::auto_name(None, Some(2010)), "110nm");
    assert_eq!(Technology::auto_name(None, None), "65nm");
    for supply_v in [3.3, 1.5, 1.2, 1.1, 0.9] {
        Technology::by_name(Technology::auto_name(Some(supply_v), None)).unwrap();
    }
}
