# SPDX-License-Identifier: Apache-2.0
"""What the tests of the Python package share: where it is, a Python that has what a test needs, and
a server with an HTTP port.
"""

import contextlib
import importlib
import os
import re
import signal
import socket
import sys
import threading

import support

PACKAGE = os.path.join(support.ROOT, "query", "python")
sys.path.insert(0, PACKAGE)
# What dsgdb.open(FOLDER) starts.
os.environ["DSGDB_SERVER"] = os.path.join(support.BIN, "dsg-server")


def run_with(*modules):
    """Starts this program again under Debian's Python, if that one has the modules and this one
    has not: Debian's packages belong to it, and it need not be the first on the path.
    """
    debian = "/usr/bin/python3"
    if has(*modules) or os.environ.get("DSG_TEST_PYTHON") == debian or not os.path.exists(debian):
        return
    os.environ["DSG_TEST_PYTHON"] = debian
    os.execv(debian, [debian, *sys.argv])


def has(*modules):
    try:
        for module in modules:
            importlib.import_module(module)
    except ImportError:
        return False
    return True


class HttpTest(support.ProgramsTest):
    @classmethod
    @contextlib.contextmanager
    def http_server(cls, store, http, *options):
        """A server with an HTTP port that is ready; the value is the URL that it prints."""
        log_path = cls.path("http-server.log")
        with open(log_path, "w", encoding="utf-8") as log:
            process = support.start("dsg-server", "--store", store, "--listen", "unix:grpc.sock",
                                    "--http", http, *options, cwd=cls.folder, log=log)

        def said():
            with open(log_path, encoding="utf-8") as log:
                return log.read()

        try:
            support.wait_until(lambda: process.poll() is not None or "HTTP on " in said(),
                               "dsg-server to print its URL")
            found = re.search(r"HTTP on (\S+)\n", said())
            if found is None:
                raise AssertionError(f"dsg-server did not start:\n{said()}")
            yield found.group(1)
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
            process.wait(timeout=support.TIMEOUT_S)


class CuttingProxy:
    """Passes each call to a server on a unix socket, and cuts the connection before the answer of
    the first `cuts` ones has reached the client: the calls were made, and nobody knows.
    """

    def __init__(self, upstream, path, cuts):
        self.calls = 0
        self._upstream = upstream
        self._cuts = cuts
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(path)
        self._listener.listen()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self):
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._thread.join()

    def _run(self):
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            with client, socket.socket(socket.AF_UNIX) as server:
                server.connect(self._upstream)
                # One connection at a time; the client's calls follow one another.
                self._pass_calls(client, server)

    def _pass_calls(self, client, server):
        while True:
            request = self._message(client)
            if not request:
                return
            self.calls += 1
            server.sendall(request)
            answer = self._message(server)
            if self.calls <= self._cuts:
                return
            client.sendall(answer)

    @staticmethod
    def _message(end):
        """One HTTP message with a Content-Length."""
        data = b""
        while b"\r\n\r\n" not in data:
            more = end.recv(65536)
            if not more:
                return b""
            data += more
        head, _, body = data.partition(b"\r\n\r\n")
        length = int(re.search(rb"(?i)content-length: *(\d+)", head).group(1))
        while len(body) < length:
            body += end.recv(65536)
        return head + b"\r\n\r\n" + body
