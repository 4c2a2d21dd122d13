//! `submit slurm`: the scripts that it writes, run by hand with stand-ins for Slurm's commands. `cluster` has what
//! a real Slurm makes of them.
#![cfg(unix)]

mod cluster;

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::cli_support::{Background, Folder, Run, holds};
use crate::film_files::{alike, assert_near, error_of, near};
use gpu_trace::image::Picture;
use gpu_trace::input::read;
use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_gpu-trace");
/// No script takes this long.
const PATIENCE: Duration = Duration::from_secs(120);

/// The scripts of `submit slurm good.toml` and the options in `the_scripts_are_these`.
const SCRIPTS: &str = include_str!("scripts.txt");

/// A folder with `good.toml` and, in `bin/`, stand-ins for Slurm's commands.
fn folder() -> Folder {
    let folder = Folder::with_scene();
    fs::create_dir(folder.path("bin")).expect("a folder");
    stand_in(&folder, "sbatch", "echo 41");
    stand_in(&folder, "squeue", "");
    stand_in(&folder, "scancel", "");
    stand_in(&folder, "scontrol", "");
    folder
}

/// A command that keeps its words, and answers by the lines of `answer`.
fn stand_in(folder: &Folder, name: &str, answer: &str) {
    let log = folder.path("words");
    let script = format!(
        "#!/bin/sh\n{{ printf {name}; printf '|%s' \"$@\"; echo; }} >>'{}'\n{answer}\n",
        log.display()
    );
    program(&folder.path("bin").join(name), &script);
}

/// A script that can be started by its name.
fn program(path: &Path, script: &str) {
    fs::write(path, script).expect("it can be written");
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("it is ours");
}

/// What the stand-ins were asked since the last time.
fn asked(folder: &Folder) -> String {
    let text = fs::read_to_string(folder.path("words")).unwrap_or_default();
    let _ = fs::remove_file(folder.path("words"));
    text
}

/// Makes a command see the stand-ins, and no job that these tests may run in.
fn among(folder: &Folder, mut command: Command) -> Command {
    let path = std::env::var("PATH").expect("a path");
    command.env("PATH", format!("{}:{path}", folder.path("bin").display()));
    for name in [
        "SLURM_ARRAY_JOB_ID",
        "SLURM_CPUS_PER_TASK",
        "SLURM_RESTART_COUNT",
    ] {
        command.env_remove(name);
    }
    command
}

fn submit(folder: &Folder, arguments: &[&str]) -> Run {
    let words: Vec<&str> = ["submit", "slurm"]
        .iter()
        .chain(arguments)
        .copied()
        .collect();
    run(among(folder, folder.command_of(&words)))
}

fn run(mut command: Command) -> Run {
    Run::new(command.output().expect("it starts"))
}

/// The part `part` by hand, from a place that is not the scripts'.
fn task(folder: &Folder, scripts: &Path, part: usize) -> Command {
    let mut command = Command::new("sh");
    command
        .arg(scripts.join("task.sh"))
        .env("SLURM_ARRAY_TASK_ID", part.to_string())
        .current_dir("/")
        .stdin(Stdio::null());
    among(folder, command)
}

fn merge(folder: &Folder, scripts: &Path) -> Command {
    let mut command = Command::new("sh");
    command.arg(scripts.join("merge.sh")).current_dir("/");
    among(folder, command)
}

/// Runs parts one after the other, each to its end.
fn tasks(folder: &Folder, scripts: &Path, parts: std::ops::Range<usize>) {
    for part in parts {
        let run = run(task(folder, scripts, part));
        assert_eq!(run.code, Some(0), "part {part}: {run:?}");
    }
}

fn picture(path: &Path) -> Picture {
    read(path).unwrap_or_else(|e| panic!("{e}")).picture
}

fn words(text: &str) -> Vec<&str> {
    text.split_whitespace().collect()
}

/// The folder as its path is without links, as the program sees it.
fn real(folder: &Folder) -> PathBuf {
    folder.path("").canonicalize().expect("it is there")
}

