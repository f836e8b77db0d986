#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Each scene of the viewer is reached and drawn; DSG_VIEWER_PICTURES=DIR keeps them to look at."""

import os
import unittest

import browser
import viewer_support
from viewer_support import READY


class Pictures(viewer_support.ViewerTest):
    @classmethod
    def make_store(cls):
        """An office with three revisions: as it was read, with a name, and with another name."""
        super().make_store()
        rooms = cls.ask("ls", "--kind", "room", "--store", "store")["nodes"]
        objects = cls.ask("ls", "--layer", "objects", "--store", "store")["nodes"]
        cls.room = max(rooms, key=lambda room: room["bounding_box"]["max"]["y"])["id"]
        cls.ok("dsg", "set", cls.room, "--name", "the den", "--store", "store")
        cls.ok("dsg", "tag", "named", "--store", "store", "--note", "with a den")
        for i, one in enumerate(objects[:5]):
            cls.ok("dsg", "set", one["id"], "--name", f"thing {i}", "--store", "store")
        cls.somebody = next(
            node["id"] for node in
            cls.ask("ls", "--layer", "agents", "--at", "+30s", "--store", "store")["nodes"]
            if node["kind"] == "human" and "map_T_node" in node)

    def setUp(self):
        self.at = f"&at={self.at_ns(30)}"

    def shown(self, name, more=""):
        """Opens the office so, and takes its picture once all of it is there."""
        self.open(self.at + more)
        self.settled(name)

    def settled(self, name):
        self.window.wait("!document.getElementById('sentence').textContent.includes('between')")
        # Two pictures later everything that was asked for is drawn.
        self.window.run("return new Promise((done) => requestAnimationFrame(() => "
                        "requestAnimationFrame(() => done())))")
        self.picture(name)

    def click(self, text):
        self.window.run("""[...document.querySelectorAll('#inspector button')].find(
            (one) => one.textContent === arguments[0]).click()""", text)
        self.window.wait("document.getElementById('answer')?.textContent")

    def test_in_place_and_apart(self):
        self.shown("in_place", "&hide=mesh,structures")
        self.shown("with_walls", "&hide=mesh")
        self.shown("apart", "&explode=1")

    def test_the_table(self):
        self.open(self.at)
        self.assertGreater(len(self.rows()), 100)
        self.settled("table")

    def test_what_is_selected(self):
        self.shown("person", f"&sel={self.somebody}")
        self.window.wait("document.querySelectorAll('#where .link').length > 0")
        self.click("predict")
        self.assertIn("%", self.text("answer"))
        self.settled("prediction")
        self.shown("room", f"&sel={self.room}")
        self.window.wait("document.querySelectorAll('#inspector .link').length > 3")
        self.click("path from the middle")
        self.assertIn("path of", self.text("answer"))
        self.settled("path")

    def test_a_search(self):
        self.shown("search", "&q=chair")
        self.assertRegex(self.text("found"), r"^[1-9]\d* found")
        self.shown("search_refused", "&q=chairr+onn+(tabel")
        self.assertNotIn("found", self.text("found"))

    def test_a_comparison(self):
        self.shown("comparison", "&diff=2")
        self.assertIn("since revision 2", self.text("found"))

    def test_live(self):
        self.shown("live", "&live=1")
        self.assertEqual("true", self.window.run(
            "return document.getElementById('live').getAttribute('aria-pressed')"))

    def test_help(self):
        self.open(self.at)
        self.window.keys("?")
        self.window.wait("document.getElementById('help').open")
        self.settled("help")

    def test_what_went_wrong(self):
        self.go(self.url + "&rev=99")
        self.window.wait("document.body.dataset.state === 'error'")
        self.picture("error")
        os.makedirs(self.path("none"))
        with self.served("none") as url:
            self.go(url)
            self.window.wait("document.body.dataset.state === 'no-maps'")
            self.picture("no_maps")

    def test_the_plan_without_webgl(self):
        plain = browser.Browser("--disable-3d-apis")
        try:
            self.window = plain
            self.open(f"{self.at}&sel={self.somebody}")
            self.assertEqual("1", plain.run("return document.body.dataset.plan"))
            self.assertIn("WebGL2", self.text("banner"))
            self.settled("plan")
        finally:
            del self.window
            plain.close()

    def test_a_narrow_window(self):
        self.window.resize(800, 600)
        try:
            self.shown("narrow", f"&sel={self.room}")
        finally:
            self.window.resize(1280, 800)


if __name__ == "__main__":
    unittest.main()
