# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium, driven by chromedriver over WebDriver's HTTP."""

import base64
import json
import re
import shutil
import subprocess
import time
import urllib.error
import urllib.request

WAIT_S = 60
FLAGS = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader", "--window-size=1280,800", "--force-device-scale-factor=1",
         "--no-first-run", "--disable-background-networking"]


def find_programs():
    """The browser and its driver; None where one is missing."""
    found = shutil.which("chromium"), shutil.which("chromedriver")
    return found if all(found) else None


class Browser:
    """One window; ends with `close`."""

    def __init__(self, *more_flags):
        chromium, driver = find_programs()
        self.driver = subprocess.Popen([driver, "--port=0"], stdout=subprocess.PIPE,
                                       stderr=subprocess.DEVNULL, text=True)
        for line in self.driver.stdout:
            port = re.search(r"started successfully on port (\d+)", line)
            if port:
                break
        self.base = f"http://127.0.0.1:{port[1]}"
        options = {"binary": chromium, "args": FLAGS + list(more_flags)}
        try:
            reply = self._post("/session", {"capabilities": {"alwaysMatch": {
                "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}}})
        except Exception:
            self._end_driver()
            raise
        self.base += f"/session/{reply['sessionId']}"

    def _post(self, path, body):
        request = urllib.request.Request(self.base + path, json.dumps(body).encode(),
                                         {"Content-Type": "application/json"})
        try:
            with urllib.request.urlopen(request, timeout=WAIT_S * 2) as reply:
                return json.load(reply)["value"]
        except urllib.error.HTTPError as error:
            raise AssertionError(error.read().decode()) from error

    def get(self, url):
        self._post("/url", {"url": url})

    def run(self, script, *arguments):
        """The value that a script returns."""
        return self._post("/execute/sync", {"script": script, "args": list(arguments)})

    def wait(self, condition, *arguments):
        """Asks a JavaScript expression until it is true; the page is said if it never is."""
        deadline = time.monotonic() + WAIT_S
        while not self.run(f"return Boolean({condition})", *arguments):
            if time.monotonic() > deadline:
                page = self.run("return JSON.stringify(document.body.dataset) + "
                                "document.body.innerText.slice(0, 500)")
                raise AssertionError(f"waited {WAIT_S} s for {condition}: {page}")
            time.sleep(0.05)

    def command(self, name, **parameters):
        """A command of the DevTools protocol, which has what WebDriver has not."""
        return self._post("/goog/cdp/execute", {"cmd": name, "params": parameters})

    def heap_bytes(self):
        """What the page's scripts hold, without what is waste."""
        self.command("HeapProfiler.enable")
        self.command("HeapProfiler.collectGarbage")
        return self.command("Runtime.getHeapUsage")["usedSize"]

    def new_window(self):
        """Opens another window, to which all further calls go, and gives its name. Tabs of one
        window would not do: without a screen they are all seen, or none.
        """
        name = self._post("/window/new", {"type": "window"})["handle"]
        self.switch(name)
        return name

    def switch(self, name):
        """Further calls go to this window, be it seen or not."""
        self._post("/window", {"handle": name})

    def this_window(self):
        """The name of the window to which calls go."""
        with urllib.request.urlopen(self.base + "/window", timeout=WAIT_S) as reply:
            return json.load(reply)["value"]

    def hide(self):
        """Its page is hidden then, as that of a tab behind another one is."""
        self._post("/window/minimize", {})
        self.wait("document.hidden")

    def show(self):
        self.resize(1280, 800)
        self.wait("!document.hidden")

    def resize(self, width, height):
        self._post("/window/rect", {"width": width, "height": height})

    def close_window(self):
        """Another one has to be chosen then."""
        request = urllib.request.Request(self.base + "/window", method="DELETE")
        urllib.request.urlopen(request, timeout=WAIT_S).close()

    def keys(self, *keys):
        """Presses keys, by their character."""
        actions = [{"type": kind, "value": key} for key in keys for kind in ("keyDown", "keyUp")]
        self._post("/actions", {"actions": [{"type": "key", "id": "keyboard",
                                             "actions": actions}]})

    def click(self, x, y):
        """Clicks at a point of the window, in pixels."""
        press = [{"type": "pointerMove", "x": int(x), "y": int(y), "duration": 0},
                 {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}]
        self._post("/actions", {"actions": [{
            "type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"},
            "actions": press}]})

    def picture(self):
        """The window as PNG bytes."""
        with urllib.request.urlopen(self.base + "/screenshot", timeout=WAIT_S) as reply:
            return base64.b64decode(json.load(reply)["value"])

    def messages(self):
        """What the page wrote to its console since the last call: errors, CSP reports."""
        return [one["message"] for one in self._post("/se/log", {"type": "browser"})]

    def close(self):
        # The driver alone would leave the browser behind.
        request = urllib.request.Request(self.base, method="DELETE")
        urllib.request.urlopen(request, timeout=WAIT_S).close()
        self._end_driver()

    def _end_driver(self):
        self.driver.terminate()
        self.driver.wait()
        self.driver.stdout.close()