#[test]
fn the_scripts_are_these() {
    let folder = folder();
    let options = "good.toml --tasks 3 --spp 1000 --seed 7 --size 12x9 --aov normal --exposure=-1 -o out.exr \
        --stats s.json --progress plain --allow-non-finite --cpus-per-task 4 --at-once 2 --dry-run \
        -- --partition=gpu --comment=x";
    let mut options = words(options);
    let last = options.len() - 1;
    options[last] = "--comment=it's";
    let before = folder.names();
    let show = |options: &[&str]| {
        let run = submit(&folder, options);
        assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{run:?}");
        let here = real(&folder);
        let shown = run.stdout.replace(PROGRAM, "/opt/gpu-trace");
        shown.replace(here.to_str().expect("text"), "/home/me")
    };
    let shown = show(&options);
    assert!(shown == SCRIPTS, "{shown}");
    assert_eq!(folder.names(), before, "nothing is written");
    assert_eq!(asked(&folder), "", "nothing is submitted");
    // Companion: another seed, another script.
    let at = options
        .iter()
        .position(|word| *word == "7")
        .expect("the seed");
    options[at] = "8";
    assert!(show(&options) != SCRIPTS);
}

#[test]
fn parts_by_hand_are_one_render_whatever_the_names() {
    // Of folder, scene and image.
    let names = [
        ["plain", "scene", "image"],
        ["-a b", "-x 'y' \"z\"", "--help"],
        ["$HOME `id` $(id)", "?j @a #$1", "it's; rm x & *"],
        ["new\nline", "\\ %j\n#SBATCH --array=0-99\n", "~\t\"\n'"],
    ];
    for [inner, scene, image] in names {
        let folder = folder();
        let here = folder.path(inner);
        fs::create_dir(&here).expect("a folder");
        let scene = format!("./{scene}.toml");
        fs::write(here.join(&scene), crate::cli_support::GOOD).expect("a scene");
        let start = |arguments: &[&str]| {
            let mut command = among(&folder, folder.command_of(arguments));
            command.current_dir(&here);
            let run = run(command);
            assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{run:?}");
            run.stdout
        };
        let output = format!("--output=./{image}.npy");
        let options = [scene.as_str(), "--backend=cpu", "--spp=600", "--seed=3"];
        let submitted = [
            "submit",
            "slurm",
            "--tasks=3",
            &output,
            "--stats=./s '.json",
        ];
        let said = start(&[&submitted[..], &options].concat());
        holds(
            &said,
            &["600 samples a pixel in 3 parts of 88 to 256", "job 41"],
        );
        asked(&folder);
        let scripts = here.join(format!("{image}.slurm"));
        tasks(&folder, &scripts, 0..3);
        let merged = run(merge(&folder, &scripts));
        assert_eq!(
            (merged.code, merged.stderr.as_str()),
            (Some(0), ""),
            "{merged:?}"
        );
        assert_eq!(asked(&folder), "", "by hand nothing is requeued");

        start(&[&options[..], &["-o", "one.npy", "--stats", "one.json"]].concat());
        let (ours, one) = (
            picture(&here.join(format!("{image}.npy"))),
            picture(&here.join("one.npy")),
        );
        assert_near(&format!("slurm, {inner}"), &ours, &one);
        let stats = |name: &str| -> Value {
            serde_json::from_slice(&fs::read(here.join(name)).expect("statistics")).expect("JSON")
        };
        let (ours_stats, stats) = (stats("s '.json"), stats("one.json"));
        assert!(near(error_of(&ours_stats), error_of(&stats)));
        assert_eq!(ours_stats["sample_range"], stats["sample_range"]);
        // Companions: another seed, and all but the last part, which cannot pass as a whole.
        start(&[
            scene.as_str(),
            "--backend=cpu",
            "--spp=600",
            "-o",
            "other.npy",
        ]);
        assert!(!alike(&ours, &picture(&here.join("other.npy"))));
        fs::remove_file(scripts.join("part-2.film")).expect("it was there");
        let run = run(merge(&folder, &scripts));
        assert_eq!(run.code, Some(2), "{run:?}");
        holds(&run.stderr, &["part-2.film"]);
    }
}

