"""Submits an array script to Slurm on this machine's loopback and waits for its tasks."""

import json
import subprocess
import sys

from slurm_loopback import NoDaemon, cluster


def main():
    try:
        with cluster() as (folder, environment):
            command = ["sbatch", "--wait", "--parsable", f"--output={folder}/task-%a.out", sys.argv[1]]
            submitted = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
            tasks = len(list(folder.glob("task-*.out")))
            print(json.dumps({"exit": submitted.returncode, "said": submitted.stderr, "tasks": tasks}))
    except NoDaemon as reason:
        print(json.dumps({"not_started": str(reason)}))


if __name__ == "__main__":
    main()
