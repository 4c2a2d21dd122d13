//! The tests by their files: which there are, and running these side by side.

use std::collections::{BTreeMap, VecDeque};
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use serde_json::Value;

use crate::cargo;
use crate::drivers::Driver;

/// The tests of a file, which run in a process of their own.
#[derive(Clone, Debug)]
pub(crate) struct Tests {
    /// The name of the file in `tests/`, or of the crate whose own tests these are.
    pub(crate) name: String,
    program: PathBuf,
    /// The folder of the package, where cargo runs its tests.
    folder: PathBuf,
    /// Their full names.
    cases: Vec<String>,
    /// How many [`Tests::retain`] has left out.
    filtered: u64,
}

impl Tests {
    /// Keeps the tests for whose full names `keep` holds.
    pub(crate) fn retain(&mut self, keep: impl Fn(&str) -> bool) {
        let before = self.cases.len();
        self.cases.retain(|case| keep(case));
        self.filtered += (before - self.cases.len()) as u64;
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.cases.is_empty()
    }
}

/// What is run on one driver.
pub(crate) struct Part {
    pub(crate) driver: Driver,
    /// What the program says that it runs on.
    pub(crate) adapter: String,
    pub(crate) tests: Vec<Tests>,
    /// Further arguments of their harness.
    pub(crate) options: Vec<String>,
    /// What the program is asked after that: each must exit with 0.
    pub(crate) commands: Vec<Command>,
}

/// What has come of a part.
#[derive(Debug, Default)]
pub(crate) struct Count {
    pub(crate) passed: u64,
    pub(crate) failed: u64,
    pub(crate) ignored: u64,
    pub(crate) filtered: u64,
    /// Of all its processes together.
    pub(crate) seconds: f64,
    /// Why it has not held.
    pub(crate) faults: Vec<String>,
}

/// Builds the tests that `arguments` of `cargo test` choose.
///
/// # Errors
/// If they do not compile, or do not tell their names.
pub(crate) fn build(arguments: &[&str]) -> Result<Vec<Tests>, String> {
    let shown = format!("cargo test --no-run {}", arguments.join(" "));
    eprintln!("$ {shown}");
    let failed = |error: std::io::Error| format!("{shown}: {error}");
    let mut child = cargo()
        .args([
            "test",
            "--no-run",
            "--message-format=json-render-diagnostics",
        ])
        .args(arguments)
        .stdout(Stdio::piped())
        .spawn()
        .map_err(failed)?;
    let mut all = Vec::new();
    let output = child.stdout.take().into_iter();
    for line in output.flat_map(|o| BufReader::new(o).lines()) {
        // What else a build script prints is no JSON.
        let Ok(message) = serde_json::from_str(&line.map_err(failed)?) else {
            continue;
        };
        all.extend(executable(&message));
    }
    match child.wait() {
        Ok(status) if status.success() => {}
        Ok(status) => return Err(format!("{shown}: {status}")),
        Err(error) => return Err(failed(error)),
    }
    let mut files = Vec::new();
    for tests in all {
        let listed = Command::new(&tests.program)
            .args(["--list", "--format", "terse"])
            .output();
        let shown = tests.program.display();
        let listed = listed.map_err(|e| format!("{shown}: {e}"))?;
        if !listed.status.success() {
            return Err(format!("{shown} --list: {}", listed.status));
        }
        files.extend(by_file(&tests, &String::from_utf8_lossy(&listed.stdout)));
    }
    Ok(files)
}

/// The executable of tests that cargo tells of in `message`, if it does; its tests are not known yet.
fn executable(message: &Value) -> Option<Tests> {
    let program = message["executable"].as_str()?;
    let manifest = PathBuf::from(message["manifest_path"].as_str()?);
    message["profile"]["test"].as_bool()?.then_some(Tests {
        name: message["target"]["name"].as_str()?.to_owned(),
        program: program.into(),
        folder: manifest.parent()?.into(),
        cases: Vec::new(),
        filtered: 0,
    })
}

