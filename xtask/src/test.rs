//! `cargo xtask test`: everything that must hold, on a fresh machine, on every driver that is there.

use std::process::Command;
use std::time::Instant;

use crate::drivers::{Driver, Optional, first};
use crate::suite::{self, Count, Part, Tests};
use crate::{lints, program};

const USAGE: &str = "\
Usage: cargo xtask test [--all] [--drivers] [ARGUMENTS OF CARGO TEST...] [-- PARTS OF NAMES... OPTIONS...]

Format, lints, documentation; all tests on Mesa lavapipe, which is installed if need be; then those
that another driver may answer differently on SwiftShader, on llvmpipe through GL and on a current Mesa,
where these are there. Where the environment names a driver (VK_ICD_FILENAMES, VK_DRIVER_FILES, WGPU_BACKEND), on that
alone.

  --all       the long forms of the tests, and all of them on every driver
  --drivers   install the drivers that are missing; it is an error if one cannot be

Further arguments choose tests, the same on every driver, and options of their harness: `-- faults::disks
--nocapture`, say, or `--lib`.
";

/// Set to 1 for tests that have a long form.
const LONG_FORMS: &str = "GPU_TRACE_TEST_ALL";

/// What another driver may answer differently is what stands between the kernel's sources and its machine: how
/// naga and the driver translate functions, loops, layouts of structs, bindings, and limits; what their arithmetic
/// keeps; buffers and textures; how a render goes on in the next dispatch. That is asked there by single functions
/// (`functions`, `materials`, `sobol` and others, and by [`CASES`]), by a kernel of everything (`prices`), and by a few
/// images on the same paths as those of the reference (`agreement`, `motion`, `sky`, `textures`). Statistics of light
/// transport, and more scenes of the same functions, say that again: the first driver has them.
///
/// The files of `tests/` that one driver answers for all: those that open no GPU; those of files, options,
/// processes and studies, to which a GPU is one like another; those of light transport.
const ONCE: [&str; 40] = [
    "albedo_variance",
    "car_paint",
    "choice",
    "claims",
    "cli",
    "cli_commands",
    "cli_errors",
    "cli_process",
    "compare",
    "containment",
    "converge",
    "coverage",
    "dispersion",
    "distribution",
    "effects",
    "film_files",
    "frames",
    "furnace",
    "fuzz",
    "gpu_trace",
    "hazards",
    "input",
    "job",
    "lamp_images",
    "ledger",
    "library",
    "material_keys",
    "measured",
    "mix",
    "modules",
    "naive",
    "output",
    "particles",
    "placement",
    "price",
    "references",
    "scene",
    "slurm",
    "variance_law",
    "xtask",
];

