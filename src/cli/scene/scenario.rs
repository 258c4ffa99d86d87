//! The text of a scenario that looks at a file's scene from a view.

use glam::DVec3;
use sensel::pose::Pose;
use sensel::scene::file_units::UpAxis;
use sensel::scene::views::{self, CameraView};
use sensel::text::escaped;

use super::found::{FileSummary, Light};

/// What follows the light.
const CAMERA: &str = r#"
[motion]
kind = "sway"                    # or walk, run, spin, or a file of poses
scale = {scale}
offset_m = [{offset}]
world_from_motion = [{turn}]

[run]
frames = 30

[optics]
{optics}

[sensor]
preset = "paper_6t_vga"          # or another of 'sensel presets', or "./my_sensor.toml"

[sensor.readout]
exposure_us = 4000.0
"#;

/// For a camera in the open that no lamp of the file lights.
const SKY: &str = r#"
[scene.sky]
kind = "overcast"                # no lamp of the file lights the camera, which is in the open
"#;

/// For a camera that no light reaches and that sees no sky.
const LAMP: &str = r"
[[scene.lamp]]                   # no light of the file reaches the camera, and it sees no sky
position_m = [{lamp}]
radius_m = {radius}
flux_lm = 800.0
";

/// A scenario that looks from a view.
pub fn text(found: &FileSummary, view: &CameraView) -> String {
    let Pose { rotation, translation_m } = view.world_from_camera;
    // A motion starts level along -z: the rest of the view's orientation is the motion's.
    let turn = (rotation * views::looking(0.0, 0.0).inverse()).normalize();
    let file = toml::Value::from(found.name.as_str());
    // A name may hold a line break, which would end the comment.
    let name = escaped(&found.name);
    let mut text = format!("# {name}, from 'sensel scene'.\n[scene]\nfile = {file}\n");
    if found.units.metres != 1.0 {
        text.push_str(&format!(
            "scale = {:?}                     # metres of a unit of the file\n",
            found.units.metres
        ));
    }
    if found.units.up == UpAxis::Z {
        text.push_str("up = \"z\"\n");
    }
    text.push_str("illuminance_lux = 500.0          # at the camera, on a horizontal plane: a well-lit room\n");
    match found.light {
        Light::Own => {}
        Light::Sky => text.push_str(SKY),
        Light::Lamp { above_m } => {
            let lamp_m = translation_m + above_m * DVec3::Y;
            let lamp = LAMP.replace("{lamp}", &rounded(&lamp_m.to_array(), 3));
            text.push_str(&lamp.replace("{radius}", &format!("{:.3}", (0.02 * above_m).clamp(0.001, 1.0))));
        }
    }
    // A sway of some centimetres suits a room; small things get less.
    let scale = (view.median_m / 2.0).clamp(0.02, 1.0);
    let fov_deg = view.horizontal_fov_rad.to_degrees();
    let optics = if view.horizontal_fov_rad == views::FOV_RAD {
        "preset = \"radtan_90\"             # 90 degrees across; 'sensel presets' lists others".to_owned()
    } else {
        format!("preset = \"pinhole_90\"\nhorizontal_fov_deg = {fov_deg:.2}       # of the file's camera")
    };
    let camera = CAMERA
        .replace("{optics}", &optics)
        .replace("{scale}", &format!("{scale:.2}"))
        .replace("{offset}", &rounded(&translation_m.to_array(), 3))
        .replace("{turn}", &rounded(&turn.to_array(), 9));
    text + &camera
}

fn rounded(values: &[f64], digits: usize) -> String {
    let texts: Vec<String> = values.iter().map(|value| format!("{value:.digits$}")).collect();
    texts.join(", ")
}
