"""A Slurm of one node, for the time of a test; needs root, slurmctld, slurmd and munge."""

import os
import shutil
import signal
import socket
import subprocess
import time

CONFIGURATION = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
KillWait=5
JobRequeue=1
SchedulerParameters=sched_interval=1,requeue_delay=1
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory=2000 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def free_ports(count):
    """Ports that nobody listens to."""
    sockets = [socket.socket() for _ in range(count)]
    for each in sockets:
        each.bind(("127.0.0.1", 0))
    ports = [each.getsockname()[1] for each in sockets]
    for each in sockets:
        each.close()
    return ports


class Slurm:
    """`with Slurm(folder) as slurm:` starts the daemons and ends them."""

    def __init__(self, folder):
        # A path of a socket has at most 107 bytes.
        self.folder = folder
        self.host = socket.gethostname().split(".")[0]
        self.env = {**os.environ, "SLURM_CONF": f"{folder}/slurm.conf"}

    def __enter__(self):
        shutil.rmtree(self.folder, ignore_errors=True)
        for name in ("state", "spool", "munge"):
            os.makedirs(f"{self.folder}/{name}", mode=0o700)
        os.chmod(self.folder, 0o755)
        os.chmod(f"{self.folder}/munge", 0o755)
        with open(f"{self.folder}/munge/key", "wb") as file:
            file.write(os.urandom(1024))
        os.chmod(f"{self.folder}/munge/key", 0o600)
        with open(f"{self.folder}/slurm.conf", "w") as file:
            # Two tasks at a time on any machine.
            cpus = max(2, os.cpu_count())
            file.write(CONFIGURATION.format(host=self.host, folder=self.folder, cpus=cpus, ports=free_ports(2)))
        munge = f"{self.folder}/munge"
        self.run(
            "munged", "--force", f"--key-file={munge}/key", f"--socket={munge}/socket",
            f"--pid-file={munge}/pid", f"--log-file={munge}/log", f"--seed-file={munge}/seed",
        )
        self.run("slurmctld")
        self.run("slurmd", "-N", self.host)
        self.wait_until(self.is_idle, "the node is idle")
        return self

    def __exit__(self, *_):
        for name in ("slurmd.pid", "slurmctld.pid", "munge/pid"):
            try:
                with open(f"{self.folder}/{name}") as file:
                    os.kill(int(file.read()), signal.SIGTERM)
            except (OSError, ValueError):
                pass

    def is_idle(self):
        """Is the node ready? Not while the daemons still start."""
        try:
            return "idle" in self.run("sinfo", "-h", "-o", "%t")
        except RuntimeError:
            return False

    def run(self, *words):
        """Runs a command of Slurm and gives what it prints."""
        done = subprocess.run(words, env=self.env, capture_output=True, text=True, timeout=60)
        if done.returncode != 0:
            raise RuntimeError(f"{' '.join(words)}: {done.stderr.strip()}")
        return done.stdout

    def states(self, job):
        """The state of each task of an array by its index: PENDING, RUNNING, COMPLETED, FAILED, ..."""
        states = {}
        for line in self.run("scontrol", "show", "job", "-o", str(job)).splitlines():
            fields = dict(word.split("=", 1) for word in line.split() if "=" in word)
            first, _, last = fields.get("ArrayTaskId", "0").split("%")[0].partition("-")
            for task in range(int(first), int(last or first) + 1):
                states[task] = fields["JobState"]
        return states

    @staticmethod
    def wait_until(condition, what, seconds=300):
        """Waits until a condition holds."""
        end = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > end:
                raise RuntimeError(f"not within {seconds} s: {what}")
            time.sleep(0.2)
