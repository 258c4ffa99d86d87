"""Slurm with one node on this machine's loopback, for as long as a test needs it."""

import contextlib
import os
import secrets
import socket
import subprocess
import tempfile
import time
from pathlib import Path

CONFIGURATION = """
ClusterName=loopback
SlurmctldHost={host}(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SlurmUser=root
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES State=UP
"""


class NoDaemon(Exception):
    """A machine on which Slurm's daemons do not start, such as a container without its system calls."""


def free_ports(count):
    """Ports of the loopback that nothing listens on."""
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


def wait_for(is_there, what):
    """Polls for a minute."""
    end = time.monotonic() + 60
    while not is_there():
        if time.monotonic() > end:
            raise NoDaemon(f"{what} did not start within a minute")
        time.sleep(0.1)


@contextlib.contextmanager
def cluster():
    """The folder of the cluster's files, and the environment in which Slurm's commands find it. Raises NoDaemon."""
    if os.geteuid() != 0:
        raise NoDaemon("Slurm's daemons need root")
    # A short path: a socket's name has a hundred characters at most.
    with tempfile.TemporaryDirectory(prefix="sensel-slurm-") as path, contextlib.ExitStack() as started:
        folder = Path(path).resolve()
        yield folder, start(folder, started)


def start(folder, started):
    """The environment of Slurm's commands, once the node is idle; the daemons end with the stack."""
    for name in ("state", "spool"):
        (folder / name).mkdir(parents=True)
    folder.chmod(0o755)  # munge refuses a socket in a folder that others cannot enter.
    (folder / "munge.key").write_bytes(secrets.token_bytes(1024))
    (folder / "munge.key").chmod(0o400)
    host = socket.gethostname().split(".")[0]
    configuration = folder / "slurm.conf"
    configuration.write_text(CONFIGURATION.format(folder=folder, host=host, ports=free_ports(2)), encoding="utf-8")
    environment = {**os.environ, "SLURM_CONF": str(configuration)}
    munge = [f"--{what}={folder}/munge.{end}" for what, end in
             [("key-file", "key"), ("socket", "socket"), ("pid-file", "pid"), ("log-file", "log"), ("seed-file", "seed")]]

    def daemon(*command):
        log = started.enter_context(open(folder / f"{command[0]}.out", "wb"))
        process = subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        started.callback(process.wait, timeout=30)
        started.callback(process.terminate)

    daemon("munged", "--force", "--foreground", *munge)
    wait_for(lambda: (folder / "munge.socket").exists(), "munged")
    daemon("slurmctld", "-D", "-f", str(configuration))
    daemon("slurmd", "-D", "-f", str(configuration))
    idle = ["sinfo", "--noheader", "--format=%T"]
    wait_for(lambda: b"idle" in subprocess.run(idle, env=environment, capture_output=True, check=False).stdout, "the node")
    return environment
