//! What the tests of the program share: a folder to run it in, and what comes out of a run.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

use gpu_trace::image::Picture;
use gpu_trace::input::read;
use serde_json::Value;
use tempfile::TempDir;

/// No run takes this long, on the slowest machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// A scene without mistakes, with a lens, three materials, and light.
pub(crate) const GOOD: &str = r#"[camera]
position = [0.0, 0.0, -4.0]
look_at = [0.0, 0.0, 6.0]
fov = 36.0
aperture_radius = 0.1
focus_distance = 4.0
[image]
width = 8
height = 6
[environment]
radiance = [0.7, 0.8, 1.0]
[material.white]
type = "diffuse"
albedo = [0.9, 0.8, 0.7]
[material.chrome]
type = "mirror"
reflectance = [0.9, 0.9, 0.9]
[material.glass]
type = "dielectric"
ior = 1.5
[[sphere]]
center = [0.0, 1.0, 2.0]
radius = 1.0
material = "white"
[[sphere]]
center = [3.0, 1.0, 2.0]
radius = 0.5
material = "glass"
[[sphere]]
center = [-3.0, 1.0, 2.0]
radius = 0.5
material = "chrome"
"#;

/// A scene in which no path finds light.
pub(crate) const BLACK: &str = "
camera = { position = [0, 0, 0], look_at = [0, 0, 1], fov = 40 }
image = { width = 2, height = 2 }
";

/// Names, contents and times of all files of a folder.
pub(crate) type Snapshot = BTreeMap<PathBuf, (Option<Vec<u8>>, SystemTime)>;

/// A folder in which the program runs.
pub(crate) struct Folder(TempDir);

/// What a run left.
#[derive(Debug)]
pub(crate) struct Run {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Folder {
    pub(crate) fn new() -> Self {
        Self(TempDir::new().expect("a temporary folder"))
    }

    /// A folder with the good scene in `good.toml`.
    pub(crate) fn with_scene() -> Self {
        let folder = Self::new();
        folder.write("good.toml", GOOD);
        folder
    }

    pub(crate) fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).expect("the folder can be written to");
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// The program with the words of `arguments`, in this folder, without a terminal.
    pub(crate) fn command(&self, arguments: &str) -> Command {
        self.command_of(&arguments.split_whitespace().collect::<Vec<_>>())
    }

    /// As [`command`](Self::command), of arguments that may hold spaces.
    pub(crate) fn command_of(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gpu-trace"));
        command
            .args(arguments)
            .current_dir(self.0.path())
            .stdin(Stdio::null())
            .env_remove("NO_COLOR")
            .env_remove("CLICOLOR_FORCE");
        command
    }

    /// Runs the program to its end.
    pub(crate) fn run(&self, arguments: &str) -> Run {
        self.run_of(&arguments.split_whitespace().collect::<Vec<_>>())
    }

    /// As [`run`](Self::run), of arguments that may hold spaces.
    pub(crate) fn run_of(&self, arguments: &[&str]) -> Run {
        let mut command = assert_cmd::Command::from_std(self.command_of(arguments));
        let output = command.timeout(PATIENCE).output();
        Run::new(output.unwrap_or_else(|e| panic!("{arguments:?}: {e}")))
    }

    /// Runs what must work and have nothing to complain of; returns stdout.
    pub(crate) fn ok(&self, arguments: &str) -> String {
        let run = self.run(arguments);
        assert_eq!(
            (run.code, run.stderr.as_str()),
            (Some(0), ""),
            "{arguments}"
        );
        run.stdout
    }

    /// Runs what must be refused without leaving a trace; returns stderr.
    pub(crate) fn refused(&self, arguments: &[&str]) -> String {
        let before = self.snapshot();
        let run = self.run_of(arguments);
        assert_eq!(
            (run.code, run.stdout.as_str()),
            (Some(2), ""),
            "{arguments:?}: {run:?}"
        );
        assert!(run.stderr.starts_with("error"), "{arguments:?}: {run:?}");
        assert_eq!(before, self.snapshot(), "{arguments:?} changed a file");
        run.stderr
    }

    pub(crate) fn snapshot(&self) -> Snapshot {
        let files = fs::read_dir(self.0.path()).expect("the folder can be listed");
        files
            .map(|entry| entry.expect("an entry of the folder").path())
            .map(|path| {
                // Links are not followed: one may lead to a device that has no end.
                let data = fs::symlink_metadata(&path).expect("the file is there");
                let bytes = data
                    .is_file()
                    .then(|| fs::read(&path).expect("it can be read"));
                (path, (bytes, data.modified().expect("files have a time")))
            })
            .collect()
    }

    /// The names of all files, in order.
    pub(crate) fn names(&self) -> Vec<String> {
        let name = |path: &PathBuf| path.file_name().map(|n| n.to_string_lossy().into_owned());
        self.snapshot().keys().filter_map(name).collect()
    }

