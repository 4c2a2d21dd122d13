//! `gpu-trace check`: every case of the catalogue passes on this device, and every one can fail.

use crate::cli_support::{Folder, holds};
use crate::common::gpu;
use gpu_trace::check::{CaseReport, Context, Options, Verdict, cases, exits, probe_driver};
use gpu_trace::settings::Offset;
use serde_json::Value;

fn context(offset: Offset, disturb: bool) -> Context {
    Context {
        gpu: gpu(),
        options: Options {
            offset,
            quick: true,
            disturb,
        },
    }
}

fn reports(context: &Context) -> Vec<CaseReport> {
    reports_of(context, &|_| true)
}

/// The same of the cases with the numbers that are wanted.
fn reports_of(context: &Context, wanted: &dyn Fn(u32) -> bool) -> Vec<CaseReport> {
    let run = |case: &gpu_trace::check::Case| {
        let report = case.report(context);
        report.unwrap_or_else(|e| panic!("case {}: {e}", case.id))
    };
    let all = cases();
    all.iter().filter(|case| wanted(case.id)).map(run).collect()
}

/// Numbers of the cases with this verdict.
fn with(reports: &[CaseReport], verdict: Verdict) -> Vec<u32> {
    let those = reports.iter().filter(|r| r.verdict == verdict);
    those.map(|r| r.id).collect()
}

#[test]
fn the_catalogue_is_complete() {
    let ids: Vec<u32> = cases().iter().map(|case| case.id).collect();
    assert_eq!(ids, (1..=43).collect::<Vec<u32>>());
}

#[test]
fn every_case_passes() {
    let reports = reports(&context(Offset::Exact, false));
    let failed: Vec<&CaseReport> = reports
        .iter()
        .filter(|r| r.verdict == Verdict::Fail)
        .collect();
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn companion_every_case_can_fail() {
    let reports = reports(&context(Offset::Exact, true));
    let passed: Vec<&CaseReport> = reports
        .iter()
        .filter(|r| r.verdict == Verdict::Pass)
        .collect();
    assert!(passed.is_empty(), "{passed:#?}");
}

#[test]
fn nudges_fail_where_they_must() {
    // What no nudge of 1e-4 stands: tiny spheres, other scales, huge ones, thin shells.
    const FAIL: [u32; 4] = [4, 8, 10, 13];
    // And what does not depend on it.
    const PASS: [u32; 6] = [1, 3, 6, 22, 23, 33];
    let wanted = |id: u32| FAIL.contains(&id) || PASS.contains(&id);
    for offset in [Offset::Out(1.0e-4), Offset::Back(1.0e-4), Offset::None] {
        let reports = reports_of(&context(offset, false), &wanted);
        eprintln!("--offset {offset}: {reports:?}");
        assert_eq!(with(&reports, Verdict::Fail), FAIL, "--offset {offset}");
        assert_eq!(with(&reports, Verdict::Pass), PASS, "--offset {offset}");
    }
}

#[test]
fn exits_are_what_the_table_says() {
    let rates = |offset, radius, poles| {
        let found = exits(&context(offset, false), radius, poles, 1 << 14);
        let found = found.unwrap_or_else(|e| panic!("{e}"));
        assert!(found.outside > 4000 && found.inside > 2000, "{found:?}");
        [found.blocked_per_million(), found.leaked_per_million()]
    };
    for radius in [1.0e-5, 1.0e-2, 1.0, 1.0e3, 1.0e8] {
        assert_eq!(rates(Offset::Exact, radius, true), [0.0; 2], "{radius:e}");
    }
    assert!(rates(Offset::None, 1.0, true)[0] > 1.0e5);
    // A nudge of ten radii leaves a ball by its other side.
    assert_eq!(rates(Offset::Back(1.0e-4), 1.0e-5, true)[1], 1.0e6);
    // The lecture's own: a wall about its centre.
    assert!(rates(Offset::Back(1.0e-4), 1.0e5, false)[0] > 1.0e5);
}

#[test]
fn the_driver_keeps_what_the_kernel_needs() {
    let report = probe_driver(&context(Offset::Exact, false)).unwrap_or_else(|e| panic!("{e}"));
    eprintln!("{report:?}");
    assert!(report.sums_hold);
    // WGSL's own bounds.
    assert!(report.division_ulp <= 2.5 && report.inverse_sqrt_ulp <= 2.0);
    assert!(report.division_ulp > 0.0 && report.sin_error > 0.0);
    assert!(report.sin_error < 4.9e-4 && report.cos_error < 4.9e-4);
}

#[test]
fn the_command_reports_and_exits() {
    let folder = Folder::new();
    let text = folder.ok("check --quick --case 4 --case shells");
    holds(
        &text,
        &[
            "tiny sphere",
            "thin glass",
            "2 passed, 0 failed",
            "arithmetic",
        ],
    );
    let last = text.lines().last().unwrap_or_default();
    holds(last, &[&gpu().summary.name, &gpu().summary.driver]);

    let run = folder.run("check --quick --case 4 --offset out:1e-4");
    assert_eq!(run.code, Some(3), "{run:?}");
    holds(&run.stdout, &["FAIL", "worst:", "--offset out:0.0001"]);
    holds(&run.stderr, &["error: 1 of 1 cases failed: 4"]);

    let run = folder.run("check --quick --disturb --case 6");
    assert_eq!(run.code, Some(3), "{run:?}");
    let run = folder.run("check --case acne");
    assert_eq!(run.code, Some(2), "{run:?}");
    holds(&run.stderr, &["--case acne", "grazing rays"]);
    for (bad, said) in [
        ("--offset sideways", "back:X"),
        ("--offset out:", "distance"),
        ("--offset out:-1", "distance"),
        ("--offset back:nan", "distance"),
        ("--offset ulp:1", "exact, none"),
        ("--device nothing", "no device is called 'nothing'"),
    ] {
        let run = folder.run(&format!("check --quick --case 6 {bad}"));
        assert_eq!(run.code, Some(2), "{bad}: {run:?}");
        holds(&run.stderr, &[said]);
    }
}

#[test]
fn the_json_says_the_same() {
    let folder = Folder::new();
    let run = folder.run("check --quick --json --case 4 --case 25 --case 8 --offset back:1e-4");
    assert_eq!(run.code, Some(3), "{run:?}");
    let all: Value = serde_json::from_str(&run.stdout).expect("JSON");
    assert_eq!(all["device"]["name"], gpu().summary.name);
    assert!(all["device"]["arithmetic"]["division_ulp"].is_number());
    assert_eq!(all["offset"], "back:0.0001");
    let cases = all["cases"].as_array().expect("an array");
    let verdicts: Vec<&str> = cases
        .iter()
        .map(|c| c["verdict"].as_str().expect("a string"))
        .collect();
    assert_eq!(verdicts, ["fail", "fail", "pass"]);
    for case in cases {
        for key in ["id", "name", "failure_rate", "worst", "limit", "why"] {
            assert!(case.get(key).is_some(), "{key}: {case}");
        }
    }
    assert!(
        cases[0]["failure_rate"]
            .as_f64()
            .is_some_and(|rate| rate > 0.01)
    );
    assert!(!cases[2]["why"].as_str().unwrap_or_default().is_empty());
}
