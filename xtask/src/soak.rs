//! `cargo xtask soak [MINUTES]`: long renders, whose memory must not grow.

use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::{cargo, program, run};

/// The scenes that share the time.
const SCENES: [&str; 2] = ["lecture", "glass"];
const DEFAULT_MINUTES: f64 = 30.0;
/// At most so much may the mean of the last third lie above that of the first.
const GROWTH: f64 = 0.02;
/// The share of the time after which memory should have settled: all that is allocated once is there.
const WARM_UP: f64 = 0.1;

/// Resident memory at a moment of a render.
#[derive(Clone, Copy, Debug)]
struct Sample {
    minute: f64,
    megabytes: f64,
}

/// Renders each scene in one process for its share of the time, and watches its memory.
pub(crate) fn all(arguments: &[String]) -> Result<(), String> {
    let minutes = match arguments {
        [] => DEFAULT_MINUTES,
        [text] => text
            .parse()
            .ok()
            .filter(|minutes: &f64| minutes.is_finite() && *minutes > 0.0)
            .ok_or_else(|| format!("'{text}' is no number of minutes"))?,
        _ => return Err("Usage: cargo xtask soak [MINUTES]".into()),
    };
    if !cfg!(target_os = "linux") {
        return Err("soak reads /proc, which only Linux has".into());
    }
    run(cargo().args(["build", "--release"]))?;
    let seconds = 60.0 * minutes / SCENES.len() as f64;
    // All scenes are measured, even if the first one fails.
    let results: Vec<Result<(), String>> = SCENES
        .iter()
        .map(|scene| soak(scene, seconds).map_err(|text| format!("{scene}: {text}")))
        .collect();
    results.into_iter().collect()
}

/// Renders one scene for so long.
fn soak(scene: &str, seconds: f64) -> Result<(), String> {
    let folder = std::env::temp_dir().join(format!("gpu-trace-soak-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    // More samples than any device takes in that time.
    let mut child = Command::new(program("release"))
        .args([scene, "--sample-range", "0..281474976710656"])
        .args(["--time", &format!("{seconds}s"), "--progress", "json"])
        .args(["-o", "soak.exr"])
        .current_dir(&folder)
        .env("NODEVICE_SELECT", "1")
        .stderr(Stdio::null())
        .spawn()
        .map_err(|e| e.to_string())?;
    println!("| minute | MB of `{scene}` |\n|---|---|");
    let samples = watch(&mut child, seconds);
    let status = child.wait().map_err(|e| e.to_string())?;
    std::fs::remove_dir_all(&folder).map_err(|e| e.to_string())?;
    if !status.success() {
        return Err(format!("the render failed: {status}"));
    }
    let [first, last] = thirds(&samples).ok_or("too little time to tell anything")?;
    let growth = last / first - 1.0;
    println!(
        "\nfirst third {first:.2} MB, last third {last:.2} MB: {:+.2} %\n",
        100.0 * growth
    );
    if growth > GROWTH {
        let most = 100.0 * GROWTH;
        return Err(format!(
            "memory grew by {:.2} %, more than {most} %",
            100.0 * growth
        ));
    }
    Ok(())
}

/// Samples the memory of a process until it ends or its time is up, some hundred times, and prints
/// a row every now and then.
fn watch(child: &mut Child, seconds: f64) -> Vec<Sample> {
    let pause = Duration::from_secs_f64((seconds / 200.0).clamp(0.2, 5.0));
    let row = (seconds / 60.0 / 15.0).max(0.05);
    let begin = Instant::now();
    let mut next = 0.0;
    let mut samples = Vec::new();
    // The end of a render, when the image is written, is not part of it.
    while begin.elapsed().as_secs_f64() < 0.98 * seconds && matches!(child.try_wait(), Ok(None)) {
        sleep(pause);
        if let Some(megabytes) = resident(child.id()) {
            let minute = begin.elapsed().as_secs_f64() / 60.0;
            if minute >= next {
                println!("| {minute:.2} | {megabytes:.2} |");
                next = minute + row;
            }
            samples.push(Sample { minute, megabytes });
        }
    }
    samples
}

/// What Linux counts as resident of a process, in MB.
fn resident(process: u32) -> Option<f64> {
    let text = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = text.lines().find(|line| line.starts_with("VmRSS:"))?;
    let kibibytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kibibytes * 1024.0 / 1.0e6)
}

/// The mean memory in the first and in the last third of the time after the warm-up.
fn thirds(samples: &[Sample]) -> Option<[f64; 2]> {
    let end = samples.last()?.minute;
    let begin = WARM_UP * end;
    let third = (end - begin) / 3.0;
    let mean = |from: f64, to: f64| {
        let within = samples.iter().filter(|s| (from..=to).contains(&s.minute));
        let values: Vec<f64> = within.map(|s| s.megabytes).collect();
        (values.len() >= 5).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    Some([mean(begin, begin + third)?, mean(end - third, end)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn growth(megabytes: impl Fn(f64) -> f64) -> f64 {
        let minutes = (0..300).map(|i| f64::from(i) * 0.1);
        let samples = minutes.map(|minute| Sample {
            minute,
            megabytes: megabytes(minute),
        });
        let [first, last] = thirds(&samples.collect::<Vec<_>>()).expect("enough samples");
        last / first - 1.0
    }

    #[test]
    fn a_leak_is_seen_and_a_warm_up_is_none() {
        assert!(growth(|_| 100.0).abs() < 1e-9);
        assert!(growth(|minute| if minute < 2.0 { 50.0 } else { 100.0 }).abs() < 1e-9);
        assert!(growth(|minute| 100.0 + (7.0 * minute).sin()) < GROWTH);
        assert!(growth(|minute| 100.0 + 0.2 * minute) > GROWTH);
        assert!(thirds(&[]).is_none());
    }

    #[test]
    fn this_process_takes_memory() {
        let before = resident(std::process::id());
        assert_eq!(before.is_some(), cfg!(target_os = "linux"));
        let more = std::hint::black_box(vec![1_u8; 50_000_000]);
        if let (Some(before), Some(after)) = (before, resident(std::process::id())) {
            assert!(after > before + 40.0, "{before} and {after}");
        }
        drop(more);
    }
}
