//! Job descriptions for schedulers: the same command for each shard.

/// A scheduler.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Farm {
    /// A script for `sbatch`: an array job.
    Slurm,
    /// An Open Job Description template.
    OpenJd,
    /// A Kubernetes Job with completion mode Indexed.
    Kubernetes,
    /// A command a line: GNU parallel, xargs, OpenCue's cuecmd, Tractor.
    Commands,
}

/// What a job runs.
#[derive(Clone, Debug)]
pub struct Job {
    /// The program.
    pub program: String,
    /// The manifest as the machines of the farm see it.
    pub manifest: String,
    /// Folder in which the program starts there.
    pub folder: String,
    /// Shards: tasks of the job.
    pub shards: u32,
    /// Threads of a task.
    pub threads: u16,
    /// Further words of the command, such as `--cache DIR`.
    pub options: Vec<String>,
    /// Container image, for Kubernetes.
    pub image: String,
    /// Persistent volume claim that is mounted at `folder`, for Kubernetes.
    pub claim: String,
}

/// Tries of a shard that ended with exit code 75 or was killed.
const RETRIES: u32 = 3;

/// The text of `job` for `farm`.
pub fn farm_job(farm: Farm, job: &Job) -> String {
    match farm {
        Farm::Slurm => slurm(job),
        Farm::OpenJd => open_jd(job),
        Farm::Kubernetes => kubernetes(job),
        Farm::Commands => commands(job),
    }
}

impl Job {
    /// The command of a shard, word by word.
    fn words(&self, manifest: &str, shard: &str, threads: &str) -> Vec<String> {
        let words = [
            &self.program,
            "bake",
            "--shard",
            shard,
            "--keep-going",
            "--threads",
            threads,
        ];
        let words = words.map(str::to_owned).into_iter();
        let last = ["--".to_owned(), manifest.to_owned()];
        words.chain(self.options.clone()).chain(last).collect()
    }
}

/// `word` for a POSIX shell.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

fn line(words: &[String]) -> String {
    let words: Vec<String> = words.iter().map(|word| quoted(word)).collect();
    words.join(" ")
}

/// `word` for YAML, whose double-quoted strings are those of JSON.
fn yaml(word: &str) -> String {
    serde_json::Value::from(word).to_string()
}

fn commands(job: &Job) -> String {
    let threads = job.threads.to_string();
    let shards = 0..job.shards;
    let line =
        |shard| line(&job.words(&job.manifest, &format!("{shard}/{}", job.shards), &threads));
    shards.map(|shard| line(shard) + "\n").collect()
}

fn slurm(job: &Job) -> String {
    // Slurm's own word on the threads, so that a change on the command line of sbatch is followed.
    let threads = "\"${SLURM_CPUS_PER_TASK:-1}\"";
    let words = job.words(&job.manifest, "auto", threads);
    let words = words.iter().map(|word| match word == threads {
        true => word.clone(),
        false => quoted(word),
    });
    let command = words.collect::<Vec<_>>().join(" ");
    format!(
        r#"#!/bin/bash
#SBATCH --job-name=strandlight-bake
#SBATCH --array=0-{last}
#SBATCH --cpus-per-task={threads}
#SBATCH --requeue
#SBATCH --signal=B:TERM@60
#SBATCH --open-mode=append
#SBATCH --output=strandlight-bake-%A_%a.log
# Each task makes its share; what is up to date is skipped, so a task may run again at any time.
cd {folder} || exit 2
{command} &
child=$!
# Signals reach the program, which leaves whole files only. They end a wait, so there may be several.
trap 'kill -TERM "$child" 2>/dev/null' TERM INT
wait "$child"
code=$?
while kill -0 "$child" 2>/dev/null; do
    wait "$child"
    code=$?
done
# 75: a full disk or a lost server. 2: bad input, which no retry mends.
if [ "$code" -eq 75 ] && [ "${{SLURM_RESTART_COUNT:-0}}" -lt {RETRIES} ]; then
    scontrol requeue "$SLURM_JOB_ID"
fi
exit "$code"
"#,
        last = job.shards - 1,
        threads = job.threads,
        folder = quoted(&job.folder),
    )
}

