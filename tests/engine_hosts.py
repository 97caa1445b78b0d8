"""Hosts for tests of batch engines: on one machine, each with its own name and process ids, in a network of their own.

A host is a process that is the first of its own name space. Where name spaces are not permitted, hosts are processes
that adopt all that they start, ports are in the open on loopback addresses, and the ledger knows them by process ids.
"""

import atexit
import ctypes
import fcntl
import os
import signal
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

PRIVATE = ["unshare", "--net", "--uts", "--pid", "--fork", "--mount-proc", "--kill-child"]
INSIDE = "TRIMRAY_TEST_NAME_SPACE"  # in the environment of what runs there
isolated = INSIDE in os.environ


def enter_private_network():
    """Runs this program anew in name spaces of its own, all of whose processes end with it; or goes on without them."""
    if not isolated and subprocess.run([*PRIVATE, "true"], capture_output=True, check=False).returncode == 0:
        os.execvpe(PRIVATE[0], [*PRIVATE, sys.executable, *sys.argv], {**os.environ, INSIDE: "1"})
    if not isolated:
        print("no name spaces here: loopback addresses in the open", flush=True)
        adopt_orphans()
        atexit.register(end_orphans)
        return
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        siocsifflags, siocsifaddr, iff_up = 0x8914, 0x8916, 1
        fcntl.ioctl(control, siocsifflags, struct.pack("16sh14x", b"lo", iff_up))  # ip link set lo up
        # ip address add 192.0.2.1 dev lo: where all addresses are 127.*, getaddrinfo() gives Slurm none
        fcntl.ioctl(control, siocsifaddr, struct.pack("16sHxx4s8x", b"lo:1", socket.AF_INET, bytes([192, 0, 2, 1])))
    subprocess.run(["mount", "-t", "tmpfs", "tmpfs", "/run"], check=True)  # seen by these processes alone


def adopt_orphans():
    pr_set_child_subreaper = 36
    ctypes.CDLL(None).prctl(pr_set_child_subreaper, 1, 0, 0, 0)


def end_orphans():
    """Ends what the daemons have left, as the end of a name space does."""
    while started := processes_of(os.getpid()):
        for pid in started:
            os.kill(pid, signal.SIGKILL)
    try:
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    except ChildProcessError:
        pass


def free_port():
    with socket.socket() as probe:
        probe.bind(("", 0))
        return probe.getsockname()[1]


def wait_for(condition, what, seconds=60):
    """What `condition` gives as soon as that is true."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if value := condition():
            return value
        time.sleep(0.05)
    raise TimeoutError(f"{what} within {seconds} s")


def living_children():
    """Process ids by that of their parent; what has ended and only waits to be noticed is left out."""
    children = {}
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            state, parent = (entry / "stat").read_text().rsplit(")", 1)[1].split()[:2]
        except OSError:  # gone by now
            continue
        if state != "Z":
            children.setdefault(int(parent), []).append(int(entry.name))
    return children


def processes_of(pid):
    """All that `pid` has started, and what that has, and so on."""
    children, found = living_children(), []
    waiting = [pid]
    while waiting:
        started = children.get(waiting.pop(), [])
        found += started
        waiting += started
    return found


def pid_seen_inside(pid):
    """Its id in its own name space."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return None
    return int(next(line for line in status.splitlines() if line.startswith("NSpid:")).split()[-1])


class Host:
    """A host whose only task is `command`, which stays in the foreground; what it says goes to the file `log`."""

    def __init__(self, name, command, log, env=None):
        self.name, self.log = name, log
        if isolated:
            command = ["unshare", "--uts", "--pid", "--fork", "--mount-proc", "--kill-child",
                       "sh", "-c", 'hostname "$0"; exec "$@"', name, *command]
        else:
            command = [sys.executable, __file__, *command]
        with open(log, "ab") as output:
            self.process = subprocess.Popen(list(map(str, command)), stdin=subprocess.DEVNULL, stdout=output,
                                            stderr=output, env=env)

    def pid_of(self, run):
        """The process that wrote the ledger's event `run`, if it is at work on this host."""
        if isolated and run["host"] != self.name:
            return None
        return next((pid for pid in processes_of(self.process.pid) if pid_seen_inside(pid) == run["pid"]), None)

    def end_task(self):
        """Asks the host's first process to end, as kubelet does. What it ends with."""
        os.kill(processes_of(self.process.pid)[0], signal.SIGTERM)
        return self.process.wait(timeout=60)

    def cut_power(self):
        """Ends all that runs on the host, without a word to anyone."""
        while started := processes_of(self.process.pid):
            for pid in started:
                try:
                    os.kill(pid, signal.SIGKILL)
                except ProcessLookupError:
                    pass
        self.process.kill()
        self.process.wait()


if __name__ == "__main__":  # the first process of a host without name spaces
    adopt_orphans()
    task = subprocess.Popen(sys.argv[1:])
    status = task.wait()
    while living_children().get(os.getpid()):
        time.sleep(0.1)
    sys.exit(status if status >= 0 else 128 - status)
