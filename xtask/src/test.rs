//! `cargo xtask test`: everything that must hold, on a fresh machine, on every driver that is there.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};
use std::time::Instant;

use crate::drivers::{Driver, Optional, first};
use crate::{cargo, program, root, run};

const USAGE: &str = "\
Usage: cargo xtask test [--drivers] [ARGUMENTS OF CARGO TEST...]

Format, lints, documentation; all tests on Mesa lavapipe, which is installed if need be; then those
that open a GPU on SwiftShader and on llvmpipe through GL, where these are there. Where the
environment names a driver (VK_ICD_FILENAMES, VK_DRIVER_FILES, WGPU_BACKEND), on that alone.

  --drivers   install the drivers that are missing; it is an error if one cannot be

Further arguments choose tests: the same on every driver.
";

/// Tests that open no GPU: once is enough. All other files of `tests/` run on every driver.
const WITHOUT_GPU: [&str; 3] = ["effects", "output", "scene"];

/// What the program is asked on every driver after the tests: each must exit with 0.
const COMMANDS: [&[&str]; 2] = [&["devices"], &["check", "--quick"]];

/// What a driver has come to.
struct Part {
    driver: &'static str,
    adapter: String,
    passed: u64,
    failed: u64,
    seconds: f64,
    /// Why it has not held.
    fault: Option<String>,
}

/// Runs the tests; further arguments go to `cargo test`.
pub(crate) fn all(arguments: &[String]) -> Result<(), String> {
    // What comes after `--` is the test harness's.
    let ours = arguments.split(|a| a == "--").next().unwrap_or_default();
    if ours.iter().any(|a| a == "--help" || a == "-h") {
        print!("{USAGE}");
        return Ok(());
    }
    let install = ours.iter().any(|a| a == "--drivers");
    let arguments: Vec<&str> = arguments
        .iter()
        .map(String::as_str)
        .filter(|a| *a != "--drivers")
        .collect();
    let (driver, alone) = first()?;
    lints()?;
    // Separate, so that what follows takes the time of the tests.
    run(cargo().args(["test", "--workspace", "--no-run"]))?;

    let adapter = driver
        .adapter()
        .ok_or_else(|| format!("the program finds no usable adapter on {}", driver.name))?;
    let mut parts = vec![on(&driver, adapter, &["--workspace".into()], &arguments)];
    let mut missing = Vec::new();
    for optional in Optional::ALL.into_iter().filter(|_| !alone) {
        let mut found = optional.find();
        let mut why = "`cargo xtask test --drivers` installs it".to_owned();
        if found.is_none() && install {
            if let Err(error) = optional.install() {
                why = error;
            } else {
                why = "the program finds no usable adapter".into();
                found = optional.find();
            }
        }
        match found {
            Some((driver, adapter)) => {
                let chosen = if arguments.is_empty() {
                    with_gpu()?
                } else {
                    vec!["--workspace".into()]
                };
                parts.push(on(&driver, adapter, &chosen, &arguments));
            }
            None => {
                eprintln!("no tests on {}: {why}", optional.name());
                missing.push((optional.name(), why));
            }
        }
    }
    summarize(&parts, &missing, install)
}

/// What needs no driver.
fn lints() -> Result<(), String> {
    // Components that a minimal toolchain may lack are checked where they are there.
    if has("fmt") {
        run(cargo().args(["fmt", "--all", "--check"]))?;
    }
    if has("clippy") {
        run(cargo().args([
            "clippy",
            "--workspace",
            "--all-targets",
            "--",
            "-D",
            "warnings",
        ]))?;
    }
    run(cargo()
        .args(["doc", "--no-deps", "--quiet"])
        .env("RUSTDOCFLAGS", "-D warnings"))
}

