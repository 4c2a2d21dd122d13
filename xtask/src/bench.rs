//! `cargo xtask bench`: the benchmarks, as ratios of things that run side by side.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::{cargo, forecasts, program, root, run};

const USAGE: &str = "\
Usage: cargo xtask bench [TABLE...] [--quick]

  naive      the kernel against a plain one
  unused     effects that a scene does not use
  offsets    ways to leave a surface: what each gets wrong, and costs
  geometry   spheres as constants or in a buffer
  materials  seven balls of each material against diffuse ones
  trees      a loop over all spheres against a tree, for 32 to 1024 of them
  scale      what a tree costs for 1e2 to 1e7 spheres (writes docs/images/scale.svg; takes minutes, and
             some 6 GB)
  roofline   the peak of the ray-sphere test on the device, and what share of it scenes reach
  loading    from a scene file to the first dispatch: each stage for 1e3, 1e4 and 1e5 spheres
  forecasts  what price says of five scenes, and what the renders then take (some minutes)
  resources  time to the first window, peak memory, what the loop over vertices carries
  peers      Mitsuba 3 on the same scenes (installs it into target/peers with pip; needs LLVM 19,
             as of Debian's libllvm19, for its compiled variant; takes a quarter of an hour, with
             --quick a minute, on small images that show no more than that it works)
  hazards    how exact the kernel, a plain one and Mitsuba 3 are on scenes that are hard in f32
             (installs as peers does; writes docs/images/hazards.png; takes ten minutes)
  coverage   how often 95 % intervals hold the truth, over 200 seeds (half an hour)
  trust      how often verdicts on errors are right, over 200 seeds (a quarter of an hour)

Without a name: all but scale, forecasts, peers, hazards, coverage and trust. Run it on an idle machine.
";

/// Runs the benchmarks named in `tables`.
pub(crate) fn all(tables: &[String]) -> Result<(), String> {
    const KNOWN: [&str; 15] = [
        "naive",
        "unused",
        "geometry",
        "materials",
        "trees",
        "roofline",
        "offsets",
        "loading",
        "resources",
        "forecasts",
        "peers",
        "hazards",
        "coverage",
        "trust",
        "scale",
    ];
    if tables.iter().any(|t| t == "--help" || t == "-h") {
        print!("{USAGE}");
        return Ok(());
    }
    let quick = tables.iter().any(|t| t == "--quick");
    let tables: Vec<String> = tables.iter().filter(|t| *t != "--quick").cloned().collect();
    if quick && !tables.iter().any(|t| t == "peers") {
        return Err(format!("--quick is for `peers`\n\n{USAGE}"));
    }
    if let Some(unknown) = tables.iter().find(|t| !KNOWN.contains(&t.as_str())) {
        return Err(format!("no benchmark '{unknown}'\n\n{USAGE}"));
    }
    let chosen = |name: &str| tables.is_empty() || tables.iter().any(|t| t == name);
    run(cargo().args(["build", "--release"]))?;
    let in_process: Vec<&str> = KNOWN[..8]
        .iter()
        .copied()
        .filter(|name| chosen(name))
        .collect();
    if !in_process.is_empty() {
        run(cargo()
            .args(["bench", "--bench", "speed", "--"])
            .args(in_process)
            .env("NODEVICE_SELECT", "1"))?;
    }
    if tables.iter().any(|t| t == "trust") {
        run(cargo()
            .args(["bench", "--bench", "coverage", "--", "trust"])
            .env("NODEVICE_SELECT", "1"))?;
    }
    if chosen("resources") {
        resources()?;
    }
    if tables.iter().any(|t| t == "forecasts") {
        forecasts::table()?;
    }
    if tables.iter().any(|t| t == "peers") {
        peers(quick)?;
    }
    if tables.iter().any(|t| t == "hazards") {
        hazards()?;
    }
    if tables.iter().any(|t| t == "scale") {
        scale()?;
    }
    if tables.iter().any(|t| t == "coverage") {
        run(cargo()
            .args(["bench", "--bench", "coverage"])
            .env("NODEVICE_SELECT", "1"))?;
    }
    Ok(())
}