    pub(crate) fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.read(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub(crate) fn npy(&self, name: &str) -> Picture {
        read(&self.path(name))
            .unwrap_or_else(|e| panic!("{e}"))
            .picture
    }

    /// Renders with `arguments`; the picture and the statistics.
    pub(crate) fn render(&self, arguments: &str) -> (Picture, Value) {
        self.ok(&format!("{arguments} -o r.npy --stats r.json"));
        (self.npy("r.npy"), self.json("r.json"))
    }
}

impl Run {
    pub(crate) fn new(output: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).expect("the program prints UTF-8");
        let run = Self {
            code: output.status.code(),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        };
        assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
        run
    }
}

/// A run in the background, killed when the test ends.
pub(crate) struct Background {
    child: Child,
    stderr: BufReader<ChildStderr>,
}

impl Background {
    pub(crate) fn start(folder: &Folder, arguments: &str) -> Self {
        Self::of(folder.command(arguments))
    }

    /// Starts a command of which stdout and stderr are read here.
    pub(crate) fn of(mut command: Command) -> Self {
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        #[cfg(unix)]
        hear_signals(&mut command);
        let mut child = command.spawn().expect("the program starts");
        let stderr = BufReader::new(child.stderr.take().expect("a pipe"));
        Self { child, stderr }
    }

    /// Waits for a line on stderr that holds `part`.
    pub(crate) fn wait_for(&mut self, part: &str) {
        let mut line = String::new();
        while !line.contains(part) {
            line.clear();
            let length = self.stderr.read_line(&mut line).expect("stderr is text");
            assert!(length > 0, "the run ended without {part:?}");
        }
    }

    pub(crate) fn signal(&self, name: &str) {
        self.signal_to(name, &self.child.id().to_string());
    }

    /// A signal to all processes of a run that was started as a process group.
    #[cfg(unix)]
    pub(crate) fn signal_group(&self, name: &str) {
        self.signal_to(name, &format!("-{}", self.child.id()));
    }

    fn signal_to(&self, name: &str, whom: &str) {
        let mut kill = Command::new("kill");
        let status = kill.args(["-s", name, "--", whom]).status();
        assert!(status.is_ok_and(|status| status.success()), "kill -{name}");
    }

    /// Waits until it has computed for so long: what it does by then does not depend on what else runs.
    pub(crate) fn wait_for_work(&mut self, time: Duration) {
        while self.runs() && self.computed().is_none_or(|done| done < time) {
            sleep(Duration::from_millis(10));
        }
    }

    /// The processor's time that all its threads have had, where the system says it; elsewhere all that there is.
    fn computed(&self) -> Option<Duration> {
        if !cfg!(target_os = "linux") {
            sleep(Duration::from_millis(500));
            return Some(Duration::MAX);
        }
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id())).ok()?;
        // Behind the name in brackets `utime` and `stime` are the 12th and 13th, in hundredths of a second.
        let (_, numbers) = stat.rsplit_once(')')?;
        let mut numbers = numbers.split_whitespace().skip(11);
        let mut next = || numbers.next()?.parse::<u64>().ok();
        Some(Duration::from_millis(10 * (next()? + next()?)))
    }

    /// Whether it still runs.
    pub(crate) fn runs(&mut self) -> bool {
        self.child
            .try_wait()
            .expect("it can be waited for")
            .is_none()
    }

    pub(crate) fn finish(mut self) -> Run {
        let deadline = Instant::now() + Duration::from_secs(60);
        while self.runs() {
            assert!(Instant::now() < deadline, "the run does not end");
            sleep(Duration::from_millis(10));
        }
        let (mut stdout, mut stderr) = (Vec::new(), Vec::new());
        let pipe = self.child.stdout.as_mut().expect("a pipe");
        pipe.read_to_end(&mut stdout).expect("the rest of stdout");
        self.stderr
            .read_to_end(&mut stderr)
            .expect("the rest of stderr");
        let status = self.child.wait().expect("it has ended");
        Run::new(std::process::Output {
            status,
            stdout,
            stderr,
        })
    }
}

/// Makes the process hear the signals of tests, though these may run where they are ignored: whatever a
/// shell starts in the background ignores SIGINT, and `nohup` SIGHUP.
#[cfg(unix)]
#[expect(unsafe_code, reason = "a system call between fork and exec")]
fn hear_signals(command: &mut Command) {
    use std::os::unix::process::CommandExt as _;
    // SAFETY: signal(2) may be called after a fork, and no memory is touched.
    unsafe {
        command.pre_exec(|| {
            for signal in [libc::SIGINT, libc::SIGTERM, libc::SIGHUP] {
                libc::signal(signal, libc::SIG_DFL);
            }
            Ok(())
        });
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        // Fails where it has ended already, as it should have.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The bits of a picture's values.
pub(crate) fn bits(picture: &Picture) -> Vec<u32> {
    let values = picture.pixels.as_flattened().iter();
    values.map(|value| value.to_bits()).collect()
}

/// The mean of all values.
pub(crate) fn mean(picture: &Picture) -> f64 {
    let values = picture.pixels.as_flattened();
    values.iter().copied().map(f64::from).sum::<f64>() / values.len() as f64
}

/// That `text` holds all of `parts`.
pub(crate) fn holds(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
}

/// The name by which this executable knows the test `name` of a `module_path!()`.
pub(crate) fn full_name(module: &str, name: &str) -> String {
    let (_, module) = module.split_once("::").expect("the crate is before it");
    format!("{module}::{name}")
}
