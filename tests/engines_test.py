#!/usr/bin/env python3
"""The scripts of examples/batch, run by their engines on two hosts of this one machine, one of which is lost on the way:
in the end every file is in the ledger, every pack is valid, and none was made twice.

    engines_test.py --bin FOLDER [unittest's own arguments]

FOLDER holds trimray, trimray-batch and trimray-pack. Where an engine is not installed (engines.txt) the test is skipped, and says so
(exit code 77).
"""

import argparse
import collections
import csv
import json
import os
import pwd
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from engine_hosts import Host, enter_private_network, free_port, isolated, wait_for

try:
    import yaml
except ImportError:
    yaml = None

TESTS = Path(__file__).resolve().parent
EXAMPLES = TESTS.parent / "examples" / "batch"
MODELS = ["unit_sphere.stp", "revolved_sphere.step", "red_cube_blue_cylinder.step", "mayo_332_file.stp",
          "sg1-c5-214.stp", "nozzle.stp", "nozzle.igs", "abc_00000050.step", "io1-cm-214.stp"]
SHARDS = 4
QUICK = ["--no-previews", "--threads", "1"]
NEEDED = ["parallel", "ssh", "ssh-keygen", "/usr/sbin/sshd", "/usr/sbin/slurmctld", "/usr/sbin/slurmd", "sbatch",
          "/usr/sbin/munged"]


def events(out, kind):
    """The ledger's events of one kind; a line that is being written is not yet one."""
    texts = [ledger.read_text(encoding="utf-8") for ledger in sorted((out / "ledger").glob("*.jsonl"))]
    lines = [line for text in texts for line in text[:text.rfind("\n") + 1].splitlines()]
    return [event for event in map(json.loads, lines) if event["event"] == kind]


def write_models(folder, copies):
    """Copies of models, each of its own content save the first two, and a file that is no model."""
    folder.mkdir()
    for name in MODELS:
        text = (TESTS / "models" / name).read_text(encoding="latin-1")
        for i in range(copies):
            (folder / f"{i}_{name}").write_text(text + (f"/* copy {i} */\n" if i > 1 else ""), encoding="latin-1")
    (folder / "broken.step").write_text("no model", encoding="ascii")


class Engine(unittest.TestCase):
    copies = 10  # of each model: a shard takes seconds, so that a host is lost in its midst

    def setUp(self):
        holder = tempfile.TemporaryDirectory(prefix="trimray-")
        self.addCleanup(holder.cleanup)
        self.folder = Path(holder.name)
        self.models, self.out = self.folder / "models", self.folder / "packs"
        write_models(self.models, self.copies)

    def host(self, name, command, env=None):
        host = Host(name, command, self.folder / f"{name}.log", env)
        self.addCleanup(host.cut_power)
        return host

    def run_on(self, host):
        """A run on `host` that has ended a file, with most of its shard before it; and its process."""
        ends = collections.Counter(end["run"] for end in events(self.out, "end"))
        return next(((run, pid) for run in events(self.out, "run") if 0 < ends[run["run"]] < run["files"] / 2
                     and (pid := host.pid_of(run))), None)

    def lose(self, host):
        """Cuts the host's power while its shard is at work. The run that it ends."""
        run, _ = wait_for(lambda: self.run_on(host), f"a file has ended on {host.name}")
        host.cut_power()
        self.assertNotIn(run["run"], [stop["run"] for stop in events(self.out, "stop")], "lost too late")
        return run

    def check(self, interrupted):
        """Every file has ended, every pack is valid and was made once, and each shard was run once, with once more for
        each of the runs that were interrupted."""
        files = sorted(path.name for path in self.models.iterdir())
        final = {Path(end["file"]).name: end for end in events(self.out, "end") if end["final"]}
        self.assertEqual(sorted(final), files)
        classes = {name: end["class"] for name, end in final.items()}
        self.assertEqual(classes, {name: "invalid" if name == "broken.step" else "done" for name in files})

        contents = len({path.read_bytes() for path in self.models.iterdir()}) - 1  # the broken one has no pack
        packs = sorted((self.out / "store").rglob("*.tray"))
        self.assertEqual(len(packs), contents)
        made = [end["key"] for end in events(self.out, "end") if end["class"] == "done" and not end["found"]]
        self.assertEqual(len(made), len(set(made)), "a pack was made twice")
        for pack in packs:
            subprocess.run([OPTIONS.bin / "trimray", "validate", pack], check=True, capture_output=True)
        links = [link for link in (self.out / "packs").rglob("*.tray") if link.exists()]
        self.assertEqual(len(links), len(files) - 1)
        self.assertEqual([path for kind in ("tmp", "claims") for path in (self.out / kind).iterdir()], [])

        shards = [run["shard"] for run in events(self.out, "run")]
        again = [run["shard"] for run in interrupted]
        self.assertEqual(sorted(shards), sorted(again + [f"{i}/{SHARDS}" for i in range(SHARDS)]))
        for run in interrupted:
            last = [each for each in events(self.out, "run") if each["shard"] == run["shard"]][-1]
            self.assertGreater(last["skipped"], 0, "what had ended was taken up again")
        hosts = {run["host"] for run in events(self.out, "run")}
        self.assertEqual(len(hosts), 2 if isolated else 1)


