//! `cargo xtask slurm`: a Slurm of one node on this machine, and the tests of `submit slurm` on it.

use std::fs;
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::drivers::first;
use crate::{cargo, run};

/// The tests.
const TESTS: &str = "slurm::cluster";
/// What has to be there.
const COMMANDS: [&str; 8] = [
    "slurmctld",
    "slurmd",
    "munged",
    "sbatch",
    "squeue",
    "scancel",
    "scontrol",
    "sinfo",
];
const INSTALL: &str = "\
these tests start a Slurm of their own, which has to be installed, and nothing of which has to run:
  Debian, Ubuntu   apt-get install --no-install-recommends slurm-wlm munge
  Fedora           dnf install slurm-slurmctld slurm-slurmd munge";
/// What is started, in the order in which it is stopped.
const DAEMONS: [&str; 3] = ["slurmd", "slurmctld", "munged"];
/// Until the node is there.
const PATIENCE: Duration = Duration::from_secs(60);

/// Starts a Slurm, runs the tests on it, and stops it.
pub(crate) fn all(arguments: &[String]) -> Result<(), String> {
    if !arguments.is_empty() {
        return Err("Usage: cargo xtask slurm".into());
    }
    let missing: Vec<&str> = COMMANDS
        .into_iter()
        .filter(|name| path(name).is_none())
        .collect();
    if !missing.is_empty() {
        return Err(format!(
            "there is no {} here: {INSTALL}",
            missing.join(", ")
        ));
    }
    let (driver, _) = first()?;
    // Before a Slurm waits for it.
    run(cargo().args(["test", "--no-run", "--test", "tests"]))?;
    let slurm = Slurm::start()?;
    let mut tests = cargo();
    tests
        .args([
            "test",
            "--test",
            "tests",
            "--",
            "--ignored",
            "--test-threads=1",
            TESTS,
        ])
        .env("SLURM_CONF", slurm.configuration());
    run(&mut driver.choose(&tests))
}

/// Where a command is: daemons are not in everybody's `PATH`.
fn path(command: &str) -> Option<PathBuf> {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let more = ["/usr/sbin", "/sbin", "/usr/local/sbin"].map(PathBuf::from);
    let mut paths = std::env::split_paths(&folders)
        .chain(more)
        .map(|folder| folder.join(command));
    paths.find(|path| path.is_file())
}

/// A Slurm that listens on this machine alone, and ends with this.
struct Slurm {
    folder: PathBuf,
}

impl Slurm {
    fn start() -> Result<Self, String> {
        let folder = std::env::temp_dir().join(format!("gpu-trace-slurm-{}", std::process::id()));
        let slurm = Self { folder };
        slurm
            .write()
            .map_err(|e| format!("{}: {e}", slurm.folder.display()))?;
        let munge =
            |option: &str, name: &str| format!("--{option}={}", slurm.folder.join(name).display());
        slurm.daemon(
            "munged",
            &[
                "--force",
                &munge("key-file", "munge.key"),
                &munge("socket", "munge.sock"),
                &munge("pid-file", "munged.pid"),
                &munge("log-file", "munged.log"),
                &munge("seed-file", "munged.seed"),
            ],
        )?;
        slurm.daemon("slurmctld", &["-c"])?;
        slurm.daemon("slurmd", &["-c", "-N", "localhost"])?;
        let begin = Instant::now();
        let runs = |name: &str| slurm.process(name).is_some();
        while slurm.state() != "idle" || !DAEMONS.into_iter().all(runs) {
            if begin.elapsed() > PATIENCE {
                return Err(format!(
                    "Slurm's node does not come: it is {:?}\n{}",
                    slurm.state(),
                    slurm.logs()
                ));
            }
            sleep(Duration::from_millis(200));
        }
        Ok(slurm)
    }

