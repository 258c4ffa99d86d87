//! Sun and sky without files: an environment in cd/m^2 from a kind of sky and the sun's position.
//!
//! The sky's pattern is one of the fifteen of the CIE (CIE S 011 / ISO 15469:2004, Darula and Kittler 2002). Its light and the sun's are
//! those of IES RP-21 (1984) over the sun's elevation: 0.8 + 15.5 sin^0.5 klx of clear sky, 0.3 + 21 sin klx of overcast sky, and
//! 127.5 klx exp(-0.21 m) of direct sun on a surface that faces it, with the air mass m of Kasten and Young (1989). Real
//! skies of one kind differ from that by tens of per cent. Sun and sky both have the illuminant's spectrum: shade is not bluer.

use super::environment::{Environment, Sun, texels_of};
use super::light::{BANDS, Bands};
use crate::num::{f32_nearest, greater, index};

/// What is above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkyKind {
    /// Clouds everywhere; no sun.
    Overcast,
    /// No cloud.
    Clear,
}

/// A sky and its sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    /// Decides light and sun.
    pub kind: SkyKind,
    /// Type of the pattern, 1 to 15 (1 to 6: overcast to partly cloudy; 7 to 15: with a sun).
    pub cie_type: u32,
    /// Of the sun's middle above the horizon, 1 to 90.
    pub sun_elevation_deg: f64,
    /// Clockwise from -z as seen from above: 90 is +x.
    pub sun_azimuth_deg: f64,
    /// Share of the light that the ground beyond the scene sends back up, 0 to 0.9.
    pub ground_reflectance: f64,
}

/// Parameters a, b, c, d, e of the fifteen types.
const PATTERNS: [[f64; 5]; 15] = [
    [4.0, -0.70, 0.0, -1.0, 0.0],
    [4.0, -0.70, 2.0, -1.5, 0.15],
    [1.1, -0.80, 0.0, -1.0, 0.0],
    [1.1, -0.80, 2.0, -1.5, 0.15],
    [0.0, -1.00, 0.0, -1.0, 0.0],
    [0.0, -1.00, 2.0, -1.5, 0.15],
    [0.0, -1.00, 5.0, -2.5, 0.30],
    [0.0, -1.00, 10.0, -3.0, 0.45],
    [-1.0, -0.55, 2.0, -1.5, 0.15],
    [-1.0, -0.55, 5.0, -2.5, 0.30],
    [-1.0, -0.55, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 16.0, -3.0, 0.30],
    [-1.0, -0.15, 16.0, -3.0, 0.30],
    [-1.0, -0.15, 24.0, -2.8, 0.15],
];

/// Texels of the picture: 0.7 degrees each, a fine step in the glow around the sun (which falls by a third over 7.6 degrees).
const SIZE: [u32; 2] = [512, 256];

impl Sky {
    /// Illuminance of the ground by the sky alone, in lux (IES RP-21).
    pub fn diffuse_lux(&self) -> f64 {
        let sin = libm::sin(self.sun_elevation_deg.to_radians());
        match self.kind {
            SkyKind::Overcast => 300.0 + 21_000.0 * sin,
            SkyKind::Clear => 800.0 + 15_500.0 * sin.sqrt(),
        }
    }

    /// Illuminance of a surface that faces the sun, by the sun alone, in lux (IES RP-21; air mass of Kasten and Young).
    pub fn direct_normal_lux(&self) -> f64 {
        let elevation = self.sun_elevation_deg;
        let low = 0.505_72 * libm::pow(elevation + 6.079_95, -1.636_4);
        let air_mass = 1.0 / (libm::sin(elevation.to_radians()) + low);
        match self.kind {
            SkyKind::Overcast => 0.0,
            SkyKind::Clear => 127_500.0 * libm::exp(-0.21 * air_mass),
        }
    }

    /// Unit vector towards the sun.
    pub fn sun_direction(&self) -> [f64; 3] {
        let (sin, cos) = libm::sincos(self.sun_elevation_deg.to_radians());
        let (sin_azimuth, cos_azimuth) = libm::sincos(self.sun_azimuth_deg.to_radians());
        [cos * sin_azimuth, sin, -cos * cos_azimuth]
    }

    /// Luminance relative to the zenith's factor: gradation times indicatrix. `up` is the sine of the elevation, above 0.
    fn pattern(&self, up: f64, cos_to_sun: f64) -> f64 {
        let [a, b, c, d, e] = PATTERNS[index(self.cie_type - 1)];
        let gradation = 1.0 + a * libm::exp(b / greater(up, 1e-3));
        let apart = libm::acos(cos_to_sun.clamp(-1.0, 1.0));
        let right_angle = libm::exp(d * std::f64::consts::FRAC_PI_2);
        let indicatrix = 1.0 + c * (libm::exp(d * apart) - right_angle) + e * cos_to_sun * cos_to_sun;
        gradation * indicatrix
    }

