# SPDX-License-Identifier: Apache-2.0
"""A bad link: passes bytes between a client and a server until it is told to misbehave.

Refuses to look into the bytes; only sockets of this machine.
"""

import asyncio
import random
import socket
import struct
import threading

CHUNK = 65536
DRIBBLE_CHUNK = 7
DRIBBLE_PAUSE_S = 0.002
# SO_LINGER of zero seconds: close() sends a reset instead of an orderly end.
RESET = struct.pack("ii", 1, 0)


class _Link:
    """One connection of a client and its counterpart to the server."""

    def __init__(self, client, upstream):
        self.client = client
        self.upstream = upstream

    def close(self, with_reset):
        for end in (self.client, self.upstream):
            if with_reset:
                try:
                    end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
                except OSError:
                    pass
            end.close()

    def shut(self, towards_server):
        end = self.upstream if towards_server else self.client
        try:
            end.shutdown(socket.SHUT_WR)
        except OSError:
            pass


class ChaosProxy:
    """Listens on a port of its own for `address` ("unix:PATH" or "HOST:PORT")."""

    FAULTS = ("cut", "reset", "half_close", "dribble", "black_hole", "refuse")

    def __init__(self, address):
        self._server_address = address
        self._links = set()
        self._is_dribbling = False
        self._is_refusing = False
        self.counts = {name: 0 for name in self.FAULTS}
        self._listener = socket.socket()
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._listener.bind(("127.0.0.1", 0))
        self._listener.listen(64)
        self._listener.setblocking(False)
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self._loop = asyncio.new_event_loop()
        self._flows = asyncio.Event()
        self._flows.set()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    # ---- What a test calls.

    def fault(self, name, seconds, rng=random):
        """One fault: lasting ones for `seconds`, and what it was is counted."""
        self.counts[name] += 1
        asyncio.run_coroutine_threadsafe(getattr(self, "_" + name)(seconds, rng),
                                         self._loop).result()

    def close(self):
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        for link in list(self._links):
            link.close(with_reset=True)
        self._listener.close()
        self._loop.close()

    # ---- The faults, on the loop's thread.

    async def _cut(self, _seconds, _rng):
        for link in list(self._links):
            link.close(with_reset=False)

    async def _reset(self, _seconds, _rng):
        for link in list(self._links):
            link.close(with_reset=True)

    async def _half_close(self, _seconds, rng):
        towards_server = rng.random() < 0.5
        for link in list(self._links):
            link.shut(towards_server)

    async def _dribble(self, seconds, _rng):
        self._is_dribbling = True
        await asyncio.sleep(seconds)
        self._is_dribbling = False

    async def _black_hole(self, seconds, rng):
        """Nothing passes; afterwards what waited passes, or the link is dead."""
        self._flows.clear()
        await asyncio.sleep(seconds)
        if rng.random() < 0.5:
            await self._reset(0, rng)
        self._flows.set()

    async def _refuse(self, seconds, rng):
        self._is_refusing = True
        await self._reset(0, rng)
        await asyncio.sleep(seconds)
        self._is_refusing = False

    # ---- The link itself.

    def _run(self):
        asyncio.set_event_loop(self._loop)
        self._loop.create_task(self._accept())
        self._loop.run_forever()
        tasks = asyncio.all_tasks(self._loop)
        for task in tasks:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))

    async def _accept(self):
        while True:
            client, _ = await self._loop.sock_accept(self._listener)
            if self._is_refusing:
                client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
                client.close()
                continue
            self._loop.create_task(self._serve(client))

    async def _connect(self):
        if self._server_address.startswith("unix:"):
            upstream = socket.socket(socket.AF_UNIX)
            target = self._server_address[len("unix:"):]
        else:
            upstream = socket.socket()
            host, port = self._server_address.rsplit(":", 1)
            target = (host, int(port))
        upstream.setblocking(False)
        try:
            await self._loop.sock_connect(upstream, target)
        except OSError:
            upstream.close()
            return None
        return upstream

    async def _serve(self, client):
        await self._flows.wait()
        upstream = await self._connect()
        if upstream is None:
            client.close()
            return
        link = _Link(client, upstream)
        self._links.add(link)
        try:
            await asyncio.gather(self._pump(client, upstream), self._pump(upstream, client))
        finally:
            self._links.discard(link)
            link.close(with_reset=False)

    async def _pump(self, source, sink):
        try:
            while True:
                await self._flows.wait()
                data = await self._loop.sock_recv(
                    source, DRIBBLE_CHUNK if self._is_dribbling else CHUNK)
                if not data:
                    break
                # What was read before the hole opened waits with the rest.
                await self._flows.wait()
                if self._is_dribbling:
                    await asyncio.sleep(DRIBBLE_PAUSE_S)
                await self._loop.sock_sendall(sink, data)
            sink.shutdown(socket.SHUT_WR)
        except (OSError, ValueError):
            # Closed under us by a fault; the other direction has nothing to say to anybody.
            for end in (source, sink):
                try:
                    end.shutdown(socket.SHUT_RDWR)
                except OSError:
                    pass