/// Time from launch to an image of the first window (16 samples), and peak memory of a render.
fn resources() -> Result<(), String> {
    let folder = std::env::temp_dir().join(format!("gpu-trace-bench-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    let image = folder.join("image.exr");
    let render = |spp: &str| {
        let mut command = Command::new(program("release"));
        command
            .args(["lecture", "--quiet", "--spp", spp, "-o"])
            .arg(&image);
        command
    };
    let mut times: Vec<f64> = Vec::new();
    for _ in 0..5 {
        let begin = std::time::Instant::now();
        run(&mut render("16"))?;
        times.push(begin.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    println!("| `lecture`, 640x640 | |\n|---|---|");
    println!(
        "| launch to an image of the first window (16 spp), median of 5 | {:.2} s |",
        times[2]
    );
    match peak_memory(&mut render("256")) {
        Some(kib) => println!(
            "| peak memory of a 256 spp render | {} MB |",
            kib * 1024 / 1_000_000
        ),
        None => println!("| peak memory | not known on this system |"),
    }
    println!();
    std::fs::remove_dir_all(&folder).map_err(|e| e.to_string())?;
    states()
}

/// What the kernel's loop carries from one vertex to the next, for scenes from few effects to many.
fn states() -> Result<(), String> {
    println!("| scene | lines of its kernel | bytes that its loop carries |\n|---|---|---|");
    for scene in [
        "lecture",
        "glass",
        "field",
        "car-paint",
        "frosted-glass",
        "prism",
        "mix",
        "motion",
        "scenes/textures.toml",
        "scenes/sky.toml",
        "scenes/everything.toml",
    ] {
        let output = Command::new(program("release"))
            .args(["effects", scene, "--integrator", "path", "--json"])
            .current_dir(root())
            .output()
            .map_err(|e| e.to_string())?;
        let told: Value = serde_json::from_slice(&output.stdout)
            .map_err(|e| format!("gpu-trace effects {scene}: {e}"))?;
        println!(
            "| `{scene}` | {} | {} |",
            told["kernel_lines"], told["state_bytes"]
        );
    }
    println!();
    Ok(())
}

/// The largest resident size in KiB that Linux reports of a child while it runs.
fn peak_memory(command: &mut Command) -> Option<u64> {
    let mut child = command.spawn().ok()?;
    let status = format!("/proc/{}/status", child.id());
    let mut peak = None;
    while child.try_wait().ok()?.is_none() {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find(|line| line.starts_with("VmHWM:"));
        let kib = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<u64>().ok());
        peak = peak.max(kib);
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    peak
}

/// The table of what a tree costs, and its picture.
fn scale() -> Result<(), String> {
    let csv = std::path::absolute("target/scale.csv").map_err(|e| e.to_string())?;
    run(cargo()
        .args(["bench", "--bench", "speed", "--", "scale"])
        .env("GPU_TRACE_SCALE", &csv)
        .env("NODEVICE_SELECT", "1"))?;
    run(Command::new(python("target/plots", &["matplotlib"])?)
        .arg("benches/trees/plot.py")
        .arg(&csv)
        .arg("docs/images/scale.svg"))
}

/// What stands beside us: see [`python`].
fn mitsuba() -> Result<PathBuf, String> {
    python("target/peers", &["mitsuba==3.9.1", "numpy", "pillow"])
}

/// The Python of an environment with these packages, installed if they are not there.
fn python(environment: &str, packages: &[&str]) -> Result<PathBuf, String> {
    let python = Path::new(environment).join("bin/python");
    if !python.exists() {
        run(Command::new("python3")
            .args(["-m", "venv"])
            .arg(environment))?;
    }
    run(Command::new(&python)
        .args(["-m", "pip", "install", "--quiet"])
        .args(packages))?;
    Ok(python)
}

/// Takes turns with Mitsuba.
fn peers(quick: bool) -> Result<(), String> {
    run(Command::new(mitsuba()?)
        .arg("benches/peers/side_by_side.py")
        .arg(program("release"))
        .args(quick.then_some("--quick"))
        .env("NODEVICE_SELECT", "1"))
}

/// Renders the hazard scenes with everything and compares.
fn hazards() -> Result<(), String> {
    let python = mitsuba()?;
    // Absolute: cargo runs a benchmark in its package's folder.
    let folder = std::path::absolute("target/hazards").map_err(|e| e.to_string())?;
    run(cargo()
        .args(["bench", "--bench", "hazards", "--"])
        .arg(&folder)
        .env("NODEVICE_SELECT", "1"))?;
    run(Command::new(python)
        .arg("benches/hazards/compare.py")
        .arg(&folder)
        .args(["--panel", "docs/images/hazards.png"]))
}