/// Whether `cargo NAME` is installed.
fn has(name: &str) -> bool {
    cargo()
        .args([name, "--version"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

/// Arguments of `cargo test` that choose the tests that open a GPU.
fn with_gpu() -> Result<Vec<String>, String> {
    let folder = root().join("tests");
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    let mut names = Vec::new();
    for entry in fs::read_dir(&folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let name = path
            .file_stem()
            .and_then(|n| n.to_str())
            .unwrap_or_default();
        if path.extension().is_some_and(|e| e == "rs") && !WITHOUT_GPU.contains(&name) {
            names.push(name.to_owned());
        }
    }
    names.sort();
    let tests = names.into_iter().flat_map(|n| ["--test".into(), n]);
    Ok(["--package".into(), "gpu-trace".into()]
        .into_iter()
        .chain(tests)
        .collect())
}

/// Runs the tests that `chosen` and `arguments` say, and the program's commands, on `driver`.
fn on(driver: &Driver, adapter: String, chosen: &[String], arguments: &[&str]) -> Part {
    println!("\n=== {}: {adapter}", driver.name);
    let before = Instant::now();
    let mut part = Part {
        driver: driver.name,
        adapter,
        passed: 0,
        failed: 0,
        seconds: 0.0,
        fault: None,
    };
    let mut tests = cargo();
    tests
        .args(["test", "--no-fail-fast"])
        .args(chosen)
        .args(arguments);
    part.fault = counted(driver.choose(&mut tests), &mut part).err();
    for arguments in COMMANDS {
        let mut command = Command::new(program("debug"));
        if let Err(error) = run(driver.choose(command.args(arguments))) {
            part.fault.get_or_insert(error);
        }
    }
    part.seconds = before.elapsed().as_secs_f64();
    part
}

/// Runs `tests`, shows what they write and counts what they say.
fn counted(tests: &mut Command, part: &mut Part) -> Result<(), String> {
    let mut child = tests
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|error| format!("cargo test: {error}"))?;
    let output = child.stdout.take().into_iter();
    for line in output.flat_map(|o| BufReader::new(o).split(b'\n')) {
        let line = line.map_err(|error| format!("cargo test: {error}"))?;
        let line = String::from_utf8_lossy(&line);
        println!("{line}");
        if let Some(result) = line.strip_prefix("test result: ") {
            part.passed += count(result, "passed");
            part.failed += count(result, "failed");
        }
    }
    match child.wait() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("cargo test: {status}")),
        Err(error) => Err(format!("cargo test: {error}")),
    }
}

/// The number before `word`, as in `ok. 9 passed; 0 failed`.
fn count(result: &str, word: &str) -> u64 {
    let words: Vec<&str> = result.split([' ', ';']).collect();
    let number = words.windows(2).find(|pair| pair[1] == word);
    number.and_then(|pair| pair[0].parse().ok()).unwrap_or(0)
}

/// The table of all drivers; an error if one of them has not held, or is missing though `wanted`.
fn summarize(parts: &[Part], missing: &[(&str, String)], wanted: bool) -> Result<(), String> {
    println!("\ndriver        passed  failed  seconds  adapter");
    for part in parts {
        println!(
            "{:<12}  {:>6}  {:>6}  {:>7.0}  {}",
            part.driver, part.passed, part.failed, part.seconds, part.adapter
        );
    }
    for (name, why) in missing {
        println!("{name:<12}       -       -        -  not there: {why}");
    }
    println!();
    let mut faults: Vec<String> = parts
        .iter()
        .filter_map(|part| Some(format!("{}: {}", part.driver, part.fault.as_ref()?)))
        .collect();
    if wanted {
        faults.extend(missing.iter().map(|(name, why)| format!("{name}: {why}")));
    }
    if faults.is_empty() {
        Ok(())
    } else {
        Err(faults.join("\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::count;

    #[test]
    fn results_are_counted() {
        let result = "FAILED. 12 passed; 3 failed; 0 ignored; 0 measured; 0 filtered out";
        assert_eq!((count(result, "passed"), count(result, "failed")), (12, 3));
        assert_eq!(count("something else", "passed"), 0);
    }
}
