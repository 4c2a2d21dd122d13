//! The same on a real Slurm, of one node with two processors and two devices that it takes for GPUs: `cargo xtask
//! slurm` starts it and these tests.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::{PROGRAM, film_samples, picture, run, words};
use crate::cli_support::{Folder, GOOD, Run, holds};
use crate::film_files::{alike, assert_near};

/// A job that is put in the queue again waits there for a while.
const PATIENCE: Duration = Duration::from_secs(400);

fn wait(what: &str, mut is_there: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !is_there() {
        assert!(begin.elapsed() < PATIENCE, "{what}: that does not come");
        sleep(Duration::from_millis(20));
    }
}

/// What a command of Slurm's prints.
fn slurm(command: &str) -> String {
    let [name, arguments @ ..] = &words(command)[..] else {
        panic!("no command");
    };
    let output = Command::new(name).args(arguments).output();
    let output = output.unwrap_or_else(|e| panic!("{command}: {e}"));
    String::from_utf8(output.stdout).expect("text")
}

/// The numbers of the array and of the merge.
fn jobs(scripts: &Path) -> [String; 2] {
    let text = fs::read_to_string(scripts.join("jobs")).expect("the numbers of the jobs");
    let (parts, merge) = text.trim().split_once(',').expect("two numbers");
    [parts, merge].map(String::from)
}

/// The states of the jobs that are in the queue.
fn states(jobs: &[String]) -> String {
    slurm(&format!(
        "squeue --noheader --format=%i:%T:%r --jobs={}",
        jobs.join(",")
    ))
}

fn wait_for_the_end(scripts: &Path) {
    let jobs = jobs(scripts);
    wait("the end of the jobs", || states(&jobs).is_empty());
}

/// All logs, to be shown where something fails.
fn logs(scripts: &Path) -> String {
    let entries = fs::read_dir(scripts)
        .expect("the folder")
        .filter_map(Result::ok);
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "log"));
    paths.sort();
    let text = |path: &PathBuf| fs::read_to_string(path).unwrap_or_default();
    paths
        .iter()
        .map(|path| format!("{}:\n{}\n", path.display(), text(path)))
        .collect()
}

fn log(scripts: &Path, part: usize) -> String {
    fs::read_to_string(scripts.join(format!("part-{part}.log"))).unwrap_or_default()
}

fn submit_again(scripts: &Path) -> Run {
    let mut command = Command::new("sh");
    command.arg(scripts.join("submit.sh"));
    run(command)
}

/// The process that renders a part.
fn process(scripts: &Path, part: usize) -> Option<String> {
    let scripts = scripts.canonicalize().ok()?;
    let words = format!("part-{part}.film");
    let is_it = |path: &PathBuf| {
        let command = fs::read(path.join("cmdline")).unwrap_or_default();
        fs::read_link(path.join("exe")).is_ok_and(|exe| exe == Path::new(PROGRAM))
            && fs::read_link(path.join("cwd")).is_ok_and(|cwd| cwd == scripts)
            && String::from_utf8_lossy(&command).contains(&words)
    };
    let processes = fs::read_dir("/proc").ok()?.filter_map(Result::ok);
    let path = processes.map(|entry| entry.path()).find(is_it)?;
    Some(path.file_name()?.to_string_lossy().into_owned())
}

/// A render on one thread that takes some seconds.
const SLOW: &str = "good.toml --backend cpu --threads 1 --size 32x24 --spp 40000";

/// Submits a slow render of two parts, and waits until both are under way.
fn slow(folder: &Folder) -> PathBuf {
    folder.ok(&format!(
        "submit slurm {SLOW} --tasks 2 --checkpoint-every 1ms -o s.npy"
    ));
    let scripts = folder.path("s.slurm");
    for part in [0, 1] {
        let film = scripts.join(format!("part-{part}.film"));
        wait("a film file", || film.exists());
    }
    scripts
}

#[test]
#[ignore = "needs Slurm: cargo xtask slurm"]
fn an_array_and_its_merge_are_one_render() {
    for name in ["plain", "it's \"$HOME\" #\n-x"] {
        let folder = Folder::with_scene();
        let here = folder.path(name);
        fs::create_dir(&here).expect("a folder");
        fs::write(here.join("good.toml"), GOOD).expect("a scene");
        let start = |arguments: &str| {
            let mut command = folder.command(arguments);
            command.current_dir(&here);
            let run = run(command);
            assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{run:?}");
            run.stdout
        };
        let options = "good.toml --size 32x24 --spp 2000";
        let said = start(&format!(
            "submit slurm {options} --tasks 4 -o a.npy -- --time=5 --mem=100"
        ));
        holds(&said, &["parts: job ", "; merge: job "]);
        let scripts = here.join("a.slurm");
        wait_for_the_end(&scripts);
        let logs = logs(&scripts);
        assert!(here.join("a.npy").exists(), "{logs}");
        holds(&log(&scripts, 3), &["part-3.exr: 32x24"]);
        start(&format!("{options} --backend gpu -o one.npy"));
        let one = picture(&here.join("one.npy"));
        // With the logs beside what is said of a failure, here and below.
        eprintln!("{logs}");
        assert_near("an array", &picture(&here.join("a.npy")), &one);
        // Companion: of other samples.
        start(&format!("{options} --backend gpu --seed 1 -o other.npy"));
        assert!(!alike(&picture(&here.join("other.npy")), &one));
    }
}

