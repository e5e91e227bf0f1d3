"""Bakes that are ended at random moments, by SIGTERM, by SIGKILL and by a full disk, and resumed.

python interrupted.py STRANDLIGHT TMPDIR [--maps 200] [--moments 20] [--count 2] [--cache]

Each time: nothing that lies there under an output's name differs from the whole run's, and the next run
ends with the same bytes and leaves nothing else. Full disks are small ones in memory (tmpfs), so it needs
root. With --cache what is made again comes from a cache: maps are not fitted again, so that many runs take
little time. Exit code 1, with a line for each, if one is off.
"""

import argparse
import collections
import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import maps

MANIFEST = """version = 1
[[lights]]
map = "{folder}/maps/*.hdr"
out = "{out}/{{stem}}.lights"
preview = "{out}/{{stem}}.png"
count = {count}
"""


def files(folder):
    """Hash of each file below `folder` by its name."""
    found = {}
    for at, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(at, name)
            with open(path, "rb") as file:
                found[os.path.relpath(path, folder)] = hashlib.sha256(file.read()).hexdigest()
    return found


def size(folder):
    return sum(os.path.getsize(os.path.join(at, name)) for at, _, names in os.walk(folder) for name in names)


class Interrupted:
    def __init__(self, args):
        self.binary = os.path.abspath(args.strandlight)
        self.folder = os.path.abspath(args.folder)
        self.count = args.count
        self.cache = ["--cache", os.path.join(self.folder, "cache")] if args.cache else []
        self.failures = []
        self.ends = collections.Counter()

    def command(self, out):
        manifest = os.path.join(self.folder, "bake.toml")
        with open(manifest, "w") as file:
            file.write(MANIFEST.format(folder=self.folder, out=out, count=self.count))
        return [self.binary, "bake", manifest, "--quiet", "--jobs", "2", "--threads", "1", *self.cache]

    def check(self, holds, what):
        if not holds:
            print("FAILED " + what, flush=True)
            self.failures.append(what)

    def look(self, out, whole, what, temporary):
        """After an end: whole files, and temporary ones only where nothing could remove them."""
        left = files(out)
        for name, digest in left.items():
            if name.endswith(".failed.json"):
                # What `bake status` tells of it; gone with the next run.
                with open(os.path.join(out, name)) as file:
                    json.load(file)
            elif name.endswith(".tmp"):
                self.check(temporary, f"{what}: {name} is left")
            else:
                self.check(whole.get(name) == digest, f"{what}: {name} is not whole")
        return len(left)

    def resume(self, out, whole, what):
        done = subprocess.run(self.command(out), capture_output=True, text=True)
        self.check(done.returncode == 0, f"{what}: resumed: {done.stderr.strip()}")
        self.check(files(out) == whole, f"{what}: resumed to other files")

    def kill(self, which, after, whole):
        out = os.path.join(self.folder, "out")
        shutil.rmtree(out, ignore_errors=True)
        child = subprocess.Popen(self.command(out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(after)
        child.send_signal(which)
        code = child.wait()
        what = f"{which.name} after {after:.2f} s"
        # 143 by the program's own handler, -15 before that is there.
        expected = {signal.SIGTERM: (143, -15, 0), signal.SIGKILL: (-9, 0)}[which]
        self.check(code in expected, f"{what}: exit code {code}")
        left = self.look(out, whole, what, which == signal.SIGKILL)
        self.resume(out, whole, what)
        return code != 0, left

    def fill(self, n_bytes, whole):
        out = os.path.join(self.folder, "disk")
        os.makedirs(out, exist_ok=True)
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={n_bytes}", "tmpfs", out], check=True)
        try:
            code = subprocess.run(self.command(out), capture_output=True).returncode
            what = f"a disk of {n_bytes} bytes"
            self.check(code == 75, f"{what}: exit code {code}")
            left = self.look(out, whole, what, False)
            subprocess.run(["mount", "-o", "remount,size=1g", out], check=True)
            self.resume(out, whole, what)
        finally:
            subprocess.run(["umount", out], check=True)
        return code != 0, left


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("strandlight")
    parser.add_argument("folder")
    parser.add_argument("--maps", type=int, default=200)
    parser.add_argument("--moments", type=int, default=20, help="of each kind")
    parser.add_argument("--count", type=int, default=2, help="lights of a set")
    parser.add_argument("--cache", action="store_true")
    args = parser.parse_args()
    os.makedirs(args.folder, exist_ok=True)
    maps.make(os.path.join(args.folder, "maps"), args.maps, width=64, height=32)
    test = Interrupted(args)
    out = os.path.join(test.folder, "out")
    shutil.rmtree(out, ignore_errors=True)
    start = time.monotonic()
    subprocess.run(test.command(out), check=True, stdout=subprocess.DEVNULL)
    seconds = time.monotonic() - start
    whole, n_bytes = files(out), size(out)
    start = time.monotonic()
    subprocess.run(test.command(out), check=True, stdout=subprocess.DEVNULL)
    again = time.monotonic() - start
    test.check(files(out) == whole, "a second run changes files")
    if args.cache:
        # As long as the runs that are to be ended.
        shutil.rmtree(out)
        start = time.monotonic()
        subprocess.run(test.command(out), check=True, stdout=subprocess.DEVNULL)
        seconds = time.monotonic() - start
        made, whole = whole, files(out)
        outputs = lambda found: {name: digest for name, digest in found.items() if not name.startswith(".")}
        test.check(outputs(made) == outputs(whole), "the cache has other outputs")
    print(f"{args.maps} maps: {seconds:.1f} s, {len(whole)} files, {n_bytes} bytes; the second run {again:.2f} s")
    rng = random.Random(1)
    kinds = {
        "SIGTERM": lambda: test.kill(signal.SIGTERM, rng.uniform(0, seconds), whole),
        "SIGKILL": lambda: test.kill(signal.SIGKILL, rng.uniform(0, seconds), whole),
        # A file takes whole pages of such a disk, so its contents fill more than they are long.
        "full disk": lambda: test.fill(4096 * rng.randint(2, int(0.9 * n_bytes / 4096)), whole),
    }
    for name, end in kinds.items():
        ends = [end() for _ in range(args.moments)]
        partial = sum(0 < left < len(whole) for _, left in ends)
        print(f"{name}: {sum(ended for ended, _ in ends)} of {args.moments} runs were ended, {partial} with some files made")
        test.check(partial > 0, f"{name}: no run was ended on its way")
    print(f"{len(test.failures)} failures")
    sys.exit(1 if test.failures else 0)


main()
