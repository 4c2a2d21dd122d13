//! `cargo xtask test`: everything that must hold, on a fresh machine, on every driver that is there.

use std::process::Command;
use std::time::Instant;

use crate::drivers::{Driver, Optional, first};
use crate::suite::{self, Count, Part, Tests};
use crate::{lints, program};

const USAGE: &str = "\
Usage: cargo xtask test [--all] [--drivers] [ARGUMENTS OF CARGO TEST...] [-- PARTS OF NAMES... OPTIONS...]

Format, lints, documentation; all tests on Mesa lavapipe, which is installed if need be; then those
that another driver may answer differently on SwiftShader and on llvmpipe through GL, where these are
there. Where the environment names a driver (VK_ICD_FILENAMES, VK_DRIVER_FILES, WGPU_BACKEND), on that
alone.

  --all       the long forms of the tests, and all of them on every driver
  --drivers   install the drivers that are missing; it is an error if one cannot be

Further arguments choose tests, the same on every driver, and options of their harness: `-- faults::disks
--nocapture`, say, or `--lib`.
";

/// Set to 1 for tests that have a long form.
const LONG_FORMS: &str = "GPU_TRACE_TEST_ALL";

/// Tests that one driver answers for all: those that open no GPU; those of files, options, processes and
/// studies, to which a GPU is one like another; and those of light transport, whose formulas are asked
/// on every driver by the others, one by one (`functions`, `materials`, `check`) and in whole images
/// (`agreement`, `hazards`). All other files of `tests/` run on every driver.
const ONCE: [&str; 35] = [
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
    "distribution",
    "effects",
    "film_files",
    "frames",
    "furnace",
    "fuzz",
    "gpu_trace",
    "input",
    "job",
    "ledger",
    "material_keys",
    "measured",
    "mix",
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

/// Of these only what the filter finds runs on every driver: devices that fail.
const PARTLY: [(&str, &str); 1] = [("faults", "device")];

/// Tests of the other files of which one driver's answer is enough: companions, since that a test can fail
/// is no matter of the driver; those that link kernels and run none; and those of light transport, as above.
const SKIPPED: [&str; 22] = [
    "companion",
    "a_constant_index_is_that_of_the_plain_glass_in_the_mean",
    "a_moving_lamp_is_the_mean_of_its_frames",
    "all_estimators_converge_to_the_same",
    "colours_come_in_their_order",
    "error_bars_are_true",
    "every_estimator_has_the_same_classes",
    "every_loop_is_accounted_for",
    "few_storage_buffers_are_bound",
    "glsl_has_the_same_layouts",
    "lamps_are_found_on_both_sides",
    "lamps_are_not_sampled_from_within",
    "lamps_close_by_and_walls_are_sampled_without_bias",
    "light_goes_both_ways",
    "nothing_is_too_dark",
    "the_classes_add_up_to_the_image",
    "the_program_says_what_moves",
    "the_reference_without_light_sampling_agrees",
    "ways_that_cannot_be_are_refused_with_their_lines",
    "what_does_not_move_has_no_motion_in_its_kernel",
    "what_is_decided_holds_at_all_times",
    "whatever_moves_is_the_mean_of_its_frames",
];

/// These take longest, and so begin first.
const LONGEST: [&str; 5] = ["effects", "lights", "samplers", "price", "check"];

/// What the program is asked on every driver after the tests.
const COMMANDS: [&[&str]; 2] = [&["devices"], &["check", "--quick"]];
/// The file `check` of the tests has all cases, so that one shows that the program has them too.
const ONE_CASE: [&str; 2] = ["--case", "35"];

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
        commands: commands(long),
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
        tests.retain(|case| filters.is_empty() || any(case, filters));
        if elsewhere {
            tests.retain(|case| !any(case, &SKIPPED));
            tests.retain(|case| part.is_none_or(|(_, part)| case.contains(part)));
        }
    }
    chosen.retain(|tests| !tests.is_empty());
    let rank = |name: &str| LONGEST.iter().position(|l| *l == name);
    chosen.sort_by_key(|tests| rank(&tests.name).unwrap_or(LONGEST.len()));
    chosen
}

fn commands(long: bool) -> Vec<Command> {
    let all = COMMANDS.iter().map(|arguments| {
        let mut command = Command::new(program("debug"));
        command.args(*arguments);
        if !long && arguments.contains(&"check") {
            command.args(ONE_CASE);
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

    #[test]
    fn skipped_tests_are_there() {
        let folder = std::fs::read_dir(root().join("tests")).expect("tests/");
        let files = folder.filter_map(|entry| std::fs::read_to_string(entry.ok()?.path()).ok());
        let all: String = files.collect();
        for name in SKIPPED {
            assert!(all.contains(&format!("fn {name}")), "{name}");
        }
    }

    #[test]
    fn names_are_in_order() {
        assert!(ONCE.is_sorted());
    }
}
