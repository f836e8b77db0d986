#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The examples of the pages print what the pages show, and pip installs the package offline."""

import contextlib
import doctest
import os
import re
import subprocess
import sys
import unittest
import zipfile

import python_support
import support

python_support.run_with("numpy", "pandas", "networkx")

PAGES = ("README.md", "docs/python.md")
BLOCK = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)
TABLES = ("numpy", "pandas", "networkx")
NEEDS_TABLES = re.compile(r"to_(arrays|pandas|numpy|networkx)|networkx\.")


class Package(support.ProgramsTest):
    def test_the_examples_print_what_the_pages_show(self):
        self.ok("dsg-simulate", "tracks", "--out", "office", "--seed", 12, "--people", 12,
                "--seconds", 300, "--picks", 2)
        self.ingest("store", os.path.join("office", "log"))
        self.ok("dsg", "tag", "first", "--revision", "1", "--store", "store")
        # Where the README's demo keeps it.
        os.mkdir(self.path("build"))
        os.symlink("..", self.path("build", "demo"))
        with inside(self.folder):
            counts = [self.run_page(page) for page in PAGES]
        if python_support.has(*TABLES):
            self.assertGreater(counts[0], 3)
        self.assertGreater(counts[1], 30)

    def run_page(self, page):
        """The number of examples of a page; all must print what is shown."""
        with open(os.path.join(support.ROOT, page), encoding="utf-8") as f:
            text = f.read()
        parser, names, said, count = doctest.DocTestParser(), {}, [], 0
        runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
        for match in BLOCK.finditer(text):
            if not python_support.has(*TABLES) and NEEDS_TABLES.search(match.group(1)):
                print("skipped a block: needs numpy, pandas and networkx")
                continue
            test = parser.get_doctest(match.group(1), names, page, page,
                                      text.count("\n", 0, match.start(1)))
            count += len(test.examples)
            runner.run(test, out=said.append, clear_globs=False)
            names = test.globs
        self.assertEqual("", "".join(said))
        return count

    def test_pip_installs_it_offline(self):
        made = subprocess.run([sys.executable, "-m", "venv", self.path("venv")], text=True,
                              capture_output=True, check=False)
        if made.returncode != 0:
            self.skipTest(f"no venv here (python3-venv): {made.stdout}{made.stderr}")
        python = self.path("venv", "bin", "python")
        clean = {"PATH": os.environ["PATH"], "HOME": self.folder, "PIP_CONFIG_FILE": os.devnull}
        done = subprocess.run([python, "-m", "pip", "install", "--no-index", "--no-build-isolation",
                               python_support.PACKAGE], text=True, capture_output=True, check=False,
                              env=clean)
        self.assertEqual(0, done.returncode, done.stdout + done.stderr)
        asked = "import dsgdb, sys; print(dsgdb.__file__); print(dsgdb.open(sys.argv[1]).maps())"
        self.ingest("venv-store", self.simulate("small", people=2, seconds=20))
        done = subprocess.run([python, "-c", asked, self.path("venv-store")], text=True,
                              capture_output=True, check=False, cwd=self.folder,
                              env=dict(clean, DSGDB_SERVER=os.path.join(support.BIN, "dsg-server")))
        self.assertEqual("", done.stderr)
        where, maps = done.stdout.splitlines()
        self.assertTrue(where.startswith(self.path("venv")), where)
        self.assertEqual("['office']", maps)

    def test_the_wheel_is_whole_and_the_same_each_time(self):
        build = ("import sys; sys.path.insert(0, sys.argv[1]); import build_wheel as b; "
                 "print(b.build_wheel(sys.argv[2]), b.build_sdist(sys.argv[2]))")
        contents = []
        for folder in ("one", "two"):
            os.mkdir(self.path(folder))
            done = subprocess.run([sys.executable, "-c", build, python_support.PACKAGE,
                                   self.path(folder)], text=True, capture_output=True, check=False)
            self.assertEqual("", done.stderr)
            wheel = done.stdout.split()[0]
            with open(self.path(folder, wheel), "rb") as f:
                contents.append(f.read())
        self.assertEqual(*contents)
        with zipfile.ZipFile(self.path("one", wheel)) as archive:
            names = set(archive.namelist())
        in_tree = {f"dsgdb/{name}" for name in os.listdir(os.path.join(python_support.PACKAGE,
                                                                       "dsgdb"))
                   if not name.startswith("__pycache__")}
        self.assertEqual(in_tree, {name for name in names if name.startswith("dsgdb/")})


@contextlib.contextmanager
def inside(folder):
    """As contextlib.chdir, which comes with Python 3.11."""
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


if __name__ == "__main__":
    unittest.main()
