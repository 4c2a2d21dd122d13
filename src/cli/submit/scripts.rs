//! The scripts of a render on Slurm: short, for people to read and change, and for any `sh`.

use std::fmt::Write as _;
use std::ops::Range;

/// The script that submits the others.
pub(super) const SUBMIT: &str = "submit.sh";
/// The script of the tasks.
const TASK: &str = "task.sh";
/// The script of the merge.
const MERGE: &str = "merge.sh";
/// Where the first keeps the numbers of the jobs.
pub(super) const JOBS: &str = "jobs";

/// What the scripts are written from. Paths are absolute.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    /// The program.
    pub(super) program: String,
    /// The folder of the scripts, logs and parts.
    pub(super) folder: String,
    /// The scene's name, for people.
    pub(super) name: String,
    /// The scene, as a task finds it.
    pub(super) scene: String,
    /// The samples of each part.
    pub(super) parts: Vec<Range<u64>>,
    /// Why they are so many; nothing if that was said by the user.
    pub(super) why: Option<String>,
    /// Options of a part when it begins.
    pub(super) begin: Vec<String>,
    /// Options of a part whenever it is rendered.
    pub(super) always: Vec<String>,
    /// Options of the merge.
    pub(super) merge: Vec<String>,
    /// Whether a task has a GPU of Slurm's.
    pub(super) gpu: bool,
    /// Processors of a task.
    pub(super) cpus: Option<u32>,
    /// The most tasks at a time.
    pub(super) at_once: Option<u32>,
    /// Options of `sbatch`.
    pub(super) sbatch: Vec<String>,
}

impl Plan {
    /// All scripts, with their names; the one to start first.
    pub(super) fn scripts(&self) -> [(&'static str, String); 3] {
        [
            (SUBMIT, self.submit()),
            (TASK, self.task()),
            (MERGE, self.merge()),
        ]
    }

    fn submit(&self) -> String {
        format!(
            r#"#!/bin/sh
# Submits the parts and the merge after them. To be run again after a failure: what is done is not rendered again.
cd {folder} || exit 1
if [ -s {JOBS} ] && [ -n "$(squeue --noheader --jobs="$(cat {JOBS})" 2>/dev/null)" ]; then
    echo "the jobs $(cat {JOBS}) are still in the queue: wait for them, or scancel them" >&2
    exit 1
fi
set --{options}
parts=$(sbatch --parsable "$@" {TASK}) || exit 1
parts=${{parts%%;*}}
echo "$parts" >{JOBS}
if ! merge=$(sbatch --parsable --dependency="afterok:$parts" --kill-on-invalid-dep=yes "$@" {MERGE}); then
    scancel "$parts"
    exit 1
fi
merge=${{merge%%;*}}
echo "$parts,$merge" >{JOBS}
echo "parts: job $parts; merge: job $merge"
"#,
            folder = quote(&self.folder),
            options = words(&self.sbatch),
        )
    }

    fn task(&self) -> String {
        let last = self.parts.len().saturating_sub(1);
        let mut text = format!(
            "#!/bin/sh\n#SBATCH --job-name={}\n#SBATCH --array=0-{last}",
            self.job()
        );
        if let Some(most) = self.at_once {
            let _ = write!(text, "%{most}");
        }
        text += "\n#SBATCH --ntasks=1\n";
        if self.gpu {
            text += "#SBATCH --gpus-per-task=1\n";
        }
        if let Some(cpus) = self.cpus {
            let _ = writeln!(text, "#SBATCH --cpus-per-task={cpus}");
        }
        text += "#SBATCH --output=part-%a.log\n#SBATCH --open-mode=append\n#SBATCH --requeue\n\
                 #SBATCH --signal=B:USR1@60\n\n";
        let samples: u64 = self.parts.iter().map(|part| part.end - part.start).sum();
        let _ = writeln!(
            text,
            "# Renders a part of {}: which one says SLURM_ARRAY_TASK_ID. All have {samples} samples a pixel.",
            comment(&self.name)
        );
        if let Some(why) = &self.why {
            let _ = writeln!(text, "# {}.", comment(why));
        }
        let _ = write!(
            text,
            "cd {} || exit 1\ncase ${{SLURM_ARRAY_TASK_ID:?says which part}} in\n",
            quote(&self.folder)
        );
        for (number, part) in self.parts.iter().enumerate() {
            let _ = writeln!(text, "{number}) samples={}..{} ;;", part.start, part.end);
        }
        let _ = write!(
            text,
            r#"*) echo "there is no part $SLURM_ARRAY_TASK_ID" >&2 && exit 2 ;;
esac
part=part-$SLURM_ARRAY_TASK_ID

# It goes on from its film file.
if [ -e "$part.film" ]; then
    set -- resume{always} "$part.film"
else
    set -- render{begin}{always} --sample-range "$samples" --checkpoint "$part.film" --output "$part.exr" -- {scene}
fi

# The CPU reference and Mesa's lavapipe take as many threads as the task has processors.
if [ -n "${{SLURM_CPUS_PER_TASK-}}" ]; then
    export RAYON_NUM_THREADS="$SLURM_CPUS_PER_TASK" LP_NUM_THREADS="$SLURM_CPUS_PER_TASK"
fi

# A signal (USR1 comes before the time is up) is passed on as HUP, at which the program keeps what there is.
film() {{ ls -i "$part.film" 2>/dev/null; }}
before=$(film)
child=
trap 'kill -s HUP "$child" 2>/dev/null' INT TERM USR1
{program} "$@" &
child=$!
while
    wait "$child"
    code=$?
    kill -s 0 "$child" 2>/dev/null
do :; done

# 0: done. 2: wrong in any case. Else it goes on later, unless the job has been cancelled or is in the queue again:
# up to 100 times, 3 times if nothing was added.
case $code in 0 | 2) exit "$code" ;; esac
most=3
[ "$(film)" = "$before" ] || most=100
# The last task has the number of the whole array, so each is named by both.
job=${{SLURM_ARRAY_JOB_ID-}}_$SLURM_ARRAY_TASK_ID
if [ "${{SLURM_RESTART_COUNT:-0}}" -lt "$most" ] && [ -n "${{SLURM_ARRAY_JOB_ID-}}" ]; then
    case $(squeue --noheader --format=%T --jobs="$job") in
    RUNNING | SIGNALING) echo "ended with $code: requeued" >&2 && scontrol requeue "$job" ;;
    esac
fi
exit "$code"
"#,
            always = words(&self.always),
            begin = words(&self.begin),
            scene = quote(&self.scene),
            program = quote(&self.program),
        );
        text
    }

    fn merge(&self) -> String {
        let [start, end] = [
            self.parts.first().map_or(0, |p| p.start),
            self.parts.last().map_or(0, |p| p.end),
        ];
        format!(
            r#"#!/bin/sh
#SBATCH --job-name={job}-merge
#SBATCH --ntasks=1
#SBATCH --output=merge.log
#SBATCH --open-mode=append

# Joins the parts to one image.
cd {folder} || exit 1
set --{options}
part=0
while [ "$part" -lt {count} ]; do
    set -- "$@" "part-$part.film"
    part=$((part + 1))
done
exec {program} merge --sample-range {start}..{end} "$@"
"#,
            job = self.job(),
            folder = quote(&self.folder),
            options = words(&self.merge),
            count = self.parts.len(),
            program = quote(&self.program),
        )
    }

    /// The name of the job: letters that mean nothing to anybody.
    fn job(&self) -> String {
        let plain = |c: char| {
            if c.is_ascii_alphanumeric() || ".-_".contains(c) {
                c
            } else {
                '_'
            }
        };
        self.name.chars().map(plain).collect()
    }
}