/// The tests that an executable lists as `NAME: test`; those of the one of `tests/` by their files, which
/// are its modules.
fn by_file(executable: &Tests, listed: &str) -> Vec<Tests> {
    let cases = listed.lines().filter_map(|l| l.strip_suffix(": test"));
    let mut files: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for case in cases {
        let name = match executable.name.as_str() {
            "tests" => case.split("::").next().unwrap_or(case),
            name => name,
        };
        files.entry(name).or_default().push(case.to_owned());
    }
    let tests = files.into_iter().map(|(name, cases)| Tests {
        name: name.to_owned(),
        cases,
        ..executable.clone()
    });
    tests.collect()
}

/// What a worker does next.
enum Job {
    Tests(Tests, Vec<String>),
    Command(Command),
}

/// Runs all parts, as many processes at a time as there are cores, and shows what each of them wrote once
/// it has ended. Each runs its tests one by one, unless `RUST_TEST_THREADS` says otherwise: that keeps all
/// cores busy to the end, and a device is opened once for a file. All see `variable`.
pub(crate) fn run(parts: Vec<Part>, variable: Option<(&str, &str)>) -> Vec<Count> {
    let counts: Vec<Mutex<Count>> = parts.iter().map(|_| Mutex::default()).collect();
    let mut queue = VecDeque::new();
    for (i, part) in parts.into_iter().enumerate() {
        for tests in part.tests {
            let job = Job::Tests(tests, part.options.clone());
            queue.push_back((i, part.driver.clone(), job));
        }
        for command in part.commands {
            queue.push_back((i, part.driver.clone(), Job::Command(command)));
        }
    }
    let queue = Mutex::new(queue);
    let next = || {
        let mut queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
        queue.pop_front()
    };
    let work = || {
        while let Some((i, driver, job)) = next() {
            let done = one(&driver, job, variable);
            let mut count = counts[i].lock().unwrap_or_else(PoisonError::into_inner);
            count.add(done);
        }
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(work);
        }
    });
    let inner = |count: Mutex<Count>| count.into_inner().unwrap_or_else(PoisonError::into_inner);
    counts.into_iter().map(inner).collect()
}

/// Runs a job to its end, and shows what it wrote.
fn one(driver: &Driver, job: Job, variable: Option<(&str, &str)>) -> Count {
    let (name, mut command, wanted, filtered) = match job {
        Job::Command(command) => {
            let arguments: Vec<_> = command.get_args().map(|a| a.to_string_lossy()).collect();
            let name = format!("gpu-trace {}", arguments.join(" "));
            (name, command, None, 0)
        }
        Job::Tests(tests, options) => {
            let mut command = Command::new(&tests.program);
            // Options such as `--ignored` choose once more.
            let all = options.is_empty().then_some(tests.cases.len() as u64);
            command
                .arg("--exact")
                .args(options)
                .args(tests.cases)
                .current_dir(&tests.folder)
                .env("CARGO_MANIFEST_DIR", &tests.folder);
            if std::env::var_os("RUST_TEST_THREADS").is_none() {
                command.env("RUST_TEST_THREADS", "1");
            }
            (tests.name, command, Some(all), tests.filtered)
        }
    };
    let name = format!("{name} on {}", driver.name);
    eprintln!("started {name}");
    let before = Instant::now();
    let mut command = driver.choose(command.envs(variable));
    let output = command.stdin(Stdio::null()).output();
    let seconds = before.elapsed().as_secs_f64();
    let mut count = Count {
        seconds,
        ..Count::default()
    };
    match output {
        Err(error) => count.faults.push(format!("{name}: {error}")),
        Ok(output) => {
            let mut shown = format!("\n--- {name}, {seconds:.1} s\n").into_bytes();
            shown.extend(&output.stdout);
            shown.extend(&output.stderr);
            // A closed pipe is no fault of the tests.
            let _ = std::io::stdout().lock().write_all(&shown);
            let text = String::from_utf8_lossy(&output.stdout);
            // The last: tests may show what others have come to.
            let result = text
                .lines()
                .rev()
                .find_map(|l| l.strip_prefix("test result: "));
            if let Some(result) = result {
                count.passed = number(result, "passed");
                count.failed = number(result, "failed");
                count.ignored = number(result, "ignored");
                count.filtered = filtered;
            }
            if !output.status.success() {
                count.faults.push(format!("{name}: {}", output.status));
            } else if wanted.is_some() && result.is_none() {
                count.faults.push(format!("{name}: it says no result"));
            } else if let Some(Some(all)) = wanted {
                let ran = count.passed + count.ignored;
                if ran != all {
                    count
                        .faults
                        .push(format!("{name}: {ran} tests of {all} ran"));
                }
            }
        }
    }
    count
}

