//! Statistics and progress.

use std::fs;
use std::io::{self, Write};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use gpu_trace::error::{Action, Error};
use gpu_trace::output::{Progress, ProgressMode, Snapshot, Stats, stats};
use tempfile::TempDir;

// ---- Statistics ----

fn statistics() -> Stats {
    Stats {
        version: "1.2.3".into(),
        scene: "room.toml".into(),
        scene_hash: "0123abcd".into(),
        seed: u64::MAX,
        sample_range: [16, 80],
        spp: 64,
        spp_range: [64, 64],
        pilot_spp: 0,
        width: 640,
        height: 480,
        backend: "gpu".into(),
        device: stats::Device {
            name: "Device".into(),
            ..Default::default()
        },
        effects: vec!["emission".into(), "mirror".into()],
        geometry: "baked".into(),
        integrator: "path".into(),
        sampler: "random".into(),
        max_bounces: 64,
        radiance_cache: false,
        lamp_images: false,
        mean_stderr: None,
        roulette: true,
        seconds: stats::Seconds {
            total: 2.5,
            setup: 0.25,
            compile: 0.25,
            render: 2.0,
            ledger: 0.0,
        },
        samples: 640 * 480 * 64,
        paths_per_second: f64::NAN,
        rays: 1 << 40,
        estimated_error: None,
        trust: None,
        degrees_of_freedom: None,
        variance: stats::VarianceClass::HeavyTailed,
        black: false,
        non_finite: 0,
        first_non_finite: None,
        bounce_limit: stats::BounceLimit {
            throughput: f64::INFINITY,
            ..Default::default()
        },
        ledger: None,
        stopped_by: stats::StoppedBy::Interrupt,
        warnings: vec!["a \"quoted\"\nwarning".into()],
    }
}

#[test]
fn statistics_are_valid_json() {
    let directory = TempDir::new().expect("a directory");
    let path = directory.path().join("stats.json");
    statistics().write(&path).expect("it can be written");
    let text = fs::read_to_string(&path).expect("a file");
    assert!(text.ends_with("}\n"));
    let json: serde_json::Value = serde_json::from_str(&text).expect("valid JSON");
    for name in [
        "scene",
        "scene_hash",
        "seed",
        "sample_range",
        "spp",
        "width",
        "height",
        "backend",
        "device",
        "effects",
        "integrator",
        "sampler",
        "seconds",
        "samples",
        "paths_per_second",
        "rays",
        "estimated_error",
        "trust",
        "spp_range",
        "pilot_spp",
        "degrees_of_freedom",
        "variance",
        "non_finite",
        "first_non_finite",
        "stopped_by",
        "version",
        "max_bounces",
        "radiance_cache",
        "lamp_images",
        "mean_stderr",
        "roulette",
        "black",
        "bounce_limit",
        "ledger",
        "geometry",
        "warnings",
    ] {
        assert!(json.get(name).is_some(), "{name} is missing");
    }
    assert_eq!(json["seed"].as_u64(), Some(u64::MAX));
    assert_eq!(json["sample_range"], serde_json::json!([16, 80]));
    assert_eq!(json["stopped_by"], "interrupt");
    assert_eq!(json["variance"], "heavy-tailed");
    assert_eq!(json["seconds"]["total"], 2.5);
    for unknown in [
        &json["estimated_error"],
        &json["paths_per_second"],
        &json["bounce_limit"]["throughput"],
    ] {
        assert!(unknown.is_null());
    }
    let error = statistics().write(&directory.path().join("missing/stats.json"));
    assert!(matches!(
        error,
        Err(Error::File {
            action: Action::Write,
            ..
        })
    ));
}

#[test]
fn images_hold_what_the_statistics_say() {
    let metadata = statistics().metadata().to_string();
    for line in [
        "scene: room.toml",
        "seed: 18446744073709551615",
        "sample_range: 16..80",
        "seconds: 2.5",
    ] {
        assert!(metadata.lines().any(|found| found == line), "{metadata}");
    }
}

