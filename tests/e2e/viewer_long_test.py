#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Viewers that stay open: live in many tabs, through many revisions, and playing for long.

DSG_PLAY_S says how long one plays (10 s).
"""

import os
import time
import unittest

import viewer_support
from viewer_support import READY

PLAY_S = float(os.environ.get("DSG_PLAY_S", "10"))
TABS = 7
COMMIT_S_MAX = 5
STEPS, STEPS_AT_ONCE = 200, 20
GROWTH_MAX = 1.10


class Long(viewer_support.ViewerTest):
    PEOPLE = 3
    SECONDS = 20
    REVISIONS = 12

    @classmethod
    def make_store(cls):
        super().make_store()
        cls.room = cls.ask("ls", "--kind", "room", "--store", "store")["nodes"][0]["id"]
        for i in range(cls.REVISIONS):
            cls.ok("dsg", "set", cls.room, "--name", f"den {i}", "--store", "store")

    def set_name(self, name, store):
        self.ok("dsg", "set", self.room, "--name", name, "--server", f"unix:{store}.sock")

    def revision(self):
        return int(self.window.run("return document.body.dataset.revision"))

    def test_of_seven_live_tabs_the_one_that_is_seen_follows(self):
        first = self.window.this_window()
        self.ingest("tabs", self.simulate("tabs-log", people=1, seconds=5))
        # One watch at a time: a tab that kept its own while it is hidden would shut out the next.
        with self.served("tabs", "--max-watches", "1") as url:
            names = []
            try:
                for _ in range(TABS):
                    names.append(self.window.new_window())
                    self.window.get(url + "&live=1")
                    self.window.wait(READY)
                    self.window.hide()
                self.window.show()
                before = self.revision()
                self.set_name("the den", "tabs")
                begin = time.monotonic()
                self.window.wait(f"document.body.dataset.revision === '{before + 1}' && {READY}")
                took = time.monotonic() - begin
                print(f"a commit was seen {took:.2f} s after its answer")
                self.assertLess(took, COMMIT_S_MAX)
                self.window.hide()
                for name in names[:-1]:
                    self.window.switch(name)
                    # Not one of them was told, and each catches up when it is seen.
                    self.assertEqual(before, self.revision())
                    self.window.show()
                    self.window.wait(
                        f"document.body.dataset.revision === '{before + 1}' && {READY}")
                    self.window.hide()
                # A page that is loaded while it is hidden watches nothing either.
                self.window.run("location.reload()")
                self.window.wait(READY)
                self.window.switch(names[0])
                self.window.show()
                self.set_name("another den", "tabs")
                self.window.wait(f"document.body.dataset.revision === '{before + 2}' && {READY}")
            finally:
                for name in names:
                    self.window.switch(name)
                    self.window.close_window()
                self.window.switch(first)

    def heap_bytes(self):
        """The least of some moments: what still runs or waits may hold another scene."""
        return min((time.sleep(0.3), self.window.heap_bytes())[1] for _ in range(6))

    def step(self, count):
        """Goes through revisions, back and forth, by the slider."""
        for _ in range(0, count, STEPS_AT_ONCE):
            self.window.run("""
              const slider = document.getElementById('revision');
              const body = document.body.dataset;
              const [steps, lowest] = arguments;
              return (async () => {
                for (let i = 0; i < steps; ++i) {
                  const next = lowest + (Number(body.revision) - lowest + 1) %
                                            (Number(slider.max) - lowest + 1);
                  slider.value = String(next);
                  slider.dispatchEvent(new Event('input'));
                  while (body.revision !== String(next) || body.state !== 'ready') {
                    await new Promise((done) => setTimeout(done, 5));
                  }
                }
              })();""", STEPS_AT_ONCE, self.lowest)

    def test_revisions_leave_nothing_behind(self):
        self.open()
        self.lowest = self.revision() - self.REVISIONS
        self.step(STEPS_AT_ONCE)
        before = self.heap_bytes()
        self.step(STEPS)
        after = self.heap_bytes()
        print(f"heap {before / 1e6:.2f} MB, after {STEPS} revisions {after / 1e6:.2f} MB")
        self.assertLess(after, before * GROWTH_MAX)

    def test_playing_leaves_nothing_behind(self):
        self.open()
        # The page plays by itself, from the begin again when it has come to the end: of each
        # script that is sent the driver keeps an array in the page's heap.
        self.window.run("""
          document.getElementById('speed').value = '20';
          setInterval(() => {
            const play = document.getElementById('play');
            if (play.getAttribute('aria-pressed') !== 'true') play.click();
          }, 200);""")

        def drawn():
            return int(self.window.run("return document.body.dataset.drawn"))

        def play(seconds):
            before = drawn()
            time.sleep(seconds)
            return drawn() - before

        play(min(10, PLAY_S))
        before = self.heap_bytes()
        frames = play(PLAY_S)
        after = self.heap_bytes()
        print(f"heap {before / 1e6:.2f} MB, after {PLAY_S:.0f} s of play and {frames} pictures "
              f"{after / 1e6:.2f} MB")
        self.assertGreater(frames, PLAY_S)
        self.assertLess(after, before * GROWTH_MAX)
        self.assertEqual("ready", self.window.run("return document.body.dataset.state"))
        self.assertEqual([], self.window.messages())


if __name__ == "__main__":
    unittest.main()