    /// The environment in cd/m^2. Panics for a type that is none of the CIE's.
    pub fn environment(&self) -> Environment {
        assert!((1..=15).contains(&self.cie_type), "the CIE has fifteen types");
        let sun = self.sun_direction();
        let pattern = |[x, y, z]: [f64; 3]| {
            if y > 0.0 { self.pattern(y, x * sun[0] + y * sun[1] + z * sun[2]) } else { 0.0 }
        };
        let grey = |value: f64| -> Bands { [f32_nearest(value); BANDS] };
        // The horizontal illuminance of the pattern as it stands, texel by texel.
        let raw = texels_of(SIZE, |direction| grey(pattern(direction)));
        let horizontal = horizontal_lux(&raw);
        let direct = self.direct_normal_lux();
        let ground = self.ground_reflectance * (self.diffuse_lux() + direct * sun[1]) / std::f64::consts::PI;
        let scale = self.diffuse_lux() / horizontal;
        let half = raw.len() / 2;
        let texels = raw
            .iter()
            .enumerate()
            .map(|(number, texel)| if number < half { grey(f64::from(texel[0]) * scale) } else { grey(ground) })
            .collect();
        let disc = Sun { direction: sun.map(f32_nearest), normal_irradiance: grey(direct) };
        Environment::from_sky(SIZE, texels, (direct > 0.0).then_some(disc))
    }
}

