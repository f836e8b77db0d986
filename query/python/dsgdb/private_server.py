# SPDX-License-Identifier: Apache-2.0
"""A dsg-server for one process: on a unix socket in a folder that only its user can enter.

It ends with the process that started it, also when that is killed: a watcher holds the reading end
of a pipe of which the process holds the other one. When the pipe closes, for whatever reason, the
watcher stops the server and removes the folder. A signal at the parent's death (PR_SET_PDEATHSIG)
would not do: it comes when the thread that opened the store ends. What the process forks may ask
the server too; it holds the pipe as well, so that of a killed process it keeps the server.
"""

from __future__ import annotations

import os
import re
import shutil
import socket
import subprocess
import tempfile
import threading
import time
import weakref
from typing import Optional

from dsgdb.errors import FailedPrecondition, NotFound

_READY_S_MAX = 30.0
_STOP_S_MAX = 15.0
_LOG_BYTES_SHOWN = 2000

# The shell becomes the server, so that the process that is waited for is the server itself, and
# leaves a watcher behind. The watcher reads until the pipe closes. It stops its parent only while
# that is the server: a process that has the number of a dead one has other children.
_SCRIPT = """
folder=$1
shift
exec 3<&0
{
  read -r _ <&3
  read -r _ _ _ parent _ </proc/self/stat
  [ "$parent" != $$ ] || kill $$
  rm -rf "$folder"
} >/dev/null 2>&1 &
exec "$@" </dev/null 3<&-
"""


class PrivateServer:
    """A running server; `address` is where it answers."""

    def __init__(self, store: str, writable: bool) -> None:
        """Starts it and waits until it answers. Raises NotFound without a program or a store,
        FailedPrecondition if the server does not start.
        """
        if not os.path.isdir(store):
            place = os.path.basename(store)
            hint = (f"; if that is a server, write http://{place}"
                    if re.fullmatch(r".+:\d+", place) else "")
            raise NotFound(f"there is no store folder {store}; dsg-ingest and dsg-server make one"
                           f"{hint}", metadata={"store": store})
        program = find_program()
        self.folder = tempfile.mkdtemp(prefix="dsgdb-")
        self.store = store
        self.address = f"unix:{self.folder}/http"
        self._log_path = os.path.join(self.folder, "log")
        command = [program, "--store", store, "--listen", f"unix:{self.folder}/grpc",
                   "--http", self.address, "--http-no-token", "--log-level", "warning"]
        if writable:
            command.append("--http-write")
        reader, self._pipe = os.pipe()
        try:
            with open(self._log_path, "wb") as log:
                self._process = subprocess.Popen(
                    ["/bin/sh", "-c", _SCRIPT, "dsgdb", self.folder, *command], stdin=reader,
                    stdout=log, stderr=log, start_new_session=True)
        finally:
            os.close(reader)
        self._owner = os.getpid()
        self._lock = threading.Lock()
        self._end = weakref.finalize(self, _close_pipe, self._pipe, self._process, self.folder,
                                     self._owner)
        try:
            self._wait_until_ready()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Stops the server and waits for its end. In a forked child: only lets go of it."""
        with self._lock:
            self._end()

    def explain(self) -> str:
        """What to add to an error of the transport: whether the server has ended, and why."""
        if not self._end.alive:
            return "; the private dsg-server of this process is closed"
        if os.getpid() != self._owner or self._process.poll() is None:
            return ""
        return (f"; the private dsg-server of store {self.store} has ended with status "
                f"{self._process.returncode}; it said: {self._said()}")

    def _wait_until_ready(self) -> None:
        deadline = time.monotonic() + _READY_S_MAX
        while not _answers(f"{self.folder}/http"):
            if self._process.poll() is not None:
                raise FailedPrecondition(
                    f"dsg-server did not start on store {self.store} (status "
                    f"{self._process.returncode}); it said: {self._said()}")
            if time.monotonic() > deadline:
                raise FailedPrecondition(
                    f"dsg-server on store {self.store} does not answer after {_READY_S_MAX:.0f} s; "
                    f"it said: {self._said()}")
            time.sleep(0.005)

    def _said(self) -> str:
        try:
            with open(self._log_path, "rb") as log:
                text = log.read()[-_LOG_BYTES_SHOWN:].decode(errors="replace").strip()
        except OSError:
            text = ""
        return text or "nothing"


def find_program() -> str:
    """The path of dsg-server: DSGDB_SERVER, or the first on PATH. Raises NotFound."""
    named = os.environ.get("DSGDB_SERVER", "")
    found: Optional[str] = shutil.which(named or "dsg-server")
    if found:
        return os.path.abspath(found)
    if named:
        raise NotFound(f"DSGDB_SERVER names {named}, which is no program that can be run",
                       metadata={"DSGDB_SERVER": named})
    raise NotFound("a store folder is read by dsg-server, which is not on PATH; put it there, set "
                   "DSGDB_SERVER to its path, or open a running server (\"unix:PATH\", "
                   "\"http://127.0.0.1:8080#token=...\")")


def _answers(path: str) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        try:
            probe.connect(path)
        except OSError:
            return False
    return True


def _close_pipe(pipe: int, process: subprocess.Popen[bytes], folder: str, owner: int) -> None:
    os.close(pipe)
    if os.getpid() != owner:
        return
    # A forked child may hold the pipe.
    process.terminate()
    try:
        process.wait(_STOP_S_MAX)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    shutil.rmtree(folder, ignore_errors=True)
