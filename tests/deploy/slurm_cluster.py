"""A Slurm cluster of one node for tests: munge, controller and node daemon of Debian's packages,
with key, configuration, state and ports of their own in one folder. Needs root, no control groups,
and touches nothing of a cluster that the machine may belong to."""

import os
import pwd
import secrets
import shutil
import signal
import socket
import subprocess
import time

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "scontrol", "squeue", "scancel", "sacct")
ADMIN_PATH = "/usr/sbin:/sbin"
# Requeued jobs wait for the lifetime of credentials, 120 s by default.
CONFIGURATION = """ClusterName=color3d-test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller_port}
SlurmdPort={node_port}
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={folder}/munge/socket,cred_expire=5
SlurmUser={user}
SlurmdUser={user}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=2,bf_interval=2,batch_sched_delay=0
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
SlurmdParameters=config_overrides
ReturnToService=2
KillWait=30
MinJobAge=600
PropagateResourceLimits=ALL
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory=4096 State=UNKNOWN
PartitionName=usual Nodes={host} Default=YES MaxTime=INFINITE State=UP PriorityTier=1 GraceTime=30
PartitionName=urgent Nodes={host} MaxTime=INFINITE State=UP PriorityTier=100 PreemptMode=OFF
"""


def find(program):
    return shutil.which(program, path=os.environ.get("PATH", "/usr/bin:/bin") + ":" + ADMIN_PATH)


def why_not():
    """Why no cluster can run here; empty: one can."""
    missing = [program for program in PROGRAMS if not find(program)]
    if missing:
        return f"no {', '.join(missing)} (deploy/install-deps.sh --engines)"
    if os.geteuid() != 0:
        return "Slurm's daemons need root"
    return ""


def free_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


class Cluster:
    """The daemons live from the constructor to close()."""

    def __init__(self, folder, cpus=2):
        self.folder = folder
        self.daemons = []
        for name in ("munge", "state", "spool"):
            os.makedirs(os.path.join(folder, name), mode=0o700)
        self.host = socket.gethostname().split(".")[0]
        self.configuration = os.path.join(folder, "slurm.conf")
        with open(self.configuration, "w", encoding="utf-8") as file:
            file.write(
                CONFIGURATION.format(
                    host=self.host,
                    user=pwd.getpwuid(os.geteuid()).pw_name,
                    folder=folder,
                    controller_port=free_port(),
                    node_port=free_port(),
                    cpus=cpus,
                )
            )
        self.environment = dict(os.environ, SLURM_CONF=self.configuration)
        try:
            self.start_munge()
            self.start("slurmctld", "-D", "-f", self.configuration)
            self.start("slurmd", "-D", "-N", self.host, "-f", self.configuration)
            self.wait_for(lambda: "State=IDLE" in self.node(), 60, "an idle node")
        except BaseException:
            self.close()
            raise

    def path(self, name):
        return os.path.join(self.folder, name)

    def start_munge(self):
        with open(self.path("munge/key"), "wb") as file:
            os.fchmod(file.fileno(), 0o400)
            file.write(secrets.token_bytes(128))
        os.chmod(self.path("munge"), 0o755)  # programs of jobs reach the socket
        places = [f"--{name}-file={self.path('munge/' + name)}" for name in ("key", "log", "pid", "seed")]
        self.start("munged", "--foreground", "--force", f"--socket={self.path('munge/socket')}", *places)
        self.wait_for(lambda: os.path.exists(self.path("munge/socket")), 20, "munge")

    def start(self, program, *arguments):
        with open(self.path(program + ".out"), "wb") as out:
            self.daemons.append(
                subprocess.Popen(
                    [find(program), *arguments],
                    stdin=subprocess.DEVNULL,
                    stdout=out,
                    stderr=out,
                    env=self.environment,
                    start_new_session=True,
                )
            )

    def wait_for(self, condition, seconds, what):
        end = time.monotonic() + seconds
        while not condition():
            ended = [daemon.args[0] for daemon in self.daemons if daemon.poll() is not None]
            if ended or time.monotonic() > end:
                raise RuntimeError(f"no {what}; ended: {ended}\n{self.logs()}")
            time.sleep(0.2)

    def logs(self):
        text = ""
        for name in sorted(os.listdir(self.folder)):
            if name.endswith((".log", ".out")):
                with open(self.path(name), errors="replace", encoding="utf-8") as file:
                    text += f"--- {name}\n" + "".join(file.readlines()[-25:])
        return text

    def run(self, program, *arguments, **options):
        """What the program of Slurm prints; its failure is an error."""
        result = subprocess.run(
            [find(program), *arguments],
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
            **options,
        )
        if result.returncode != 0:
            raise RuntimeError(f"{program} {arguments}: {result.stdout}{result.stderr}")
        return result.stdout

    def node(self):
        try:
            return self.run("scontrol", "show", "node", self.host)
        except RuntimeError:
            return ""  # the controller begins

    def job(self, job):
        """The fields of `scontrol show job` of a job or of one task of an array, with its name in `Name`.

        job: as scontrol takes it, or SLURM_JOB_ID; that of one task of an array is the array's own.
        """
        for line in self.run("scontrol", "--oneliner", "show", "job", job).splitlines():
            fields = dict(word.split("=", 1) for word in line.split() if "=" in word)
            task = fields.get("ArrayTaskId")
            fields["Name"] = f"{fields['ArrayJobId']}_{task}" if task else fields["JobId"]
            if job in (fields["JobId"], fields["Name"]):
                return fields
        raise AssertionError(f"scontrol shows no job {job}")

    def tasks(self, *options):
        """(name as scontrol takes it, state) of the jobs that have not ended."""
        lines = self.run("squeue", "--noheader", "--array", "--format=%i %T", *options).splitlines()
        return [tuple(line.split()) for line in lines]

    def close(self):
        """Ends jobs and daemons; leaves no process."""
        if len(self.daemons) > 2:
            for job, _ in self.tasks():
                subprocess.run([find("scancel"), "--signal=KILL", "--full", job], env=self.environment, check=False)
                subprocess.run([find("scancel"), job], env=self.environment, check=False)
            end = time.monotonic() + 60
            while self.tasks() and time.monotonic() < end:
                time.sleep(0.2)
        for daemon in reversed(self.daemons):
            daemon.terminate()
        for daemon in reversed(self.daemons):
            try:
                daemon.wait(20)
            except subprocess.TimeoutExpired:
                os.killpg(daemon.pid, signal.SIGKILL)
                daemon.wait()
        self.daemons = []
