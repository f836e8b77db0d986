#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Do the pages hold together: links lead somewhere, and each `./dev VERB` they name exists?

That the commands of the README also work is proved by tests/e2e/readme_test.py, which runs them.
"""

import os
import re

import tree

LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
VERB = re.compile(r"\./dev ([a-z]+)")
CODE = re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE)


def verbs_of(dev_script):
    listed = re.search(r"^    ([a-z | ]+)\) \"verb_", dev_script, re.MULTILINE).group(1)
    return set(listed.split(" | ")) | {"help"}


def problems_of(path, text, verbs, exists):
    found = []
    for target in LINK.findall(CODE.sub("", text)):
        if re.match(r"[a-z]+:", target):
            continue
        resolved = os.path.normpath(os.path.join(os.path.dirname(path), target))
        if not exists(resolved):
            found.append(f"{path}: the link to {target} leads nowhere")
    found += [f"{path}: there is no ./dev {verb}" for verb in VERB.findall(text)
              if verb not in verbs]
    return found


def find_problems():
    verbs = verbs_of(tree.read("dev"))
    paths = tree.files((".md",))
    problems = []
    for path in paths:
        problems += problems_of(path, tree.read(path), verbs,
                                lambda p: os.path.exists(os.path.join(tree.ROOT, p)))
    return problems, f"{len(paths)} pages"


if __name__ == "__main__":
    tree.main("docs", find_problems)
