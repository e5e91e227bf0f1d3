"""`strandlight bake` on real schedulers: all give the bytes of one run.

python farm_check.py STRANDLIGHT TMPDIR

Shards by hand, xargs, Ninja, Snakemake, openjd-cli, a Kubernetes job against the schema, and a Slurm of one node
with a task that is killed and requeued and the node drained in the middle. Exit code 1, with a line for
each, if one is off.
"""

import glob
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import maps
from slurm import Slurm

BINARY, TMP = (os.path.abspath(path) for path in sys.argv[1:3])
N_MAPS = 24
FAILURES = []
MANIFEST = """version = 1
[[lights]]
map = "maps/*.hdr"
out = "out/{stem}.lights"
preview = "out/{stem}.png"
count = 24
"""


def check(holds, what):
    print(("ok    " if holds else "FAILED ") + what, flush=True)
    if not holds:
        FAILURES.append(what)


def run(*words, cwd, **more):
    done = subprocess.run(words, cwd=cwd, capture_output=True, text=True, timeout=600, **more)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(words)}: exit code {done.returncode}: {done.stderr.strip()[-800:]}")
    return done.stdout


def project(name):
    """A folder with the manifest and the maps."""
    folder = os.path.join(TMP, name)
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    os.symlink(os.path.join(TMP, "maps"), os.path.join(folder, "maps"))
    with open(os.path.join(folder, "bake.toml"), "w") as file:
        file.write(MANIFEST)
    return folder


def outputs(folder):
    """Hash of each output by its name."""
    files = sorted(glob.glob(os.path.join(folder, "out", "*")))
    return {os.path.basename(path): hashlib.sha256(open(path, "rb").read()).hexdigest() for path in files}


def plan(folder, *options):
    return run(BINARY, "bake", "plan", "bake.toml", "--program", BINARY, "--threads-per-task", "1", *options, cwd=folder)


def shards(whole):
    for count in (1, 3, 7):
        folder = project(f"shards{count}")
        for shard in range(count):
            run(BINARY, "bake", "bake.toml", "--shard", f"{shard}/{count}", "--quiet", cwd=folder)
        check(outputs(folder) == whole, f"{count} shards give the bytes of one run")


def commands(whole):
    folder = project("commands")
    lines = plan(folder, "--commands", "--shards", "5")
    run("xargs", "-P2", "-I{}", "sh", "-c", "{}", cwd=folder, input=lines)
    check(outputs(folder) == whole, "5 commands by xargs, two at a time, give the bytes of one run")


def ninja(whole):
    folder = project("ninja")
    with open(os.path.join(folder, "build.ninja"), "w") as file:
        file.write(
            f"rule bake\n  command = {BINARY} bake bake.toml --quiet --depfile bake.d --depfile-target bake.stamp"
            " && touch bake.stamp\n  depfile = bake.d\n  deps = gcc\nbuild bake.stamp: bake bake.toml\n"
        )
    run("ninja", cwd=folder)
    check(outputs(folder) == whole, "Ninja gives the bytes of one run")
    check("no work to do" in run("ninja", cwd=folder), "Ninja has nothing to do the second time")
    # A changed map, not a link to the others' one.
    os.remove(os.path.join(folder, "maps"))
    shutil.copytree(os.path.join(TMP, "maps"), os.path.join(folder, "maps"))
    run("ninja", cwd=folder)
    time.sleep(1.1)
    maps.write(os.path.join(folder, "maps", "map0003.hdr"), 999)
    run("ninja", cwd=folder)
    changed = [name for name, digest in outputs(folder).items() if whole[name] != digest]
    check(changed == ["map0003.lights", "map0003.png"], f"Ninja makes what depends on a changed map: {changed}")


def snakemake(whole):
    folder = project("snakemake")
    examples = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../examples/farm")
    shutil.copy(os.path.join(examples, "Snakefile"), folder)
    shutil.copy(os.path.join(examples, "bake.yaml"), folder)
    tool = os.path.join(os.path.dirname(sys.executable), "snakemake")
    command = (tool, "--cores", "2", "--config", f"program={BINARY}", "maps=maps/*.hdr")
    run(*command, cwd=folder)
    check(outputs(folder) == whole, "Snakemake with 3 shards gives the bytes of one run")
    report = json.load(open(os.path.join(folder, "report.json")))
    check(len(report["items"]) == N_MAPS, "Snakemake puts the report together")
    again = subprocess.run((*command, "--dry-run"), cwd=folder, capture_output=True, text=True)
    check("Nothing to be done" in again.stdout + again.stderr, "Snakemake has nothing to do the second time")


