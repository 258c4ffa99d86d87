//! Hard cases that are tested beside their stage because they need its private parts, a peer's answers or a whole run. Checks that every
//! listed test exists in its file.

use std::fmt::Write as _;
use std::path::Path;

/// Stage, case, file, test.
pub const TESTS: &[[&str; 4]] = &[
    [
        "scene",
        "single rays, packets and every SIMD level, 1e5 m off the origin",
        "src/scene/tracer/tests.rs",
        "a_ray_meets_the_same_alone_and_in_any_company_at_every_level",
    ],
    [
        "scene",
        "needles, axis-parallel rays and rays from corners, tree against all triangles",
        "src/scene/tracer/tests.rs",
        "the_tree_finds_what_trying_all_triangles_finds_bit_for_bit",
    ],
    [
        "scene",
        "edges and corners of a closed room",
        "src/scene/tracer/tests.rs",
        "no_ray_leaves_a_closed_room_not_even_at_edges_and_corners",
    ],
    ["scene", "soups of triangles against Embree", "tests/rays.rs", "soups_of_triangles_agree_with_embree"],
    [
        "scene",
        "furnace: sum of all bounces, albedo to 1",
        "src/scene/bake.rs",
        "a_closed_glowing_box_settles_at_the_sum_of_all_bounces",
    ],
    [
        "scene",
        "form factor of a lamp, from its own plane on",
        "src/scene/bake.rs",
        "light_straight_from_a_square_lamp_is_its_form_factor",
    ],
    [
        "scene",
        "seam and poles of a sharp environment map",
        "src/scene/environment/tests.rs",
        "seam_and_poles_are_smooth",
    ],
    [
        "motion",
        "velocities of 60 s summed back to the path",
        "tests/imu.rs",
        "derivatives_integrated_over_a_minute_return_the_trajectory",
    ],
    [
        "motion",
        "second derivatives on both sides of every knot",
        "tests/motion.rs",
        "pose_velocity_and_acceleration_are_continuous_over_knots",
    ],
    [
        "optics",
        "round trips to the rim of every lens",
        "src/optics/lens/wide_tests.rs",
        "positions_and_bearings_return_to_themselves_up_to_the_rim",
    ],
    [
        "optics",
        "two bearings never share a position",
        "src/optics/lens/tests.rs",
        "no_two_bearings_of_the_domain_share_a_position",
    ],
    [
        "draw",
        "Poisson row kernel against its slow twin over all means",
        "src/draw/poisson.rs",
        "the_row_kernel_equals_its_slow_twin_over_all_means",
    ],
    ["pixel", "every effect at the ends of its range at once", "tests/pixel.rs", "hard_cases_stay_finite"],
    [
        "adc",
        "black level at every depth and sampling",
        "tests/adc.rs",
        "zero_light_is_the_black_level_at_every_depth_and_kind_of_sampling",
    ],
    [
        "adc",
        "random converters, closed form against clocks",
        "tests/twins.rs",
        "the_closed_form_is_the_clocked_converter_in_every_column_of_random_configs",
    ],
    [
        "readout",
        "the line or frame that an error names, and one less",
        "tests/timing.rs",
        "the_line_or_frame_that_an_error_names_does_do_and_one_less_does_not",
    ],
    [
        "link",
        "every flipped bit of a header and every pair",
        "src/link/checks.rs",
        "every_flipped_bit_of_a_header_is_corrected_and_every_pair_is_refused",
    ],
    [
        "tracker",
        "exp, log and Jacobians of SE(3) and Sim(3) against 60 digits, 0 to pi",
        "tests/lie.rs",
        "exponentials_and_jacobians_equal_sixty_digit_references_from_zero_to_pi",
    ],
    [
        "tracker",
        "a million composed rotations",
        "tests/lie.rs",
        "a_million_composed_rotations_stay_on_the_manifold_and_end_where_they_must",
    ],
    [
        "tracker",
        "points behind the camera in a pose fit",
        "tests/estimation/pnp.rs",
        "points_behind_the_camera_are_outliers_and_pull_at_nothing",
    ],
    [
        "tracker",
        "points at infinity in a pose fit",
        "tests/estimation/pnp.rs",
        "points_at_infinity_fix_the_turn_and_leave_the_position",
    ],
    [
        "tracker",
        "collinear points in a pose fit",
        "tests/estimation/pnp.rs",
        "points_on_a_line_give_no_sample_a_bounded_step_and_no_bound",
    ],
    ["tracker", "identical poses", "tests/estimation/pnp.rs", "identical_poses_measure_no_motion"],
    [
        "tracker",
        "five points under pure rotation",
        "tests/estimation/initial.rs",
        "turning_on_the_spot_is_called_a_rotation_and_starts_no_map",
    ],
    ["tracker", "low parallax", "tests/estimation/initial.rs", "low_parallax_keeps_its_rotation_and_starts_no_map"],
    ["tracker", "a jump in time", "tests/tracker/hard.rs", "a_jump_in_time_is_bridged_by_the_map"],
    ["tracker", "plateaus of 2 bits", "tests/tracker/hard.rs", "plateaus_of_two_bits_are_tracked"],
    ["tracker", "a frame without features", "tests/tracker.rs", "a_frame_without_features_is_lost_and_never_a_panic"],
    ["tracker", "all features on a line", "tests/tracker.rs", "features_on_one_line_give_finite_poses_or_none"],
    ["tracker", "a planar scene", "tests/tracker.rs", "a_single_plane_is_enough"],
    [
        "tracker",
        "dark frames, then light",
        "tests/tracker/hard.rs",
        "dark_frames_wait_and_the_map_starts_with_the_light",
    ],
    [
        "tracker",
        "bundle adjustment with outliers against gtsam",
        "tests/estimation/adjustment.rs",
        "an_adjustment_with_outliers_ends_where_gtsam_ends",
    ],
    ["report", "a line and a point have no alignment", "src/report/align.rs", "a_point_and_a_line_are_refused_by_name"],
];

/// Finds every test in its file; gives back the page's lines.
pub fn lines() -> String {
    let mut lines = String::new();
    for [stage, case, file, test] in TESTS {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{file}: {error}"));
        assert!(
            text.contains(&format!("#[test]\n    fn {test}()")) || text.contains(&format!("#[test]\nfn {test}()")),
            "{file} has no test {test}"
        );
        writeln!(lines, "| {stage} | {case} | `{test}` in {file} |").expect("a string takes all");
    }
    lines
}
