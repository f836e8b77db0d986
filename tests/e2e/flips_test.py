#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""One bit of a map's file flipped, again and again: answers are right or none, and verify sees it.

DSG_FLIPS flips (60 by default), DSG_SEED repeats a run.
"""

import collections
import concurrent.futures
import os
import random
import shutil
import unittest

import support

FLIP_COUNT = int(os.environ.get("DSG_FLIPS", "60"))
SEED = int(os.environ.get("DSG_SEED", "11"))
DATA_LOSS = 4

QUESTIONS = (
    ("where", "alice", "--at", "+20s"),
    ("where", "robot", "--at", "+3.5s", "--revision", "12"),
    ("track", "robot", "--from", "+5s", "--to", "+15s"),
    ("track", "alice", "--every", "2s"),
    ("who", "--room", "kitchen"),
    ("who", "--box", "0,0,0,20,10,3", "--from", "+10s", "--to", "+30s"),
    ("met", "alice"),
    ("picked", "--all"),
    ("predict", "bob", "--at", "+30s"),
    ("ls", "--layer", "rooms"),
    ("ls", "--kind", "object", "--limit", "1000"),
    ("ls", "--box", "0,0,0,8,8,3", "--limit", "1000"),
    ("edges", "--relation", "CONTAINS", "--limit", "5000"),
    ("show", "O3"),
    ("near", "5,5,1", "--layer", "objects", "--k", "7"),
    ("find", "chair in (room)"),
    ("around", "R1"),
    ("path", "kitchen", "R2"),
    ("collide", "--sphere", "0.4", "--pose", "6,6,1", "--objects", "--structures"),
    ("diff", "3", "9"),
)


class Flips(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        print(f"seed {SEED}")
        cls.ok("dsg-simulate", "tracks", "--out", "log", "--world", "apartment", "--seed", 5,
               "--people", 3, "--seconds", 60, "--picks", 4)
        cls.ok("dsg-ingest", "--store", "store", "--map", "office", "--commit-poses", 60,
               os.path.join("log", "log"))
        cls.rng = random.Random(SEED)
        cls.right = cls.answers("store")
        wrong = [q for q, (code, _) in zip(QUESTIONS, cls.right) if code not in (0, 1)]
        if wrong:
            raise AssertionError(f"not answered even without a flip: {wrong}")

    @classmethod
    def answers(cls, store):
        """(exit code, text) of each question."""
        found = []
        for question in QUESTIONS:
            done = support.run("dsg", *question, "--store", store, "--map", "office", "--json",
                               cwd=cls.folder)
            found.append((done.returncode, support.without_incarnation(done.stdout)))
        return found

    @classmethod
    def flipped_store(cls, number, bit):
        store = cls.path(f"flipped-{number}")
        shutil.copytree(cls.path("store"), store)
        path = os.path.join(store, "office", "graph.db")
        with open(path, "r+b") as f:
            f.seek(bit // 8)
            byte = f.read(1)[0]
            f.seek(bit // 8)
            f.write(bytes([byte ^ (1 << bit % 8)]))
        return store

    def judge(self, number, bit):
        """What became of the questions: how many right, refused, wrong; and whether verify saw."""
        store = self.flipped_store(number, bit)
        counts = collections.Counter()
        wrong = []
        for question, right, found in zip(QUESTIONS, self.right, self.answers(store)):
            if found == right:
                counts["right"] += 1
            elif found[0] == DATA_LOSS:
                counts["data loss"] += 1
            elif found[0] not in (0, 1) and self.is_no_store(store):
                # A flip in the first bytes: it is not taken for a map at all.
                counts["refused"] += 1
            else:
                wrong.append(f"bit {bit}: {question} exit {found[0]}")
        done = support.run("dsg", "verify", "--store", store, "--map", "office",
                           cwd=self.folder)
        if done.returncode == 0:
            wrong.append(f"bit {bit}: verify saw nothing")
        shutil.rmtree(store)
        return counts, wrong

    def is_no_store(self, store):
        done = support.run("dsg", "stats", "--store", store, "--map", "office", cwd=self.folder)
        return done.returncode not in (0, DATA_LOSS)

    def test_no_flipped_bit_makes_a_wrong_answer(self):
        bits = 8 * os.path.getsize(self.path("store", "office", "graph.db"))
        chosen = [self.rng.randrange(bits) for _ in range(FLIP_COUNT)]
        sums = collections.Counter()
        with concurrent.futures.ThreadPoolExecutor(max_workers=2) as pool:
            for counts, wrong in pool.map(self.judge, range(FLIP_COUNT), chosen):
                self.assertEqual([], wrong)
                sums.update(counts)
        print(f"{FLIP_COUNT} flips in {bits // 8} bytes, {len(QUESTIONS)} questions each: "
              f"{sums['right']} right, {sums['data loss']} DATA_LOSS, {sums['refused']} no map at "
              f"all, 0 wrong; dsg verify found {FLIP_COUNT} of {FLIP_COUNT}")


if __name__ == "__main__":
    unittest.main()