fn open_jd(job: &Job) -> String {
    let mut words = job.words(
        "{{Param.Manifest}}",
        &format!("{{{{Task.Param.Shard}}}}/{}", job.shards),
        "{{Param.Threads}}",
    );
    words.splice(2..2, ["--progress", "openjd"].map(str::to_owned));
    let args = words[1..].iter();
    let args: String = args
        .map(|word| format!("            - {}\n", yaml(word)))
        .collect();
    format!(
        "specificationVersion: jobtemplate-2023-09
name: strandlight-bake
parameterDefinitions:
  - name: Manifest
    type: PATH
    objectType: FILE
    dataFlow: IN
    default: {manifest}
  - name: Threads
    type: INT
    minValue: 1
    default: {threads}
steps:
  - name: Bake
    parameterSpace:
      taskParameterDefinitions:
        - name: Shard
          type: INT
          range: \"0-{last}\"
    hostRequirements:
      amounts:
        - name: amount.worker.vcpu
          min: {threads}
    script:
      actions:
        onRun:
          command: {program}
          args:
{args}",
        manifest = yaml(&job.manifest),
        last = job.shards - 1,
        threads = job.threads,
        program = yaml(&job.program),
    )
}

fn kubernetes(job: &Job) -> String {
    let shard = format!("auto/{}", job.shards);
    let words = job.words(&job.manifest, &shard, &job.threads.to_string());
    let words = words.iter();
    let words: String = words
        .map(|word| format!("            - {}\n", yaml(word)))
        .collect();
    format!(
        "apiVersion: batch/v1
kind: Job
metadata:
  name: strandlight-bake
spec:
  completionMode: Indexed
  completions: {shards}
  parallelism: {shards}
  backoffLimitPerIndex: {RETRIES}
  podFailurePolicy:
    rules:
      # Evicted or preempted: no failure of the shard.
      - action: Ignore
        onPodConditions:
          - type: DisruptionTarget
            status: \"True\"
      # Bad input: the same on every machine.
      - action: FailIndex
        onExitCodes:
          containerName: bake
          operator: In
          values: [2]
  template:
    spec:
      restartPolicy: Never
      containers:
        - name: bake
          image: {image}
          workingDir: {folder}
          command:
{words}          resources:
            requests:
              cpu: \"{threads}\"
          volumeMounts:
            - name: assets
              mountPath: {folder}
      volumes:
        - name: assets
          persistentVolumeClaim:
            claimName: {claim}
",
        shards = job.shards,
        threads = job.threads,
        image = yaml(&job.image),
        folder = yaml(&job.folder),
        claim = yaml(&job.claim),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job() -> Job {
        Job {
            program: "strandlight".to_owned(),
            manifest: "it's here/bake.toml".to_owned(),
            folder: "/work/a b".to_owned(),
            shards: 7,
            threads: 4,
            options: vec!["--cache".to_owned(), "$HOME".to_owned()],
            image: "strandlight:1".to_owned(),
            claim: "assets".to_owned(),
        }
    }

    #[test]
    fn words_are_quoted() {
        let text = farm_job(Farm::Commands, &job());
        assert_eq!(text.lines().count(), 7);
        let first = text.lines().next();
        let expected = r"strandlight bake --shard 0/7 --keep-going --threads 4 --cache '$HOME' -- 'it'\''s here/bake.toml'";
        assert_eq!(first, Some(expected));
        let text = farm_job(Farm::Slurm, &job());
        assert!(text.contains("--array=0-6\n"), "{text}");
        assert!(text.contains("\ncd '/work/a b' || exit 2\n"), "{text}");
        assert!(
            text.contains("--shard auto --keep-going --threads \"${SLURM_CPUS"),
            "{text}"
        );
    }

    #[test]
    fn no_word_of_a_command_is_taken_for_the_threads() {
        let job = Job {
            program: "/opt/THREADS x/strandlight".to_owned(),
            ..job()
        };
        let text = farm_job(Farm::Slurm, &job);
        let command = "\n'/opt/THREADS x/strandlight' bake --shard auto --keep-going \
                       --threads \"${SLURM_CPUS_PER_TASK:-1}\" --cache '$HOME' -- ";
        assert!(text.contains(command), "{text}");
    }

    #[test]
    fn templates_name_the_shards() {
        let text = farm_job(Farm::OpenJd, &job());
        for needle in [
            "range: \"0-6\"",
            "- \"{{Task.Param.Shard}}/7\"",
            "default: \"it's here/bake.toml\"",
        ] {
            assert!(text.contains(needle), "{needle}: {text}");
        }
        let text = farm_job(Farm::Kubernetes, &job());
        for needle in [
            "completions: 7",
            "- \"auto/7\"",
            "values: [2]",
            "workingDir: \"/work/a b\"",
        ] {
            assert!(text.contains(needle), "{needle}: {text}");
        }
    }
}