#[test]
fn a_part_that_is_killed_or_stopped_goes_on() {
    let folder = folder();
    // On one thread, so that it takes longer than the pauses anywhere.
    let options = "good.toml --backend cpu --threads 1 --size 32x24 --spp 6000";
    let more = "--tasks 2 -o s.npy --checkpoint-every 1ms --progress json";
    let run_of = submit(&folder, &words(&format!("{options} {more}")));
    assert_eq!(run_of.code, Some(0), "{run_of:?}");
    let scripts = folder.path("s.slurm");
    let film = scripts.join("part-1.film");
    for signal in ["KILL", "TERM", "USR1", "INT"] {
        let mut command = task(&folder, &scripts, 1);
        // Of its own, so that a signal can go to all of it.
        command.process_group(0);
        let mut part = Background::of(command);
        part.wait_for("\"progress\"");
        let begin = Instant::now();
        while !film.exists() {
            assert!(begin.elapsed() < PATIENCE, "it was never kept");
            sleep(Duration::from_millis(1));
        }
        sleep(Duration::from_millis(30));
        let before = film_samples(&film);
        if signal == "KILL" {
            part.signal_group(signal);
            drop(part);
        } else {
            // The script alone, as Slurm's warning goes.
            part.signal(signal);
            let run = part.finish();
            assert_eq!(run.code, Some(129), "{signal}: {run:?}");
            holds(&run.stderr, &["goes on"]);
            assert!(film_samples(&film) > before, "{signal}");
        }
        assert!(film_samples(&film) < 3056, "{signal}: it was done before");
    }
    // Companion: the part is not whole, and the merge tells.
    tasks(&folder, &scripts, 0..1);
    let short = run(merge(&folder, &scripts));
    assert_eq!(short.code, Some(2), "{short:?}");
    holds(&short.stderr, &["part-1.film is not finished"]);
    tasks(&folder, &scripts, 1..2);
    let done = run(merge(&folder, &scripts));
    assert_eq!(done.code, Some(0), "{done:?}");
    let (whole, _) = folder.render(options);
    assert_near("slurm, after signals", &folder.npy("s.npy"), &whole);

    // What is done is not done again.
    let bytes = fs::read(&film).expect("the film file");
    let again = run(task(&folder, &scripts, 1));
    holds(&again.stderr, &["part-1.film is complete"]);
    assert!(fs::read(&film).expect("the film file") == bytes);
    let none = run(task(&folder, &scripts, 2));
    assert_eq!(none.code, Some(2), "{none:?}");
    holds(&none.stderr, &["there is no part 2"]);
}

/// The samples a pixel in a film file.
fn film_samples(path: &Path) -> u64 {
    let film = gpu_trace::film_file::read(path).unwrap_or_else(|e| panic!("{e}"));
    film.film.samples()
}

#[test]
fn what_fails_is_requeued_unless_that_is_no_use() {
    let folder = folder();
    submit(
        &folder,
        &words("good.toml --tasks 1 --backend cpu -o s.npy"),
    );
    let scripts = folder.path("s.slurm");
    let text = fs::read_to_string(scripts.join("task.sh")).expect("the script");
    let fake = folder.path("bin/fake");
    let text = text.replace(PROGRAM, fake.to_str().expect("text"));
    assert!(text.contains("bin/fake"));
    fs::write(scripts.join("task.sh"), text).expect("it can be written");
    // Exit code, whether the film file is new, the state of the job, restarts so far; whether it is requeued.
    for (code, adds, state, restarts, requeued) in [
        (1, false, "RUNNING", "0", true),
        (1, false, "RUNNING", "2", true),
        (1, false, "RUNNING", "3", false),
        (1, true, "RUNNING", "3", true),
        (137, true, "RUNNING", "99", true),
        (129, true, "RUNNING", "100", false),
        (129, true, "SIGNALING", "0", true),
        (129, true, "COMPLETING", "0", false),
        (129, true, "PENDING", "0", false),
        (2, true, "RUNNING", "0", false),
        (0, true, "RUNNING", "0", false),
    ] {
        let what = format!("{code} {adds} {state} {restarts}");
        stand_in(&folder, "squeue", &format!("echo {state}"));
        let new = "echo x >new && mv new part-0.film\n";
        program(
            &fake,
            &format!("#!/bin/sh\n{}exit {code}\n", if adds { new } else { "" }),
        );
        // One that was there stays there, so that its number is another's.
        fs::write(scripts.join("part-0.film"), "old").expect("it can be written");
        let mut command = task(&folder, &scripts, 0);
        command.envs([
            ("SLURM_ARRAY_JOB_ID", "77"),
            ("SLURM_RESTART_COUNT", restarts),
        ]);
        let run = run(command);
        assert_eq!(run.code, Some(code), "{what}: {run:?}");
        let asked = asked(&folder);
        assert_eq!(
            asked.contains("scontrol|requeue|77_0\n"),
            requeued,
            "{what}: {asked}"
        );
        assert_eq!(run.stderr.contains("requeued"), requeued, "{what}: {run:?}");
    }
}