def openjd(whole):
    folder = project("openjd")
    template = os.path.join(folder, "job.yaml")
    plan(folder, "--openjd", "--shards", "3", "-o", template)
    tool = os.path.join(os.path.dirname(sys.executable), "openjd")
    run(tool, "check", template, cwd=folder)
    manifest = os.path.join(folder, "bake.toml")
    said = run(tool, "run", template, "--step", "Bake", "-p", f"Manifest={manifest}", cwd=folder)
    percents = re.findall(r"openjd_progress: ([0-9.]+)", said)
    check(percents.count("100.0") == 3, f"openjd-cli is told the progress of 3 tasks: {len(percents)} lines")
    check(outputs(folder) == whole, "openjd-cli runs the template and gives the bytes of one run")


def kubernetes():
    folder = project("kubernetes")
    job = os.path.join(folder, "job.yaml")
    plan(folder, "--k8s", "--shards", "3", "-o", job)
    tool = os.path.join(os.path.dirname(sys.executable), "kubernetes-validate")
    run(tool, "--strict", job, cwd=folder)
    check(True, "the Kubernetes job is valid against the schema")
    with open(job) as file:
        text = file.read()
    with open(job, "w") as file:
        file.write(text.replace("completionMode", "completionMoode"))
    refused = subprocess.run([tool, "--strict", job], capture_output=True).returncode != 0
    check(refused, "the schema refuses a misspelt field of it")


def slurm(whole):
    # Paths of sockets are short.
    with tempfile.TemporaryDirectory(prefix="slurm", ignore_cleanup_errors=True) as short, Slurm(short + "/s") as cluster:
        folder = project("slurm")
        plan(folder, "--slurm", "--shards", "3", "-o", os.path.join(folder, "job.sbatch"))
        submit = ["sbatch", "--parsable", f"--chdir={folder}", os.path.join(folder, "job.sbatch")]
        done = {task: "COMPLETED" for task in range(3)}

        job = cluster.run(*submit).strip()
        cluster.wait_until(lambda: cluster.states(job) == done, "an array of 3 completes")
        check(outputs(folder) == whole, "Slurm: an array of 3 gives the bytes of one run")

        shutil.rmtree(os.path.join(folder, "out"))
        job = cluster.run(*submit).strip()
        cluster.wait_until(lambda: len(glob.glob(f"{folder}/out/*.lights")) >= 2, "the first sets are there")
        before = len(outputs(folder))
        cluster.run("scontrol", "requeue", f"{job}_0")
        host = cluster.host
        cluster.run("scontrol", "update", f"nodename={host}", "state=drain", "reason=test")
        idle = lambda: "RUNNING" not in cluster.states(job).values()
        cluster.wait_until(idle, "running tasks end on a drained node")
        left = sorted(set(cluster.states(job).values()) - {"COMPLETED"})
        drained = len(outputs(folder))
        check(drained < len(whole) and left == ["PENDING"], f"Slurm: drained with {drained} of {len(whole)} files, {left}")
        check(outputs(folder).items() <= whole.items(), "Slurm: what is there after the kill is whole")
        check(not leftovers(folder), "Slurm: nothing half-written is left")
        cluster.run("scontrol", "update", f"nodename={host}", "state=resume")
        cluster.wait_until(lambda: cluster.states(job) == done, "the array completes after all")
        check(outputs(folder) == whole, f"Slurm: killed with {before} files, requeued, drained, resumed: the bytes of one run")


def leftovers(folder):
    """Names in the output folder that are neither outputs nor kept hashes."""
    names = os.listdir(os.path.join(folder, "out"))
    return [name for name in names if not name.startswith("map") and name != ".strandlight-bake"]


def main():
    os.makedirs(TMP, exist_ok=True)
    maps.make(os.path.join(TMP, "maps"), N_MAPS)
    folder = project("whole")
    run(BINARY, "bake", "bake.toml", "--quiet", cwd=folder)
    whole = outputs(folder)
    check(len(whole) == 2 * N_MAPS, f"one run makes {len(whole)} files")
    again = json.loads(run(BINARY, "bake", "bake.toml", "--json", cwd=folder))
    check(again["made"] == 0, f"a second run makes nothing: {again}")
    steps = (shards, commands, ninja, snakemake, openjd, slurm)
    for step in steps:
        try:
            step(whole)
        except (RuntimeError, OSError, subprocess.TimeoutExpired) as error:
            check(False, f"{step.__name__}: {error}")
    try:
        kubernetes()
    except (RuntimeError, OSError) as error:
        check(False, f"kubernetes: {error}")
    print(f"{len(FAILURES)} failures")
    sys.exit(1 if FAILURES else 0)


main()