    /// Its folder, with all that the daemons read.
    fn write(&self) -> std::io::Result<()> {
        let folder = &self.folder;
        for name in ["state", "spool"] {
            fs::create_dir_all(folder.join(name))?;
        }
        fs::set_permissions(folder, fs::Permissions::from_mode(0o755))?;
        let key = folder.join("munge.key");
        // As long as it has to be, and as random as the numbers of this machine.
        let mut random = fs::File::open("/dev/urandom")?;
        std::io::copy(
            &mut std::io::Read::take(&mut random, 1024),
            &mut fs::File::create(&key)?,
        )?;
        fs::set_permissions(&key, fs::Permissions::from_mode(0o400))?;
        let [controller, node] = [port()?, port()?];
        let user = Command::new("id").arg("-un").output()?.stdout;
        let user = String::from_utf8_lossy(&user);
        let (here, user) = (folder.display(), user.trim());
        fs::write(
            self.configuration(),
            // A requeued job waits as long as a credential is good for: 120 s if nothing is said.
            format!(
                "ClusterName=local\nSlurmctldHost=localhost(127.0.0.1)\nSlurmUser={user}\nSlurmdUser={user}\n\
                 AuthType=auth/munge\nAuthInfo=socket={here}/munge.sock,cred_expire=5\nCredType=cred/munge\n\
                 CommunicationParameters=NoCtldInAddrAny,NoInAddrAny\nSlurmctldPort={controller}\n\
                 SlurmdPort={node}\nStateSaveLocation={here}/state\nSlurmdSpoolDir={here}/spool\n\
                 SlurmctldPidFile={here}/slurmctld.pid\nSlurmdPidFile={here}/slurmd.pid\n\
                 SlurmctldLogFile={here}/slurmctld.log\nSlurmdLogFile={here}/slurmd.log\n\
                 SlurmdParameters=config_overrides\nProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\n\
                 MpiDefault=none\nSwitchType=switch/none\nSchedulerParameters=sched_interval=2,bf_interval=2\n\
                 SelectType=select/cons_tres\nSelectTypeParameters=CR_Core\nReturnToService=2\n\
                 AccountingStorageType=accounting_storage/none\nJobAcctGatherType=jobacct_gather/none\n\
                 KillWait=5\nGresTypes=gpu\n\
                 NodeName=localhost NodeAddr=127.0.0.1 CPUs=2 RealMemory=1000 Gres=gpu:2 State=UNKNOWN\n\
                 PartitionName=main Nodes=localhost Default=YES MaxTime=INFINITE State=UP\n"
            ),
        )?;
        // Any device will do.
        fs::write(
            folder.join("gres.conf"),
            "Name=gpu File=/dev/null\nName=gpu File=/dev/zero\n",
        )
    }

    fn configuration(&self) -> PathBuf {
        self.folder.join("slurm.conf")
    }

    /// Starts what goes to the background by itself.
    fn daemon(&self, name: &str, arguments: &[&str]) -> Result<(), String> {
        let program = path(name).unwrap_or_else(|| name.into());
        let mut command = Command::new(program);
        command
            .args(arguments)
            .env("SLURM_CONF", self.configuration())
            .stdin(Stdio::null());
        run(&mut command).map_err(|error| format!("{error}\n{}", self.logs()))
    }

    /// The state of the node; nothing while nobody answers.
    fn state(&self) -> String {
        let mut command = Command::new("sinfo");
        command
            .args(["--noheader", "--format=%T"])
            .env("SLURM_CONF", self.configuration());
        let output = command.stderr(Stdio::null()).output();
        output.map_or_else(
            |_| String::new(),
            |o| String::from_utf8_lossy(&o.stdout).trim().into(),
        )
    }

    /// The process of a daemon, if it runs.
    fn process(&self, name: &str) -> Option<String> {
        let text = fs::read_to_string(self.folder.join(format!("{name}.pid"))).ok()?;
        Some(text.trim().to_owned()).filter(|process| !process.is_empty())
    }

    /// Ends a daemon, and waits until it has.
    fn stop(&self, name: &str) {
        let Some(process) = self.process(name) else {
            return;
        };
        let signal = |signal: &str| {
            let mut kill = Command::new("kill");
            let status = kill
                .args(["-s", signal, &process])
                .stderr(Stdio::null())
                .status();
            status.is_ok_and(|status| status.success())
        };
        signal("TERM");
        let begin = Instant::now();
        while signal("0") && begin.elapsed() < Duration::from_secs(10) {
            sleep(Duration::from_millis(100));
        }
    }

    fn logs(&self) -> String {
        let log = |name: &str| fs::read_to_string(self.folder.join(name)).unwrap_or_default();
        ["munged.log", "slurmctld.log", "slurmd.log"]
            .map(log)
            .concat()
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        // The controller last of Slurm's, and munge last of all.
        for name in DAEMONS {
            self.stop(name);
        }
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// A port of this machine that is free.
fn port() -> std::io::Result<u16> {
    Ok(TcpListener::bind("127.0.0.1:0")?.local_addr()?.port())
}
