//! What `price` says, and what the render then takes.

use std::process::Command;

use serde_json::Value;

use crate::{program, run};

/// Scene, size and error.
const RENDERS: [[&str; 3]; 6] = [
    ["lecture", "640x640", "3%"],
    ["lecture", "640x640", "2%"],
    ["glass", "640x512", "3%"],
    ["lecture-reflective", "480x480", "3%"],
    ["field", "320x180", "4%"],
    ["scenes/tests/three-lamps.toml", "640x480", "0.8%"],
];

/// Prices renders, does them, and prints both.
pub(crate) fn table() -> Result<(), String> {
    let folder = std::env::temp_dir().join(format!("gpu-trace-forecasts-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    println!(
        "| render | forecast: spp | time, s | 95 % interval | taken: spp | time, s | taken/forecast |\n\
         |---|---|---|---|---|---|---|"
    );
    for [scene, size, error] in RENDERS {
        let priced = Command::new(program("release"))
            .args(["price", scene, "--size", size, "--error", error, "--json"])
            .output()
            .map_err(|e| e.to_string())?;
        let priced = json(&priced.stdout)?;
        let forecast = &priced["targets"][0];
        let stats = folder.join("stats.json");
        run(Command::new(program("release"))
            .args(["render", scene, "--size", size, "--error", error, "--quiet"])
            .arg("-o")
            .arg(folder.join("image.npy"))
            .arg("--stats")
            .arg(&stats))?;
        let taken = json(&std::fs::read(&stats).map_err(|e| e.to_string())?)?;
        let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
        let (expected, seconds) = (
            number(&forecast["seconds"]),
            number(&taken["seconds"]["render"]),
        );
        println!(
            "| `{scene}`, {size}, {error} | {} | {expected:.1} | {:.1} to {:.1} | {} | {seconds:.1} | {:.2} |",
            forecast["spp"],
            number(&forecast["seconds_low"]),
            number(&forecast["seconds_high"]),
            taken["spp"],
            seconds / expected,
        );
    }
    std::fs::remove_dir_all(&folder).map_err(|e| e.to_string())
}

fn json(bytes: &[u8]) -> Result<Value, String> {
    serde_json::from_slice(bytes).map_err(|e| e.to_string())
}