/// A word as `sh` reads it back.
pub(super) fn quote(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.into()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// Words that follow another one.
fn words(all: &[String]) -> String {
    all.iter().map(|word| format!(" {}", quote(word))).collect()
}

/// Text within the line of a comment.
fn comment(text: &str) -> String {
    let shown = |c: char| match c.is_control() {
        true => '?',
        false => c,
    };
    text.chars().map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn words_come_back() {
        let hostile = [
            "",
            " ",
            "a b",
            "'",
            "''",
            "\"",
            "$HOME",
            "`id`",
            "a\nb",
            "\\",
            "\\'",
            "*",
            "~",
            "-x",
            "--",
            "#",
            ";id",
            "ä",
            "a'b\"c\n$d",
            "!",
            "&",
            "%a",
            "\t",
            "=",
            "a=b",
        ];
        // Each is one argument, between two bars.
        for word in hostile {
            let run = |word: &str| {
                let script = format!("printf '|%s|' {word}");
                let output = std::process::Command::new("sh")
                    .arg("-c")
                    .arg(script)
                    .output();
                output.expect("sh").stdout
            };
            assert_eq!(
                run(&quote(word)),
                format!("|{word}|").into_bytes(),
                "{word:?}"
            );
        }
        // Companion: most of them are not what they are without.
        let bare = std::process::Command::new("sh")
            .args(["-c", "printf '|%s|' a b"])
            .output();
        assert_ne!(bare.expect("sh").stdout, b"|a b|");
    }

    #[test]
    fn comments_are_of_one_line() {
        assert_eq!(comment("a\nrm -r b\r\u{85}"), "a?rm -r b??");
    }
}