/// Illuminance of the ground by the upper half of a picture.
fn horizontal_lux(texels: &[Bands]) -> f64 {
    let [width, height] = SIZE;
    let mut sum = 0.0;
    for row in 0..height / 2 {
        let edge = |row: u32| libm::cos(std::f64::consts::PI * f64::from(row) / f64::from(height));
        // The integral of cos over the solid angle of a row, shared by its texels.
        let (above, below) = (edge(row), edge(row + 1));
        let weight = std::f64::consts::PI * (above * above - below * below) / f64::from(width);
        for column in 0..width {
            sum += f64::from(texels[index(row * width + column)][0]) * weight;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::bake::light_points::LightPoints;
    use super::super::bake::rays::Receiver;
    use super::super::bake::shadow_rays::shadow_ray_light;
    use super::super::mesh::{Material, Mesh};
    use super::super::texture::Footprint;
    use super::super::{BakeSettings, Illuminant, LitScene, Scene};
    use super::*;
    use glam::DVec3;

    fn sky(kind: SkyKind, cie_type: u32, sun_elevation_deg: f64) -> Sky {
        Sky { kind, cie_type, sun_elevation_deg, sun_azimuth_deg: 30.0, ground_reflectance: 0.2 }
    }

    #[test]
    fn the_standard_overcast_sky_is_three_times_as_bright_at_the_zenith_as_at_the_horizon() {
        let one = sky(SkyKind::Overcast, 1, 40.0);
        // CIE type 1: gradation 1 + 4 exp(-0.7) = 2.986 at the zenith, 1 at the horizon.
        let ratio = one.pattern(1.0, 0.0) / one.pattern(1e-3, 0.0);
        assert!((ratio - (1.0 + 4.0 * libm::exp(-0.7))).abs() < 1e-9, "{ratio}");
        // Type 5 is even.
        let even = sky(SkyKind::Overcast, 5, 40.0);
        assert!((even.pattern(1.0, 0.0) - even.pattern(0.1, 0.5)).abs() < 1e-12);
    }

    #[test]
    fn sun_and_sky_have_the_light_of_their_elevation() {
        // IES RP-21 at 45 degrees, m = 1.413: 127,500 exp(-0.2967) = 94,760 lx; 800 + 15,500 * 0.8409 = 13,834 lx.
        let clear = sky(SkyKind::Clear, 12, 45.0);
        assert!((clear.direct_normal_lux() / 94_760.0 - 1.0).abs() < 0.002, "{}", clear.direct_normal_lux());
        assert!((clear.diffuse_lux() / 13_834.0 - 1.0).abs() < 1e-4, "{}", clear.diffuse_lux());
        assert!(sky(SkyKind::Overcast, 1, 45.0).direct_normal_lux() == 0.0);
        assert!(sky(SkyKind::Clear, 12, 5.0).direct_normal_lux() < 0.2 * clear.direct_normal_lux());
    }

    fn plate_under(sky: &Sky) -> LitScene {
        let mut mesh = Mesh::default();
        mesh.materials.push(Material::plain("plate", [0.5; 3]));
        mesh.append_quad(0, [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]], [1.0, 1.0]);
        let scene = Scene::new("plate", mesh, [0.0; BANDS]).unwrap().with_environment(sky.environment());
        let settings = BakeSettings::ROOM;
        let bake = scene.bake(&settings, &|_| {});
        scene.lit_absolutely(&bake, DVec3::Y, Illuminant::D65).unwrap()
    }

    #[test]
    fn a_plate_under_open_sky_has_the_horizontal_light_of_the_model() {
        let mut tried = 0;
        for (kind, cie_type, elevation_deg) in [
            (SkyKind::Overcast, 1, 40.0),
            (SkyKind::Overcast, 5, 10.0),
            (SkyKind::Clear, 12, 60.0),
            (SkyKind::Clear, 12, 20.0),
            (SkyKind::Clear, 7, 35.0),
        ] {
            let sky = sky(kind, cie_type, elevation_deg);
            let lit = plate_under(&sky);
            let expected = sky.diffuse_lux() + sky.direct_normal_lux() * sky.sun_direction()[1];
            let exitance = lit.exitance_lux(0, [0.3, 0.3], [0.0, -1.0, 0.0], &Footprint::POINT, 1.0)[1];
            // 256 stratified rays over a smooth sky, and 192 directions of equal power for its glow: 1 % of the sky's share.
            let bound = 0.01 * sky.diffuse_lux() / expected + 0.001;
            let ratio = f64::from(exitance) / (0.5 * expected);
            assert!((ratio - 1.0).abs() < bound, "{sky:?}: {ratio}, bound {bound}");
            tried += 1;
        }
        assert_eq!(tried, 5);
    }

    #[test]
    fn the_sun_is_met_in_its_direction_and_nowhere_else() {
        let sky = sky(SkyKind::Clear, 12, 45.0);
        let environment = sky.environment();
        let towards = DVec3::from_array(sky.sun_direction());
        let side = towards.cross(DVec3::Y).normalize();
        let radiance = |degrees: f64| {
            let turned = towards * libm::cos(degrees.to_radians()) + side * libm::sin(degrees.to_radians());
            f64::from(environment.radiance(turned.to_array().map(f32_nearest))[1])
        };
        // 94,760 lx over 6.72e-5 sr (a disc of 0.53 degrees): 1.41e9 cd/m^2.
        assert!((radiance(0.0) / 1.41e9 - 1.0).abs() < 0.005, "{}", radiance(0.0));
        assert!(radiance(0.255) > 1e9 && radiance(0.275) < 1e6);
        // The steps of f32 in a direction (6e-8) are 3e-6 degrees.
        let points = environment.distant_lights(192).concat();
        assert!(points.len() >= 48);
    }

    /// The share of the sun's disc that is seen past a straight edge, from -1 (all hidden) to 1 (all seen) radii.
    fn seen_share(radii: f64) -> f64 {
        let s = radii.clamp(-1.0, 1.0);
        1.0 - (libm::acos(s) - s * (1.0 - s * s).sqrt()) / std::f64::consts::PI
    }

    #[test]
    fn the_half_shadow_of_an_edge_is_as_wide_as_the_sun_at_its_distance() {
        // A roof 10 m up that ends at x = 0, under a sun at the zenith that has all the light.
        let mut mesh = Mesh::default();
        mesh.materials.push(Material::plain("roof", [0.0; 3]));
        mesh.append_quad(
            0,
            [[-50.0, 10.0, 50.0], [0.0, 10.0, 50.0], [0.0, 10.0, -50.0], [-50.0, 10.0, -50.0]],
            [1.0; 2],
        );
        let sun = Sun { direction: [0.0, 1.0, 0.0], normal_irradiance: [1.0; BANDS] };
        let environment = Environment::from_sky([64, 32], vec![[1e-9; BANDS]; 64 * 32], Some(sun));
        let scene = Scene::new("edge", mesh, [0.0; BANDS]).unwrap().with_environment(environment);
        let half_width_m = 10.0 * libm::tan(0.265_f64.to_radians());
        assert!((2.0 * half_width_m - 0.0925).abs() < 1e-4);
        let mut tried = 0;
        for lamp_rays in [BakeSettings::ROOM.grid_lamp_rays, 4_096] {
            let light_points = LightPoints::new(&scene, lamp_rays, 16);
            let points = f64::from(u32::try_from(light_points.distant.len()).unwrap());
            // A chord crosses at most 2 sqrt(N / pi) of N equal cells of the disc; each counts wrongly by at most a half.
            let bound = 1.0 / (std::f64::consts::PI * points).sqrt();
            for step in -15..=15 {
                let radii = f64::from(step) / 10.0;
                let at_m = [f32_nearest(radii * half_width_m), 0.0, 0.0];
                let receiver = [Receiver { at_m, normal: [0.0, 1.0, 0.0], sides: 1 }];
                let light = shadow_ray_light(&scene, &receiver, &light_points, &[])[0][0].all[0][0];
                let expected = seen_share(radii);
                assert!((light - expected).abs() < bound, "{points} points, {radii} radii: {light}, disc {expected}");
                tried += 1;
            }
        }
        assert_eq!(tried, 62);
    }
}
