#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Who may include whom: the table of docs/architecture.md, checked from the #include lines.

Reads text only; the link lines in CMake repeat the same order and are checked by the linker.
"""

import re

import tree

# Folder -> folders of ours that it may include, besides itself. The longest match decides.
BASE = ["schema/base"]
MODEL = BASE + ["schema/model"]
CODEC = MODEL + ["schema/codec"]
STORE = CODEC + ["schema/store"]
SCHEMA = STORE + ["schema/files", "schema/interop", "schema/picture", "schema/matching",
                  "schema/program"]
# The main of dsg-ingest alone may choose between a local store and a remote one.
INGEST_STAGES = ["log", "simulator", "evaluation", "odometry", "loop", "depth", "volume", "agents",
                 "objects", "places", "rooms", "recognition"]
# Plain types that stages hand to one another.
INGEST_SHARED = ["ingest/config", "ingest/files", "ingest/sensor", "ingest/grid",
                 "ingest/trajectory", "ingest/solver"]
# What is done with what the stages found.
INGEST_ROOMS = ["ingest/commit", "ingest/presence", "ingest/correction"]
# Programs of their own beside the pipeline, which knows nothing of them.
ASIDE = ["simulator", "evaluation"]
ALLOWED = {
    # The generator of query/api.
    "proto": [],
    "schema/base": [],
    "schema/audit": BASE,
    "schema/files": BASE,
    "schema/program": BASE,
    "schema/model": BASE,
    "schema/codec": MODEL,
    "schema/store": CODEC,
    "schema/store/sqlite": STORE,
    "schema/store/memory": STORE,
    # The one place that knows all backends.
    "schema/store/backends": STORE + ["schema/store/sqlite", "schema/store/memory"],
    "schema/archive": STORE + ["schema/files"],
    "schema/interop": STORE,
    "schema/picture": MODEL,
    "schema/matching": BASE,
    "schema/retention": STORE + ["schema/files"],
    "schema/merge": STORE + ["schema/matching"],
    "ingest/config": SCHEMA,
    "ingest/files": BASE + ["schema/files"],
    "ingest/sensor": MODEL,
    "ingest/grid": MODEL,
    "ingest/solver": MODEL,
    "ingest/trajectory": MODEL + ["ingest/config", "ingest/files"],
    "ingest/commit": SCHEMA + ["query/api", "query/client"],
    "ingest/presence": MODEL + ["ingest/config"],
    "ingest/correction": SCHEMA + ["ingest/commit", "ingest/log", "ingest/loop",
                                   "ingest/trajectory"],
    "ingest/pipeline": (SCHEMA + INGEST_SHARED + INGEST_ROOMS +
                        [f"ingest/{s}" for s in INGEST_STAGES if s not in ASIDE]),
    "ingest/program": SCHEMA + ["ingest/config", "ingest/files", "ingest/log", "ingest/commit",
                                "ingest/pipeline", "ingest/alignment", "ingest/overlay",
                                "query/client"],
    # The calls as C++, and the one client: below both the programs of query and those of ingest.
    "query/api": BASE,
    "query/client": CODEC + ["query/api"],
    "query/view": SCHEMA,
    "query/prediction": MODEL,
    "query/engine": SCHEMA + ["query/api", "query/view", "query/prediction"],
    "query/maintenance": SCHEMA + ["query/api", "query/engine", "schema/archive", "schema/merge",
                                   "schema/retention"],
    "query/service": STORE + ["query/api", "query/engine", "query/maintenance"],
    "query/cli": SCHEMA + ["schema/archive", "schema/audit", "schema/retention", "query/api",
                           "query/maintenance", "query/service", "query/client"],
    "server": SCHEMA + ["schema/audit", "schema/retention", "query/api", "query/maintenance",
                        "query/service"],
    "tests": SCHEMA + ["ingest", "query", "server"],
}
# What users of the client library would include.
ALLOWED["docs/examples"] = ["query/api", "query/client"]
ALLOWED.update({f"ingest/{s}": SCHEMA + INGEST_SHARED for s in INGEST_STAGES})
# Features of stereo pairs, and poses between two cameras, are the front-end's.
ALLOWED["ingest/recognition"] += ["ingest/odometry"]
# Where maps lie to each other is told by what their robots recognise.
ALLOWED["ingest/alignment"] = SCHEMA + INGEST_SHARED + ["ingest/recognition"]
# Plain images, and a map to draw over them.
ALLOWED["ingest/overlay"] = SCHEMA + ["ingest/config", "ingest/sensor"]
# Nobody but these two sees the ground truth.
ALLOWED["ingest/truth"] = SCHEMA + ["ingest/files", "ingest/sensor"]
ALLOWED["ingest/simulator"] += ["ingest/truth"]
# A bag is made from what the readers make of a folder, so that both hold the same.
ALLOWED["ingest/simulator/bag"] = ALLOWED["ingest/simulator"] + ["ingest/log", "ingest/simulator"]
ALLOWED["ingest/simulator"] += ["ingest/simulator/bag"]
# Trajectories of files are read by the readers of logs.
ALLOWED["ingest/evaluation"] += ["ingest/truth", "ingest/log"]

# Pattern of an include -> folders that may have it; "*.cc" after a folder means not in headers.
# A header named *_internal.h counts as part of the .cc files of its folder, which alone may
# include it.
THIRD_PARTY = [
    (r"sqlite3", ["schema/store/sqlite *.cc", "ingest/log *.cc", "tests"]),
    (r"grpc(pp|\+\+)?/|.*\.grpc\.pb\.h$",
     ["query/client", "server", "tests"]),
    (r"(dsg/v1|google/(protobuf|rpc))/.*",
     ["schema/codec *.cc", "schema/store *.cc", "ingest/commit *.cc", "query *.cc", "server *.cc",
      "docs/examples *.cc", "proto", "tests"]),
    (r"fcl/", ["query/engine *.cc", "tests"]),
    (r"pcl/|opencv2?/|ceres/|gtsam/|embree3/|rosbag/|yaml-cpp/|nanoflann",
     ["schema/files", "ingest *.cc", "tests"]),
    (r"spdlog/", ["schema/base *.cc"]),
    (r"CLI/", ["schema/program *.cc", "ingest *.cc", "query/cli", "query/client *.cc",
               "server *.cc", "tests"]),
    (r"GeographicLib/", ["query/cli/export *.cc"]),
    (r"png\.h$", ["schema/picture *.cc", "ingest/truth *.cc", "tests"]),
    (r"nlohmann/", ["schema/interop", "schema/archive *.cc", "schema/audit *.cc", "ingest *.cc",
                    "query/cli *.cc", "server/http *.cc", "tests"]),
    (r"boost/(asio|beast|system)/", ["server/http *.cc"]),
]

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
INTERNAL = "_internal.h"
OURS = ("schema/", "ingest/", "query/", "server/", "tests/", "proto/")


def longest(folder, table):
    """The entry of `table` that is `folder` or the nearest above it; None if there is none."""
    while folder:
        if folder in table:
            return folder
        folder = folder.rpartition("/")[0]
    return None


def within(folder, above):
    return folder == above or folder.startswith(above + "/")


def may_include_ours(path, included):
    folder, target = path.rpartition("/")[0], included.rpartition("/")[0]
    if included.endswith(INTERNAL):
        return folder == target and path.endswith((".cc", INTERNAL))
    owner = longest(folder, ALLOWED)
    if owner is None:
        return False
    if owner == "tests":
        return True
    target_owner = longest(target, ALLOWED)
    return target_owner == owner or target_owner in ALLOWED[owner]


def may_include_third_party(path, included):
    for pattern, places in THIRD_PARTY:
        if not re.match(pattern, included):
            continue
        for place in places:
            folder, _, only = place.partition(" ")
            if within(path, folder) and (not only or path.endswith((".cc", INTERNAL))):
                return True
        return False
    return True


def problems_of(path, text):
    found = []
    for match in INCLUDE.finditer(text):
        quote, included = match.groups()
        line = text.count("\n", 0, match.start(2)) + 1
        if quote == '"' and "/" not in included:
            found.append(f'{path}:{line}: write the whole path, not "{included}"')
        elif included.startswith(OURS):
            if not may_include_ours(path, included):
                found.append(f"{path}:{line}: must not include {included}; "
                             "see the table in docs/architecture.md")
        elif not may_include_third_party(path, included):
            found.append(f"{path}:{line}: must not include {included} here; "
                         "wrap it in the folder that owns it")
    return found


def find_problems():
    paths = tree.files(tree.CPP)
    problems = [p for path in paths for p in problems_of(path, tree.read(path))]
    problems += [f"{path}: no layer owns this folder; add it to ALLOWED" for path in paths
                 if longest(path.rpartition("/")[0], ALLOWED) is None]
    return problems, f"{len(paths)} files"


if __name__ == "__main__":
    tree.main("layering", find_problems)