impl Count {
    /// Adds what else has come of the part.
    pub(crate) fn add(&mut self, more: Self) {
        self.passed += more.passed;
        self.failed += more.failed;
        self.ignored += more.ignored;
        self.filtered += more.filtered;
        self.seconds += more.seconds;
        self.faults.extend(more.faults);
    }
}

/// The number before `word`, as in `ok. 9 passed; 0 failed`.
fn number(result: &str, word: &str) -> u64 {
    let words: Vec<&str> = result.split([' ', ';']).collect();
    let number = words.windows(2).find(|pair| pair[1] == word);
    number.and_then(|pair| pair[0].parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use serde_json::json;

    use super::{Part, Tests, by_file, executable, number, run};
    use crate::drivers::Driver;

    #[test]
    fn results_are_counted() {
        let result = "FAILED. 12 passed; 3 failed; 1 ignored; 0 measured; 7 filtered out";
        let all = ["passed", "failed", "ignored", "filtered"].map(|word| number(result, word));
        assert_eq!(all, [12, 3, 1, 7]);
        assert_eq!(number("something else", "passed"), 0);
    }

    #[test]
    fn executables_of_tests_are_found() {
        let mut message = json!({
            "executable": "/t/faults-1", "manifest_path": "/p/Cargo.toml",
            "profile": { "test": true }, "target": { "name": "faults" },
        });
        let found = executable(&message).expect("an executable");
        assert_eq!((found.name.as_str(), found.folder), ("faults", "/p".into()));
        message["profile"]["test"] = json!(false);
        assert!(
            executable(&message).is_none(),
            "the program itself has no tests"
        );
    }

    #[test]
    fn tests_are_told_by_their_files() {
        let listed =
            "aov::a: test\nconverge::shown::b: test\naov::c: test\n\n3 tests, 0 benchmarks\n";
        let names = |name: &str| -> Vec<(String, usize)> {
            let executable = tests(name, &[]);
            let files = by_file(&executable, listed).into_iter();
            files.map(|t| (t.name, t.cases.len())).collect()
        };
        assert_eq!(names("tests"), [("aov".into(), 2), ("converge".into(), 1)]);
        assert_eq!(names("gpu_trace"), [("gpu_trace".into(), 3)]);
    }

    #[test]
    fn what_is_left_out_is_counted() {
        let mut some = tests("some", &["a", "b", "ab"]);
        some.retain(|case| case.contains('a'));
        assert_eq!((some.cases.len(), some.filtered), (2, 1));
    }

    /// Tests of this executable.
    fn tests(name: &str, cases: &[&str]) -> Tests {
        Tests {
            name: name.into(),
            program: std::env::current_exe().expect("the test's own path"),
            folder: ".".into(),
            cases: cases.iter().map(|&case| case.to_owned()).collect(),
            filtered: 0,
        }
    }

    /// A part whose only executable is this one, of which it runs the test of that name.
    fn part(name: &str) -> Part {
        Part {
            driver: Driver::system(),
            adapter: String::new(),
            tests: vec![tests("xtask", &[name])],
            options: Vec::new(),
            commands: Vec::new(),
        }
    }

    #[test]
    fn what_fails_is_a_fault() {
        let good = part("suite::tests::results_are_counted");
        let missing = Part {
            commands: vec![Command::new("/no/such/program")],
            ..part("no test of this name")
        };
        let mut bad = part("suite::tests::results_are_counted");
        bad.options.push("--no-such-option".into());
        let [good, missing, bad] = &run(vec![good, missing, bad], None)[..] else {
            panic!("three parts");
        };
        assert_eq!((good.passed, good.failed, good.faults.len()), (1, 0, 0));
        // One that is not there, and a command that is not.
        assert_eq!((missing.passed, missing.faults.len()), (0, 2));
        for words in ["0 tests of 1 ran", "No such file"] {
            let found = missing.faults.iter().any(|fault| fault.contains(words));
            assert!(found, "{words}: {missing:?}");
        }
        assert_eq!((bad.passed, bad.faults.len()), (0, 1), "{bad:?}");
    }
}