// ---- Progress ----

#[derive(Clone, Default)]
struct Lines(Arc<Mutex<Vec<u8>>>);

impl Write for Lines {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().expect("no writer panics").write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// What a short render writes: two updates, a message and a warning between them.
fn progress_lines(mode: ProgressMode, quiet: bool) -> Vec<String> {
    let lines = Lines::default();
    let progress = Progress::to_writer(mode, quiet, lines.clone());
    let snapshot = Snapshot {
        samples: 1_000_000,
        spp: 64,
        spp_total: Some(256),
        fraction: 0.25,
        elapsed: Duration::from_millis(12_000),
        remaining: Some(Duration::from_secs(3661)),
        paths_per_second: 14.23e6,
        error: Some(0.0134),
    };
    progress.update(&snapshot);
    progress.message("hello");
    progress.warning("careful");
    progress.update(&Snapshot {
        fraction: 1.0,
        remaining: None,
        error: None,
        ..snapshot
    });
    drop(progress);
    let bytes = lines.0.lock().expect("no writer panics").clone();
    String::from_utf8(bytes)
        .expect("text")
        .lines()
        .map(str::to_owned)
        .collect()
}

#[test]
fn plain_progress_is_spaced_out() {
    let last = "100 %  64/256 spp  0:12  14.2 Mpaths/s";
    assert_eq!(
        progress_lines(ProgressMode::Plain, false),
        ["hello", "warning: careful", last]
    );
    assert_eq!(
        progress_lines(ProgressMode::Plain, true),
        ["warning: careful", last]
    );
}

#[test]
fn without_a_terminal_there_are_only_messages() {
    for mode in [ProgressMode::Auto, ProgressMode::None] {
        assert_eq!(progress_lines(mode, false), ["hello", "warning: careful"]);
        assert_eq!(progress_lines(mode, true), ["warning: careful"]);
    }
}

#[test]
fn json_progress_is_an_object_a_line() {
    let lines = progress_lines(ProgressMode::Json, false);
    let json: Vec<serde_json::Value> = lines
        .iter()
        .map(|line| serde_json::from_str(line).expect("valid JSON"))
        .collect();
    let kinds: Vec<&str> = json
        .iter()
        .filter_map(|line| line["type"].as_str())
        .collect();
    assert_eq!(kinds, ["progress", "message", "warning", "progress"]);
    assert_eq!(
        json[0],
        serde_json::json!({
            "type": "progress", "samples": 1_000_000, "spp": 64, "spp_total": 256, "fraction": 0.25,
            "elapsed": 12.0, "remaining": 3661.0, "paths_per_second": 14.23e6, "error": 0.0134,
        })
    );
    assert_eq!(json[1]["text"], "hello");
    assert!(json[3]["remaining"].is_null() && json[3]["error"].is_null());
}

#[test]
fn a_snapshot_reads_well() {
    let snapshot = Snapshot {
        spp: 4096,
        spp_total: Some(65536),
        elapsed: Duration::from_millis(59_600),
        remaining: Some(Duration::from_secs(3661)),
        paths_per_second: 1_234_567_890.0,
        error: Some(0.000_123),
        ..Snapshot::default()
    };
    assert_eq!(
        snapshot.to_string(),
        "4096/65536 spp  1:00, 1:01:01 left  1235 Mpaths/s  error 0.012 %"
    );
    let start = Snapshot {
        spp_total: Some(64),
        error: Some(f64::INFINITY),
        ..Snapshot::default()
    };
    assert_eq!(start.to_string(), "0/64 spp  0:00  0 Mpaths/s  error inf %");
    let without_end = Snapshot {
        spp: 7,
        ..Snapshot::default()
    };
    assert_eq!(without_end.to_string(), "7 spp  0:00  0 Mpaths/s");
}
