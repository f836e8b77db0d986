# SPDX-License-Identifier: Apache-2.0
"""What the tests of the viewer share: a browser, servers with the addresses that they print, and
what the page shows.
"""

import contextlib
import os
import re
import subprocess
import unittest

import browser
import support

PICTURES = os.environ.get("DSG_VIEWER_PICTURES", "")
READY = "document.body.dataset.state === 'ready'"
ESCAPE = "\ue00c"


@unittest.skipUnless(browser.find_programs(), "chromium and chromium-driver are not installed")
class ViewerTest(support.ProgramsTest):
    """A browser of its own for each class, and an office in the folder `store` that is served."""

    FLAGS = ()
    PEOPLE = 6
    SECONDS = 60

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.make_store()
        cls.window = browser.Browser(*cls.FLAGS)
        cls.addClassCleanup(cls.window.close)
        served = contextlib.ExitStack()
        cls.addClassCleanup(served.close)
        cls.url = served.enter_context(cls.served("store"))
        cls.epoch_ns = int(cls.ask("maps", "--store", "store")["maps"][0]["epoch_ns"])

    @classmethod
    def make_store(cls):
        cls.ingest("store", cls.simulate("office", people=cls.PEOPLE, seconds=cls.SECONDS))

    @classmethod
    @contextlib.contextmanager
    def served(cls, store, *options):
        """The address that a server of the store prints for browsers."""
        process = subprocess.Popen(
            [os.path.join(support.BIN, "dsg-server"), "--store", store, "--listen",
             f"unix:{store}.sock", "--http", "127.0.0.1:0", *options],
            cwd=cls.folder, env=support.environment(), stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, text=True)
        try:
            for line in process.stdout:
                address = re.search(r"http://\S+#token=\S+", line)
                if address:
                    break
            yield address[0]
        finally:
            process.terminate()
            process.wait(timeout=support.TIMEOUT_S)
            process.stdout.close()

    @classmethod
    def at_ns(cls, seconds):
        """World time of the office so many seconds after its epoch."""
        return cls.epoch_ns + seconds * support.NS_PER_S

    def go(self, address):
        """Opens an address as a page of its own: of the same one a browser would keep the page."""
        self.window.get("about:blank")
        self.window.get(address)

    def open(self, more=""):
        self.go(self.url + more)
        self.window.wait(READY)

    def text(self, name):
        """Text of the element with this id."""
        return self.window.run("return document.getElementById(arguments[0]).textContent", name)

    def rows(self):
        """The cells of the table's rows, without its head; opens the table if it is not."""
        if self.window.run("return document.getElementById('table').hidden"):
            self.window.keys("t")
        return self.window.run("""
            return [...document.querySelectorAll('#table tr')].slice(1).map(
                (row) => [...row.cells].map((cell) => cell.textContent.trim()));""")

    def picture(self, name):
        """Kept where DSG_VIEWER_PICTURES says, to be looked at."""
        shot = self.window.picture()
        self.assertGreater(len(shot), 10_000)
        if PICTURES:
            with open(os.path.join(PICTURES, name + ".png"), "wb") as out:
                out.write(shot)

    def colors(self):
        """How many different colours the scene has: one of nothing but background has one."""
        return self.of_picture("""
          const seen = new Set();
          for (let i = 0; i < data.length; i += 4) {
            seen.add(data[i] << 16 | data[i + 1] << 8 | data[i + 2]);
          }
          return seen.size;""")

    def spots(self, color):
        """How many squares of three by three pixels of the whole map have this colour, [r, g, b]: a
        line of one pixel has none.
        """
        return self.of_picture("""
          const is = (x, y) => [0, 1, 2].every(
              (k) => data[4 * (y * width + x) + k] === argument[k]);
          const near = [-1, 0, 1];
          let count = 0;
          for (let y = 1; y + 1 < height; ++y) {
            for (let x = 1; x + 1 < width; ++x) {
              count += is(x, y) && near.every((i) => near.every((k) => is(x + i, y + k)));
            }
          }
          return count;""", color)

    def of_picture(self, script, argument=None):
        """What a script says of the pixels of the whole map, `data` of `width` and `height`."""
        return self.window.run("const read = (data, width, height, argument) => {" + script + "};"
                               """
          const of = document.getElementById('scene');
          const to = document.createElement('canvas');
          [to.width, to.height] = [of.width, of.height];
          // WebGL forgets a picture once it was shown: this one is drawn anew, and read with it.
          document.dispatchEvent(new KeyboardEvent('keydown', {key: 'f'}));
          return new Promise((done) => requestAnimationFrame(() => {
            const context = to.getContext('2d');
            context.drawImage(of, 0, 0);
            const {data, width, height} = context.getImageData(0, 0, to.width, to.height);
            done(read(data, width, height, arguments[0]));
          }));""", argument)
