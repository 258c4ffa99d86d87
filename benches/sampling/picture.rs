//! Draws error against rays, by name, as SVG.

use std::fmt::Write as _;

/// Curves over doubly logarithmic axes: 1 to 256 samples, 0.001 to 100.
pub fn svg(curves: &[(String, Vec<(f64, f64)>)]) -> String {
    let x = |samples: f64| 60.0 + 560.0 * libm::log2(samples) / 8.0;
    let y = |ratio: f64| 40.0 + 400.0 * (2.0 - libm::log10(ratio.max(1e-3))) / 5.0;
    let mut text = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 860 490\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"860\" height=\"490\" fill=\"white\"/>\n<text x=\"340\" y=\"480\" text-anchor=\"middle\">samples per pixel</text>\n\
         <text x=\"20\" y=\"24\">render variance over photon variance, 1,000 e- mean</text>\n",
    );
    let add = |text: &mut String, line: String| writeln!(text, "{line}").expect("text grows");
    for power in 0..=8 {
        let at = x(f64::from(1 << power));
        add(
            &mut text,
            format!(
                "<path d=\"M{at:.1} 40V440\" stroke=\"#ddd\"/><text x=\"{at:.1}\" y=\"458\" text-anchor=\"middle\">{}</text>",
                1 << power
            ),
        );
    }
    for ratio in [0.001, 0.01, 0.1, 1.0, 10.0, 100.0] {
        let at = y(ratio);
        let stroke = if ratio == 0.1 { "#888" } else { "#ddd" };
        add(
            &mut text,
            format!(
                "<path d=\"M60 {at:.1}H620\" stroke=\"{stroke}\"/><text x=\"54\" y=\"{:.1}\" text-anchor=\"end\">{ratio}</text>",
                at + 4.0
            ),
        );
    }
    let colours = ["#1b6ca8", "#c8553d", "#2a9d5c"];
    let dashes = ["", "6 3", "1 4"];
    for (number, (name, points)) in curves.iter().enumerate() {
        let coordinates = |&(samples, ratio): &(f64, f64)| format!("{:.1},{:.1}", x(samples), y(ratio));
        let points: Vec<String> = points.iter().map(coordinates).collect();
        let (colour, dash) = (colours[number / 3 % 3], dashes[number % 3]);
        let style = format!(
            "fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" stroke-dasharray=\"{dash}\" stroke-linecap=\"round\""
        );
        add(&mut text, format!("<polyline points=\"{}\" {style}/>", points.join(" ")));
        let at = 60 + 24 * number;
        add(&mut text, format!("<path d=\"M640 {at}H680\" {style}/><text x=\"688\" y=\"{}\">{name}</text>", at + 4));
    }
    text.push_str("</svg>\n");
    text
}