/// The files of which only these tests run on every driver, for the reasons above. All other files do as a whole.
const PARTLY: [(&str, &[&str]); 14] = [
    (
        "absorption",
        &[
            "a_ball_seen_through_its_centre_absorbs_along_its_diameter",
            "transmittance_is_beers",
        ],
    ),
    // Which tiles are rendered, and that it goes on where it was.
    (
        "adaptive",
        &[
            "device_and_host_take_the_same_samples",
            "timing_changes_no_bits",
        ],
    ),
    // Kernels that no other file has.
    (
        "agreement",
        &[
            "of_coincident_spheres_the_first_wins",
            "other_kernels_agree_with_the_reference",
            "the_radiance_cache_agrees_with_the_reference",
        ],
    ),
    // Sums beside the image.
    (
        "aov",
        &[
            "both_renderers_have_the_same_layers",
            "the_image_is_the_same_with_and_without",
            "what_is_seen_first_is_where_it_is",
        ],
    ),
    // Cases are asked one by one: see `CASES`.
    ("check", &["the_driver_keeps_what_the_kernel_needs"]),
    (
        "faults",
        &[
            "a_device_that_fails_costs_no_sample_that_was_done",
            "a_scene_beyond_the_devices_limits_is_an_error",
        ],
    ),
    // Single functions, and the same paths by every way to sample lamps.
    (
        "lights",
        &[
            "both_backends_sample_the_same_lights",
            "cone_directions_are_uniform",
            "cones_keep_their_digits",
            "weights_share_all_that_there_is",
        ],
    ),
    // What drivers do to long loops; not what is bound and looped over, which the kernel's text says.
    (
        "limits",
        &[
            "a_path_longer_than_any_dispatch_is_an_error_or_right",
            "a_path_within_which_a_loop_ends_is_an_error_or_right",
            "bindings_are_found_by_name",
            "large_images_stop_between_their_parts",
            "more_bounces_than_a_loop_may_have_in_one_dispatch",
            "more_spheres_than_a_loop_may_visit_in_one_dispatch",
            "paths_in_a_tree_go_on_in_the_next_dispatch",
        ],
    ),
    (
        "motion",
        &[
            "all_geometries_have_one_image",
            "images_and_layers_are_those_of_the_reference",
        ],
    ),
    // A kernel of everything.
    ("prices", &["unused_effects_change_no_image"]),
    ("radiance_cache", &["dark_cells_are_cells"]),
    (
        "samplers",
        &[
            "samples_are_a_function_of_seed_pixel_and_index",
            "the_same_paths_and_error_bars_on_device_and_host",
        ],
    ),
    (
        "sky",
        &[
            "densities_agree_where_paths_arrive",
            "directions_are_drawn_by_their_pdf",
            "every_geometry_has_the_same_paths_as_the_reference",
            "gradients_agree",
            "images_agree_with_the_reference",
            "lookups_agree",
            "parts_are_exact",
            "turns_agree",
        ],
    ),
    (
        "textures",
        &[
            "a_huge_ground_is_that_of_f64",
            "a_roughness_may_be_smooth_in_places",
            "at_the_axis_the_first_row_is_seen",
            "gradients_are_those_of_the_device",
            "image_lookups_agree",
            "materials_are_what_their_textures_say",
            "noises_agree",
            "the_layer_albedo_shows_the_texture",
        ],
    ),
];

/// Tests of the other files of which one driver's answer is enough: companions, since that a test can fail
/// is no matter of the driver; those that run no kernel; and those of light transport, as above.
const SKIPPED: [&str; 8] = [
    "companion",
    "every_scene_by_the_tree_is_that_of_the_list",
    "every_sphere_is_in_every_box_around_it",
    "glsl_has_the_same_layouts",
    "lamps_are_found_on_both_sides",
    "light_goes_both_ways",
    "neighbouring_seeds_are_uncorrelated",
    "what_is_apart_is_beside_the_tree",
];

/// These take longest, and so begin first.
const LONGEST: [&str; 5] = ["effects", "lights", "samplers", "price", "check"];

/// What the program is asked on every driver after the tests.
const COMMANDS: [&[&str]; 2] = [&["devices"], &["check", "--quick"]];
/// The file `check` of the tests has all cases on the first driver, so that one shows that the program has them too.
const ONE_CASE: &str = "35";
/// On the others those of arithmetic that is the driver's, and of buffers and dispatches.
const CASES: &str = "1,3,6,9,16,17,22,23,33,34,35,36,37,42,43";