#[test]
fn both_jobs_are_submitted_and_refusals_are_shown() {
    let folder = folder();
    stand_in(
        &folder,
        "sbatch",
        "case $* in *merge.sh) echo '42;local' ;; *) echo '41;local' ;; esac",
    );
    let arguments = [
        "good.toml",
        "--tasks=2",
        "-o",
        "a.npy",
        "--",
        "--partition=a b",
        "--time=1",
        "-Cx'$y",
    ];
    let run_of = submit(&folder, &arguments);
    assert_eq!(
        (run_of.code, run_of.stderr.as_str()),
        (Some(0), ""),
        "{run_of:?}"
    );
    let here = real(&folder);
    let named = format!("scripts, logs and parts: {}/a.slurm\n", here.display());
    holds(&run_of.stdout, &["parts: job 41; merge: job 42\n", &named]);
    let both = "sbatch|--parsable|--partition=a b|--time=1|-Cx'$y|task.sh\n\
        sbatch|--parsable|--dependency=afterok:41|--kill-on-invalid-dep=yes|--partition=a b|--time=1|-Cx'$y|merge.sh\n";
    assert_eq!(asked(&folder), both);
    let task = String::from_utf8(folder.read("a.slurm/task.sh")).expect("text");
    holds(
        &task,
        &[
            "#SBATCH --gpus-per-task=1\n",
            "#SBATCH --array=0-1\n",
            "--backend=gpu",
        ],
    );

    // Again: not over it, and not while it is in the queue.
    let said = folder.refused(&["submit", "slurm", "good.toml", "--tasks=2", "-o", "a.npy"]);
    holds(
        &said,
        &["a.slurm is there already", "submit.sh submits again"],
    );
    let again = || {
        let mut command = Command::new("sh");
        command.arg(folder.path("a.slurm/submit.sh"));
        run(among(&folder, command))
    };
    stand_in(&folder, "squeue", "echo 42");
    let busy = again();
    assert_eq!(busy.code, Some(1), "{busy:?}");
    holds(&busy.stderr, &["the jobs 41,42 are still in the queue"]);
    assert_eq!(asked(&folder), "squeue|--noheader|--jobs=41,42\n");
    stand_in(&folder, "squeue", "echo 'Invalid job id' >&2; exit 1");
    assert_eq!(again().code, Some(0));
    assert_eq!(
        asked(&folder),
        format!("squeue|--noheader|--jobs=41,42\n{both}")
    );

    // What sbatch refuses leaves no trace.
    let refusal = "echo 'sbatch: error: invalid partition specified: nowhere' >&2; exit 1";
    for (answer, cancelled) in [
        (refusal.to_owned(), ""),
        (
            format!("case $* in *merge.sh) {refusal} ;; esac; echo 43"),
            "scancel|43\n",
        ),
    ] {
        stand_in(&folder, "sbatch", &answer);
        let run = submit(&folder, &["good.toml", "--tasks=2", "-o", "b.npy"]);
        assert_eq!((run.code, run.stdout.as_str()), (Some(1), ""), "{run:?}");
        holds(
            &run.stderr,
            &[
                "error: nothing was submitted",
                "invalid partition specified: nowhere",
            ],
        );
        let asked: String = asked(&folder)
            .lines()
            .filter(|l| l.starts_with("scancel"))
            .map(|l| format!("{l}\n"))
            .collect();
        assert_eq!(asked, cancelled);
        assert!(!folder.path("b.slurm").exists());
    }
    // And where there is none.
    let arguments = words("submit slurm good.toml --tasks 2 -o b.npy");
    let mut command = folder.command_of(&arguments);
    command.env("PATH", "/nowhere");
    let none = run(command);
    assert_eq!((none.code, none.stdout.as_str()), (Some(1), ""), "{none:?}");
    holds(
        &none.stderr,
        &["no sbatch is in any folder of PATH", "--dry-run"],
    );
    assert!(!folder.path("b.slurm").exists());
}

/// The number before `after` in `text`.
fn number(text: &str, after: &str) -> u64 {
    let (before, _) = text
        .split_once(after)
        .unwrap_or_else(|| panic!("no {after:?} in {text}"));
    let word = before.split_whitespace().next_back().expect("a word");
    word.parse().unwrap_or_else(|e| panic!("{word}: {e}"))
}