class GnuParallel(Engine):
    def sshd(self, name, address):
        """A host that ssh knows by its name."""
        port = free_port()
        (self.folder / f"{name}.sshd").write_text(
            f"Port {port}\nListenAddress {address}\nHostKey {self.folder}/key\nAuthorizedKeysFile {self.folder}/key.pub\n"
            "PidFile none\nUsePAM no\nStrictModes no\nPasswordAuthentication no\n", encoding="ascii")
        with open(self.folder / "ssh", "a", encoding="ascii") as config:
            config.write(f"Host {name}\n  HostName {address}\n  Port {port}\n  IdentityFile {self.folder}/key\n"
                         f"  IdentitiesOnly yes\n  StrictHostKeyChecking no\n  UserKnownHostsFile {self.folder}/known\n")
        return self.host(name, ["/usr/sbin/sshd", "-D", "-e", "-f", self.folder / f"{name}.sshd"])

    def test_a_lost_host_costs_nothing_but_its_time(self):
        subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", self.folder / "key"], check=True)
        if os.geteuid() == 0 and not Path("/run/sshd").exists():  # sshd asks for it
            Path("/run/sshd").mkdir(mode=0o755)
            self.addCleanup(Path("/run/sshd").rmdir)
        self.sshd("kept", "127.0.0.2")
        lost = self.sshd("lost", "127.0.0.3")
        for name in ("kept", "lost"):
            wait_for(lambda: "listening" in (self.folder / f"{name}.log").read_text(), f"sshd of {name}")
        (self.folder / "hosts").write_text("kept\nlost\n", encoding="ascii")

        env = {**os.environ, "PARALLEL_SSH": f"ssh -F {self.folder}/ssh", "PARALLEL_HOME": str(self.folder),
               "TRIMRAY": str(OPTIONS.bin / "trimray")}
        with open(self.folder / "parallel.log", "w+", encoding="utf-8") as log:
            command = [EXAMPLES / "parallel_ssh.sh", self.folder / "hosts", str(SHARDS), self.out, self.models, *QUICK]
            engine = subprocess.Popen([*command, "--jobs", "1"], env=env, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
            self.addCleanup(engine.wait)
            self.addCleanup(engine.kill)
            lost_run = self.lose(lost)
            status = engine.wait(timeout=120)
            log.seek(0)
            self.assertEqual(status, 0, log.read())

        with open(self.out / "parallel.joblog", encoding="utf-8") as joblog:
            jobs = list(csv.DictReader(joblog, delimiter="\t"))
        self.assertEqual([job["Exitval"] for job in jobs if job["Host"] == "kept"], SHARDS * ["0"])
        self.check([lost_run])


class Slurm(Engine):
    def start(self):
        """A controller and two nodes. The nodes by their names."""
        user = pwd.getpwuid(os.geteuid()).pw_name
        munge = self.folder / "munge"
        munge.mkdir(mode=0o711)
        (munge / "key").write_bytes(random.randbytes(128))
        (munge / "key").chmod(0o600)
        self.daemon("munged", ["/usr/sbin/munged", "--foreground", "--force", f"--key-file={munge}/key",
                               f"--socket={munge}/socket", f"--pid-file={munge}/pid", f"--log-file={munge}/log",
                               f"--seed-file={munge}/seed", "--num-threads=1"])
        wait_for((munge / "socket").exists, "munged's socket")
        ports = {name: free_port() for name in ("kept", "lost")}
        nodes = [f"NodeName={name} NodeHostname={name} NodeAddr=127.0.0.{2 + i} Port={port} CPUs=1 RealMemory=8000\n"
                 for i, (name, port) in enumerate(ports.items())]
        (self.folder / "slurm.conf").write_text(
            f"ClusterName=test\nSlurmctldHost=localhost(127.0.0.1)\nSlurmctldPort={free_port()}\nSlurmUser={user}\n"
            f"SlurmdUser={user}\nAuthType=auth/munge\nCredType=cred/munge\n"
            # cred_expire: a task that is queued again waits as long
            f"AuthInfo=socket={munge}/socket,cred_expire=5\n"
            "ProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nJobAcctGatherType=jobacct_gather/none\n"
            "SelectType=select/cons_tres\nSelectTypeParameters=CR_CPU\nMpiDefault=none\nSwitchType=switch/none\n"
            "SchedulerParameters=sched_interval=2\nSlurmdParameters=config_overrides\n"
            f"SlurmctldPidFile={self.folder}/ctld.pid\nSlurmdPidFile={self.folder}/%n.pid\n"
            f"StateSaveLocation={self.folder}/state\nSlurmdSpoolDir={self.folder}/spool-%n\n"
            + "".join(nodes) + "PartitionName=all Nodes=ALL Default=YES State=UP\n", encoding="ascii")
        # no plugin in use asks for cgroups, but slurmd looks for them, and a chroot has none; this one does not look
        (self.folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\n", encoding="ascii")
        self.env = {**os.environ, "SLURM_CONF": str(self.folder / "slurm.conf"), "TRIMRAY": str(OPTIONS.bin / "trimray")}
        self.daemon("slurmctld", ["/usr/sbin/slurmctld", "-D", "-i"])
        hosts = {name: self.host(name, ["/usr/sbin/slurmd", "-D", "-N", name], self.env) for name in ports}
        wait_for(lambda: self.says("sinfo", "-h", "-o", "%t %D") == "idle 2", "two idle nodes")
        return hosts

    def daemon(self, name, command):
        with open(self.folder / f"{name}.log", "wb") as log:
            process = subprocess.Popen(list(map(str, command)), stdout=log, stderr=log, env=getattr(self, "env", None))
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)

    def says(self, *command):
        done = subprocess.run(list(map(str, command)), env=self.env, capture_output=True, text=True, timeout=30, check=False)
        return done.stdout.strip()

    def test_a_lost_node_costs_nothing_but_its_time(self):
        (self.folder / "state").mkdir()
        hosts = self.start()
        job = self.says("sbatch", "--parsable", f"--array=0-{SHARDS - 1}", "--cpus-per-task=1", "--mem-per-cpu=2G",
                        f"--output={self.folder}/%a.task", EXAMPLES / "slurm_array.sh", self.out, self.models, *QUICK)
        self.assertTrue(job.isdigit(), (self.folder / "slurmctld.log").read_text())
        lost = self.lose(hosts["lost"])
        # as the controller itself does after SlurmdTimeout
        self.says("scontrol", "update", "nodename=lost", "state=down", "reason=lost")

        stopped, pid = wait_for(lambda: self.run_on(hosts["kept"]), "a file has ended on the node that is left")
        os.kill(pid, signal.SIGTERM)  # the script then asks Slurm for another try
        wait_for(lambda: self.says("squeue", "-h", "-j", job) == "", "the end of all tasks", 120)
        logs = "".join(path.read_text() for path in sorted(self.folder.glob("*.task")))
        states = self.says("scontrol", "-o", "show", "job", job).splitlines()
        self.assertEqual(["COMPLETED" in state for state in states], SHARDS * [True], logs)
        self.check([lost, stopped])

    def test_a_part_of_an_array_needs_the_number_of_all(self):
        env = {**os.environ, "TRIMRAY": str(OPTIONS.bin / "trimray"), "SLURM_ARRAY_TASK_ID": "3", "SLURM_ARRAY_TASK_MAX": "3",
               "SLURM_ARRAY_TASK_COUNT": "2", "SLURM_CPUS_PER_TASK": "1", "SLURM_MEM_PER_CPU": "2048"}
        task = [EXAMPLES / "slurm_array.sh", self.out, self.models / "0_unit_sphere.stp", *QUICK]
        refused = subprocess.run(task, env=env, capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual((refused.returncode, self.out.exists()), (1, False))
        self.assertIn("SHARDS", refused.stderr)
        subprocess.run(task, env={**env, "SHARDS": "4"}, capture_output=True, timeout=60, check=True)
        self.assertEqual([run["shard"] for run in events(self.out, "run")], ["3/4"])


class Kubernetes(Engine):
    """No cluster: the Job's command, run as the kubelet would, and the rules, applied as the Job's controller would."""

    copies = 6  # with previews, which take time too

    def setUp(self):
        super().setUp()
        self.job = yaml.safe_load((EXAMPLES / "kubernetes_job.yaml").read_text(encoding="utf-8"))["spec"]
        [self.container] = self.job["template"]["spec"]["containers"]

    def pod(self, node, index, **changed):
        given = {variable["name"]: variable["value"] for variable in self.container["env"]}
        given |= {"MODELS": str(self.models), "OUTDIR": str(self.out), "SHARDS": str(SHARDS), "JOBS": "1"} | changed
        given |= {"JOB_COMPLETION_INDEX": str(index), "PATH": f"{OPTIONS.bin}:{os.environ['PATH']}"}
        return self.host(node, self.container["command"] + self.container["args"], given)

    def action(self, code):
        """What follows when a pod ends with `code`."""
        for rule in self.job["podFailurePolicy"]["rules"]:
            on = rule.get("onExitCodes")
            if on and (code in on["values"]) == (on["operator"] == "In"):
                return rule["action"]
        return "Succeeded" if code == 0 else "Count"

    def test_the_job_is_of_one_piece(self):
        shards = next(variable["value"] for variable in self.container["env"] if variable["name"] == "SHARDS")
        self.assertEqual((self.job["completionMode"], str(self.job["completions"])), ("Indexed", shards))
        self.assertEqual(self.job["template"]["spec"]["restartPolicy"], "Never", "podFailurePolicy asks for it")
        for rule in self.job["podFailurePolicy"]["rules"]:
            self.assertIn(rule["action"], ["Ignore", "FailJob", "FailIndex", "Count"])
            if on := rule.get("onExitCodes"):
                self.assertEqual(on["containerName"], self.container["name"])
        volumes = {volume["name"] for volume in self.job["template"]["spec"]["volumes"]}
        self.assertEqual({mount["name"] for mount in self.container["volumeMounts"]}, volumes)

    def test_exit_codes_fit_the_policy(self):
        wrong_option = self.pod("kept", 0, SHARDS="none").process.wait(timeout=60)
        self.assertEqual((wrong_option, self.action(wrong_option)), (1, "FailJob"))
        unwritable = self.pod("kept", 0, OUTDIR="/dev/null/packs").process.wait(timeout=60)
        self.assertEqual((unwritable, self.action(unwritable)), (2, "Count"))

    def test_pods_that_are_ended_cost_nothing_but_their_time(self):
        drained = self.pod("kept", 0)
        drained_run, _ = wait_for(lambda: self.run_on(drained), "a file has ended in the first pod")
        code = drained.end_task()
        self.assertEqual((code, self.action(code)), (128 + signal.SIGTERM, "Count"))
        lost_run = self.lose(self.pod("lost", 1))
        for index in range(SHARDS):
            code = self.pod("kept", index).process.wait(timeout=60)
            self.assertEqual(self.action(code), "Succeeded", code)
        self.check([drained_run, lost_run])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--bin", type=Path, required=True)
    OPTIONS, rest = parser.parse_known_args()
    OPTIONS.bin = OPTIONS.bin.resolve()
    missing = [name for name in NEEDED if shutil.which(name) is None] + ([] if yaml else ["yaml for Python"])
    if missing:
        print(f"skipped: no {', '.join(missing)}; tests/engines.txt names the packages")
        sys.exit(77)
    enter_private_network()
    unittest.main(argv=[sys.argv[0], *rest])