/// Runs the tests that `arguments` choose.
///
/// # Errors
/// Whatever does not hold.
pub(crate) fn all(arguments: &[String]) -> Result<(), String> {
    let begin = Instant::now();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    // What comes after `--` is the test harness's.
    let end = arguments.iter().position(|a| *a == "--");
    let (ours, filters) = arguments.split_at(end.unwrap_or(arguments.len()));
    if ours.iter().any(|a| *a == "--help" || *a == "-h") {
        print!("{USAGE}");
        return Ok(());
    }
    let has = |option: &str| ours.contains(&option);
    let (long, install) = (has("--all"), has("--drivers"));
    let mut chosen = ours.to_vec();
    chosen.retain(|a| !["--all", "--drivers"].contains(a));
    if chosen.first().is_some_and(|a| !a.starts_with('-')) {
        return Err(format!("parts of names of tests come after `--`\n{USAGE}"));
    }
    let (options, filters): (Vec<&str>, Vec<&str>) =
        (filters.iter().skip(1)).partition(|a| a.starts_with('-'));

    let (driver, alone) = first()?;
    lints::all()?;
    let tests = match chosen[..] {
        [] => suite::build(&["--workspace"])?,
        _ => suite::build(&chosen)?,
    };
    let adapter = driver
        .adapter()
        .ok_or_else(|| format!("the program finds no usable adapter on {}", driver.name))?;
    let part = |driver, adapter, elsewhere| Part {
        commands: commands(long, elsewhere),
        tests: choose(&tests, &filters, elsewhere),
        options: options.iter().map(|&o| o.to_owned()).collect(),
        driver,
        adapter,
    };
    let all = choose(&tests, &filters, false);
    if all.is_empty() {
        return Err(format!("no test has {} in its name", filters.join(" or ")));
    }
    // Who chooses tests gets just these.
    let elsewhere = !long && chosen.is_empty() && filters.is_empty();
    let mut parts = vec![part(driver, adapter, false)];
    let mut missing = Vec::new();
    for optional in Optional::ALL.into_iter().filter(|_| !alone) {
        match there(optional, install) {
            Ok((driver, adapter)) => parts.push(part(driver, adapter, elsewhere)),
            Err(why) => {
                eprintln!("no tests on {}: {why}", optional.name());
                missing.push((optional.name(), why));
            }
        }
    }
    let named: Vec<(&'static str, String)> = parts
        .iter()
        .map(|part| (part.driver.name, part.adapter.clone()))
        .collect();
    let environment = long.then_some((LONG_FORMS, "1"));
    let counts = suite::run(parts, environment);
    summarize(
        &named,
        counts,
        &missing,
        install,
        begin.elapsed().as_secs_f64(),
    )
}

/// The driver and its adapter; else why there is none.
fn there(optional: Optional, install: bool) -> Result<(Driver, String), String> {
    let found = optional.find();
    if found.is_none() && install {
        optional.install()?;
        return optional
            .find()
            .ok_or_else(|| "the program finds no usable adapter".into());
    }
    found.ok_or_else(|| "`cargo xtask test --drivers` installs it".into())
}

/// What of `tests` runs on a driver, the longest first: of all names that contain one of `filters`, if there
/// are any; `elsewhere`: on a driver that is not the first.
fn choose(tests: &[Tests], filters: &[&str], elsewhere: bool) -> Vec<Tests> {
    let any = |case: &str, parts: &[&str]| parts.iter().any(|part| case.contains(part));
    let mut chosen: Vec<Tests> = tests
        .iter()
        .filter(|tests| !elsewhere || !ONCE.contains(&tests.name.as_str()))
        .cloned()
        .collect();
    for tests in &mut chosen {
        let part = PARTLY.iter().find(|(name, _)| *name == tests.name);
        let (_, part) = part.copied().unzip();
        tests.retain(|case| filters.is_empty() || any(case, filters));
        if elsewhere {
            tests.retain(|case| !any(case, &SKIPPED));
            tests.retain(|case| part.is_none_or(|part| part.contains(&last(case))));
        }
    }
    chosen.retain(|tests| !tests.is_empty());
    let rank = |name: &str| LONGEST.iter().position(|l| *l == name);
    chosen.sort_by_key(|tests| rank(&tests.name).unwrap_or(LONGEST.len()));
    chosen
}

/// The name of a test without those of its modules.
fn last(case: &str) -> &str {
    case.rsplit("::").next().unwrap_or(case)
}

fn commands(long: bool, elsewhere: bool) -> Vec<Command> {
    let cases = if elsewhere { CASES } else { ONE_CASE };
    let all = COMMANDS.iter().map(|arguments| {
        let mut command = Command::new(program("debug"));
        command.args(*arguments);
        if !long && arguments.contains(&"check") {
            for case in cases.split(',') {
                command.args(["--case", case]);
            }
        }
        command
    });
    all.collect()
}

/// The table of all drivers, and a line as the test harness has it; an error if a driver has not held,
/// or is missing though `wanted`.
fn summarize(
    parts: &[(&str, String)],
    counts: Vec<Count>,
    missing: &[(&str, String)],
    wanted: bool,
    seconds: f64,
) -> Result<(), String> {
    println!("\ndriver        passed  failed  seconds  adapter");
    for ((driver, adapter), count) in parts.iter().zip(&counts) {
        println!(
            "{driver:<12}  {:>6}  {:>6}  {:>7.0}  {adapter}",
            count.passed, count.failed, count.seconds
        );
    }
    for (name, why) in missing {
        println!("{name:<12}       -       -        -  not there: {why}");
    }
    let mut faults: Vec<String> = counts.iter().flat_map(|c| c.faults.clone()).collect();
    if wanted {
        faults.extend(missing.iter().map(|(name, why)| format!("{name}: {why}")));
    }
    let mut all = Count::default();
    counts.into_iter().for_each(|count| all.add(count));
    println!(
        "\ntest result: {}. {} passed; {} failed; {} ignored; 0 measured; {} filtered out; finished in \
         {seconds:.2}s\n",
        if faults.is_empty() { "ok" } else { "FAILED" },
        all.passed,
        all.failed,
        all.ignored,
        all.filtered,
    );
    if faults.is_empty() {
        Ok(())
    } else {
        Err(faults.join("\n"))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{LONGEST, ONCE, PARTLY, SKIPPED};
    use crate::root;

    /// A name that no file has any more would choose nothing, in silence.
    #[test]
    fn all_names_are_there() {
        let partly = PARTLY.iter().map(|(name, _)| name);
        for name in ONCE.iter().chain(partly).chain(&LONGEST) {
            let place = root().join("tests").join(name);
            let there = place.with_extension("rs").exists() || place.join("mod.rs").exists();
            assert!(there || ["gpu_trace", "xtask"].contains(name), "{name}");
        }
    }

    /// A file that is no module of `tests/main.rs` would not run, in silence.
    #[test]
    fn all_files_are_modules() {
        let folder = root().join("tests");
        let main = std::fs::read_to_string(folder.join("main.rs")).expect("tests/main.rs");
        for entry in std::fs::read_dir(folder).expect("tests/") {
            let path = entry.expect("an entry of tests/").path();
            let is_module =
                path.join("mod.rs").exists() || path.extension().is_some_and(|e| e == "rs");
            let name = path.file_stem().expect("a name").to_string_lossy();
            if is_module && name != "main" {
                assert!(main.contains(&format!("\nmod {name};\n")), "{name}");
            }
        }
    }

    /// All sources in a folder or a file.
    fn text(path: &Path) -> String {
        if path.is_dir() {
            let entries = std::fs::read_dir(path).expect("a folder");
            return entries
                .map(|e| text(&e.expect("an entry").path()))
                .collect();
        }
        // Folders have other files than sources.
        std::fs::read_to_string(path).unwrap_or_default()
    }

    #[test]
    fn skipped_tests_are_there() {
        let all = text(&root().join("tests"));
        for name in SKIPPED {
            assert!(all.contains(&format!("fn {name}")), "{name}");
        }
    }

    /// A test that is renamed would run on one driver, in silence.
    #[test]
    fn chosen_tests_are_there() {
        for (name, part) in PARTLY {
            let place = root().join("tests").join(name);
            let all = text(&place.with_extension("rs")) + &text(&place);
            for test in part {
                assert!(all.contains(&format!("fn {test}()")), "{name}: {test}");
            }
            assert!(part.is_sorted(), "{name}");
        }
    }

    #[test]
    fn names_are_in_order() {
        assert!(ONCE.is_sorted());
    }
}