#[test]
fn an_error_is_priced_before_and_judged_after() {
    let folder = folder();
    let submit_ok = |options: &str| {
        let run = submit(
            &folder,
            &words(&format!("good.toml --backend cpu --pilot 1ms {options}")),
        );
        assert_eq!(run.code, Some(0), "{run:?}");
        run
    };
    let run_of = submit_ok("--size 32x24 --tasks 2 --error 5% -o a.npy --stats a.json");
    let (likely, sure) = (
        number(&run_of.stdout, " samples a pixel, and"),
        number(&run_of.stdout, " in 97.5 %"),
    );
    assert!(likely <= sure && likely >= 64, "{run_of:?}");
    holds(
        &run_of.stdout,
        &[
            "an error of 5.00 %",
            "these are taken (pilot of",
            &format!("good: {sure} samples"),
        ],
    );
    let script = String::from_utf8(folder.read("a.slurm/task.sh")).expect("text");
    holds(&script, &["# an error of 5.00 %", &format!("..{sure} ;;")]);
    let parts = script.matches(") samples=").count();
    tasks(&folder, &folder.path("a.slurm"), 0..parts);
    let merged = run(merge(&folder, &folder.path("a.slurm")));
    assert_eq!(
        (merged.code, merged.stderr.as_str()),
        (Some(0), ""),
        "{merged:?}"
    );
    let stats = folder.json("a.json");
    assert_eq!(stats["spp"], sure);
    assert!(error_of(&stats) <= 0.05);

    // Companion: too few samples are told of before and after, and the image is there.
    let run_of = submit_ok("--tasks 2 --error 0.1% --spp 128 -o b.npy --stats b.json");
    holds(
        &run_of.stdout,
        &["no more than 128 are asked for", "good: 128 samples"],
    );
    tasks(&folder, &folder.path("b.slurm"), 0..2);
    let merged = run(merge(&folder, &folder.path("b.slurm")));
    assert_eq!(merged.code, Some(3), "{merged:?}");
    holds(
        &merged.stderr,
        &[
            "error: the error is",
            "above 0.100 %: some",
            "--sample-range 128..B",
        ],
    );
    let wanted = number(&merged.stderr, " samples a pixel should do");
    let error = error_of(&folder.json("b.json"));
    assert_eq!(
        wanted,
        ((128.0 * (error / 0.001).powi(2)) as u64).next_multiple_of(256)
    );
    assert_eq!(folder.npy("b.npy").width, 8);

    // What no pilot can say.
    folder.write("black.toml", crate::cli_support::BLACK);
    for (arguments, says) in [
        ("black.toml --error 1% --pilot 1ms", "too little light"),
        (
            "good.toml --error 0.0001% --pilot 1ms",
            "beyond the default cap: give --spp",
        ),
        (
            "lecture --error 1% --integrator lecture --size 8x8",
            "no error can be forecast",
        ),
    ] {
        let arguments = format!("submit slurm --tasks 2 --backend cpu --dry-run {arguments}");
        let run = folder.run(&arguments);
        assert_eq!(run.code, Some(2), "{run:?}");
        holds(&run.stderr, &[says]);
    }
}

#[test]
fn what_makes_no_sense_in_parts_is_refused() {
    let folder = folder();
    folder.write("there.slurm", "kept");
    for (arguments, says) in [
        ("--time 5m", "comes after --, as in `-- --time=1:00:00`"),
        ("--adaptive", "--adaptive has no parts"),
        ("--checkpoint a.film", "gpu-trace merge --checkpoint"),
        ("--dump-wgsl a.wgsl", "gpu-trace effects --dump-wgsl"),
        ("--view bvh-cost", "film files keep light"),
        ("--frames 0..2", "a job for each"),
        ("--inject-fault non-finite@0", "--inject-fault"),
        ("--gpus-per-task 2", "2"),
        ("--at-once 0", "0"),
        ("--pilot 1s", "--error"),
        ("--aov stderr", "-o image.exr"),
        ("-o a%j.npy", "Slurm takes % and \\"),
        ("-o a\\b.npy", "Slurm takes % and \\"),
        ("-o nowhere/a.npy", "nowhere"),
        ("-o a.npy --stats a.npy", "same file"),
        ("-o there.npy", "there.slurm is there already"),
        ("--termination 0.5", "--integrator lecture"),
        ("-- --array=0-3", "--array after --"),
        ("-- -a 0-3", "-a after --"),
        ("-- --dependency=afterok:1", "--dependency after --"),
        ("-- --wrap=true", "--wrap after --"),
        ("-- -D/tmp", "-D after --"),
    ] {
        let arguments = format!("submit slurm good.toml --tasks 2 --dry-run {arguments}");
        let said = folder.refused(&words(&arguments));
        holds(&said, &[says]);
    }
    holds(
        &folder.refused(&words("submit slurm good.toml --dry-run")),
        &["--tasks"],
    );
    holds(
        &folder.refused(&words("submit slurm none.toml --tasks 2 --dry-run")),
        &["none.toml"],
    );
    // Fewer windows than tasks: fewer parts.
    let run = submit(&folder, &words("good.toml --tasks 9 --spp 128 --dry-run"));
    assert_eq!(run.code, Some(0), "{run:?}");
    holds(
        &run.stderr,
        &["warning: 3 parts, not 9", "16, 64, 128, 256"],
    );
    holds(
        &run.stdout,
        &["#SBATCH --array=0-2\n", "2) samples=64..128 ;;"],
    );
}
