#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Is the Python package what the protos say, and are its types right (mypy --strict)?

--update writes the generated file anew.
"""

import os
import subprocess
import sys

import tree

PACKAGE = "query/python"
GENERATED = PACKAGE + "/dsgdb/v1.py"
GENERATOR = os.path.join(tree.ROOT, PACKAGE, "generate_api.py")


def python_with_protobuf():
    """Debian's packages belong to Debian's Python, which need not be the first on the path."""
    for python in (sys.executable, "/usr/bin/python3"):
        done = subprocess.run([python, "-c", "import google.protobuf"], capture_output=True,
                              check=False)
        if done.returncode == 0:
            return python
    raise SystemExit("no Python here knows google.protobuf; install python3-protobuf")


def generated_problems(path):
    done = subprocess.run([python_with_protobuf(), GENERATOR, "--check", path],
                          capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return []
    if done.stderr:
        return [done.stderr.strip()]
    return [f"{GENERATED} is not what the protos say: run check_python.py --update"]


def type_problems(path):
    try:
        done = subprocess.run(
            ["mypy", "--config-file", os.path.join(tree.ROOT, PACKAGE, "pyproject.toml"),
             "--cache-dir", os.devnull, "--no-error-summary", path],
            cwd=os.path.join(tree.ROOT, PACKAGE), capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return ["mypy is missing; install the packages mypy and python3-typeshed"]
    return [f"{PACKAGE}/{line}" for line in (done.stdout + done.stderr).splitlines()
            if ": note: " not in line]


def find_problems(update):
    if update:
        subprocess.run([python_with_protobuf(), GENERATOR], check=True)
    generated = os.path.join(tree.ROOT, GENERATED)
    return generated_problems(generated) + type_problems("dsgdb"), PACKAGE


if __name__ == "__main__":
    tree.main("python", lambda: find_problems("--update" in sys.argv[1:]))
