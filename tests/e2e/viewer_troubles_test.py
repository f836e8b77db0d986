#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The viewer when something goes wrong under it: it says what, and goes on when it can."""

import os
import subprocess
import unittest
import urllib.parse

import support
import viewer_support
from viewer_support import READY

PAGE_BYTES = 4096
LOSE = "document.getElementById('scene').getContext('webgl2').getExtension('WEBGL_lose_context')"


class Troubles(viewer_support.ViewerTest):
    PEOPLE = 2
    SECONDS = 10

    def new_store(self, name):
        self.ingest(name, self.simulate(name + "-log", people=1, seconds=5))

    def replace(self, name):
        """Drops the map of a server and makes another one with its name, of two more people."""
        to = ("--server", f"unix:{name}.sock")
        self.ok("dsg", "drop", "office", "--yes", *to)
        self.ok("dsg-ingest", *to, "--map", "office", self.simulate(name + "-other", people=3,
                                                                    seconds=5))
        return self.ask("ls", "--kind", "room", *to)["nodes"][0]["id"]

    def test_a_replaced_map_is_followed(self):
        self.new_store("followed")
        with self.served("followed") as url:
            self.go(url + "&live=1")
            self.window.wait(READY)
            room = self.replace("followed")
            self.window.wait(f"{READY} && document.querySelector('#layers .count').textContent "
                             "=== '4'")
            self.ok("dsg", "set", room, "--name", "the den", "--server", "unix:followed.sock")
            self.window.wait("document.body.dataset.state === 'ready' && "
                             "document.getElementById('sentence').textContent"
                             ".includes('revision 3')")
            self.assertIn("the den", [row[1] for row in self.rows()])

    def test_of_a_replaced_map_no_answer_is_taken_for_one_of_the_old(self):
        self.new_store("replaced")
        with self.served("replaced") as url:
            self.go(url)
            self.window.wait(READY)
            self.rows()
            self.replace("replaced")
            self.window.run("document.querySelector('#table .link').click()")
            self.window.wait("document.body.dataset.state === 'error'")
            self.assertIn("replaced", self.text("banner"))
            self.assertEqual(0, self.window.run(
                "return document.querySelectorAll('#inspector .link').length"))
            self.window.run("document.querySelector('#banner button').click()")
            self.window.wait(READY)
            self.assertEqual("4", self.window.run(
                "return document.querySelector('#layers .count').textContent"))

    def test_a_lost_context_comes_back_with_its_picture(self):
        self.open()
        before = self.colors()
        self.assertGreater(before, 20)
        self.window.run(f"window.lost = {LOSE}; window.lost.loseContext()")
        self.window.wait("document.getElementById('scene').getContext('webgl2').isContextLost()")
        # The page is used while there is no picture.
        self.window.keys(",", "x", "x")
        self.window.run("window.lost.restoreContext()")
        self.window.wait("!document.getElementById('scene').getContext('webgl2').isContextLost()")
        self.assertGreater(self.colors(), 0.8 * before)
        self.assertEqual("ready", self.window.run("return document.body.dataset.state"))

    def test_a_damaged_map_says_what_is_wrong(self):
        self.new_store("damaged")
        path = self.path("damaged", "office", "graph.db")
        with open(path, "r+b") as file:
            for at in range(3 * PAGE_BYTES + 100, os.path.getsize(path), PAGE_BYTES):
                file.seek(at)
                byte = file.read(1)[0]
                file.seek(at)
                file.write(bytes([byte ^ 4]))
        with self.served("damaged") as url:
            self.go(url)
            self.window.wait("document.body.dataset.state === 'error'")
            banner = self.text("banner")
            self.assertIn("graph.db", banner)
            self.assertIn("not what was written", banner)

    def test_an_overloaded_server_is_asked_again(self):
        self.new_store("full")
        with self.served("full", "--max-watches", "1") as url:
            other = subprocess.Popen(
                [os.path.join(support.BIN, "dsg"), "watch", "--server", "unix:full.sock",
                 "--after", "0"], cwd=self.folder, env=support.environment(),
                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            try:
                other.stdout.readline()
                self.go(url + "&live=1")
                self.window.wait("document.body.dataset.state === 'away'")
                self.assertIn("--max-watches", self.text("banner"))
                self.assertGreater(self.colors(), 20)
            finally:
                other.terminate()
                other.wait(timeout=support.TIMEOUT_S)
                other.stdout.close()
            self.window.wait(READY)
            self.assertTrue(self.window.run("return document.getElementById('banner').hidden"))

    def test_a_selection_that_is_not_in_the_map_is_said_to_be_so(self):
        self.open("&sel=O999")
        self.assertIn("no node of map \"office\"", self.text("inspector"))
        self.assertIn("O999", self.text("inspector"))
        # A name stands for the node that has it.
        node = self.ask("ls", "--layer", "rooms", "--store", "store")["nodes"][0]
        self.open("&sel=" + urllib.parse.quote(node["name"]))
        self.assertEqual(node["id"], self.window.run(
            "return document.querySelector('#inspector dd').textContent"))
        self.window.wait(f"location.hash.includes('sel={node['id']}')")

    def test_a_time_outside_of_all_tracks_is_said_to_be_so(self):
        for seconds, shown in ((-100, "+0.0 s"), (100_000, "+9.9 s")):
            self.open(f"&at={self.at_ns(seconds)}")
            self.assertIn(f"true at {shown}", self.text("sentence"))
            self.assertIn("outside of the tracks", self.text("layers"))
        self.open(f"&at={self.at_ns(5)}")
        self.assertNotIn("outside of the tracks", self.text("layers"))


if __name__ == "__main__":
    unittest.main()