#[test]
#[ignore = "needs Slurm: cargo xtask slurm"]
fn parts_that_are_killed_warned_or_preempted_go_on() {
    let folder = Folder::with_scene();
    let scripts = slow(&folder);
    let [array, _] = jobs(&scripts);
    let films = [0, 1].map(|part| scripts.join(format!("part-{part}.film")));
    // One dies; the other is warned that its time is up.
    let child = process(&scripts, 0).expect("it renders");
    let killed = Command::new("kill").args(["-s", "KILL", &child]).status();
    assert!(killed.is_ok_and(|status| status.success()));
    slurm(&format!("scancel --batch --signal=USR1 {array}_1"));
    wait("both are requeued", || {
        (0..2).all(|part| log(&scripts, part).contains("requeued"))
    });
    holds(&log(&scripts, 0), &["ended with 137: requeued"]);
    holds(&log(&scripts, 1), &["ended with 129: requeued"]);
    let before = films.each_ref().map(|film| film_samples(film));
    assert!(before.iter().all(|spp| *spp < 20_000), "{before:?}");
    // Once they run again, Slurm takes one's node away.
    wait("both run again", || {
        (0..2).all(|part| process(&scripts, part).is_some())
    });
    let requeued = format!("scontrol requeue {array}_0");
    slurm(&requeued);
    wait_for_the_end(&scripts);
    let logs = logs(&scripts);
    assert!(folder.path("s.npy").exists(), "{logs}");
    let (whole, _) = folder.render(SLOW);
    eprintln!("{logs}");
    assert_near("killed, warned, preempted", &folder.npy("s.npy"), &whole);
    // It went on: what is done is said to be, and by our script it was requeued once.
    assert_eq!(log(&scripts, 0).matches("requeued\n").count(), 1, "{logs}");
}

#[test]
#[ignore = "needs Slurm: cargo xtask slurm"]
fn what_is_cancelled_stays_so() {
    let folder = Folder::with_scene();
    let scripts = slow(&folder);
    let [array, merge] = jobs(&scripts);
    let busy = submit_again(&scripts);
    assert_eq!(busy.code, Some(1), "{busy:?}");
    holds(&busy.stderr, &["still in the queue"]);
    slurm(&format!("scancel {array}"));
    wait("the end of the jobs", || {
        states(&[array.clone(), merge.clone()]).is_empty()
    });
    // Longer than a job waits that is requeued.
    sleep(Duration::from_secs(15));
    assert_eq!(states(&[array, merge]), "");
    let logs = logs(&scripts);
    assert!(!logs.contains("requeued"), "{logs}");
    assert!(!folder.path("s.npy").exists());
    // What was done until then is kept, and it goes on from there.
    let kept = film_samples(&scripts.join("part-0.film"));
    assert!((16..20_000).contains(&kept), "{kept}");
    let again = submit_again(&scripts);
    assert_eq!(again.code, Some(0), "{again:?}");
    wait_for_the_end(&scripts);
    let (whole, _) = folder.render(SLOW);
    assert_near("cancelled", &folder.npy("s.npy"), &whole);
}

#[test]
#[ignore = "needs Slurm: cargo xtask slurm"]
fn a_part_that_cannot_be_rendered_ends_the_merge() {
    let folder = Folder::with_scene();
    let options = "good.toml --backend cpu --spp 600";
    folder.ok(&format!(
        "submit slurm {options} --tasks 2 -o f.npy -- --hold"
    ));
    let scripts = folder.path("f.slurm");
    let mut first = Command::new("sh");
    first
        .arg(scripts.join("task.sh"))
        .env("SLURM_ARRAY_TASK_ID", "0");
    assert_eq!(run(first).code, Some(0));
    let film = fs::read(scripts.join("part-0.film")).expect("the first part");
    // The first goes on without the scene file, the second cannot begin.
    fs::rename(folder.path("good.toml"), folder.path("away.toml")).expect("it was there");
    let [array, merge] = jobs(&scripts);
    slurm(&format!("scontrol release {array} {merge}"));
    wait_for_the_end(&scripts);
    holds(&log(&scripts, 0), &["is complete"]);
    holds(&log(&scripts, 1), &["good.toml"]);
    assert!(!folder.path("f.npy").exists());
    // Once it can, the same script does the rest.
    fs::rename(folder.path("away.toml"), folder.path("good.toml")).expect("it is there");
    let script = fs::read_to_string(scripts.join("submit.sh")).expect("a script");
    fs::write(scripts.join("submit.sh"), script.replace(" --hold", "")).expect("a file");
    let again = submit_again(&scripts);
    assert_eq!((again.code, again.stderr.as_str()), (Some(0), ""));
    wait_for_the_end(&scripts);
    let (whole, _) = folder.render(options);
    eprintln!("{}", logs(&scripts));
    assert_near("a part begun again", &folder.npy("f.npy"), &whole);
    assert!(fs::read(scripts.join("part-0.film")).expect("a file") == film);
}

#[test]
#[ignore = "needs Slurm: cargo xtask slurm"]
fn what_slurm_refuses_is_shown() {
    let folder = Folder::with_scene();
    let run = folder.run("submit slurm good.toml --tasks 2 -o r.npy -- --partition=nowhere");
    assert_eq!(run.code, Some(1), "{run:?}");
    holds(
        &run.stderr,
        &[
            "error: nothing was submitted",
            "sbatch: error:",
            "invalid partition",
        ],
    );
    assert!(!folder.path("r.slurm").exists());
}
