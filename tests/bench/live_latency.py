#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How late a map is while its log is being recorded: from a measurement to the answer about it.

    tests/bench/live_latency.py --bag sim/log.bag [--bin build/release/bin] [--folder live-data]
        [--speed 1] [--json FILE] [-- DSG-INGEST-OPTION...]

Writes the bag (ROS 1, as `dsg-simulate sensors --bag` makes it) as MCAP at the pace of its
stamps, lets `dsg-ingest --follow` read it while it grows and commit through a dsg-server, and
asks that server where the robot is at the stamp of each image: not before the image is in the
file, and until there is an answer. Prints median and percentiles of the times between both.
Images of the first three seconds, in which dsg-ingest finds out what the log has, are left out.
Exits with 1 if an image has no answer at the end.

Needs python3-grpcio, protoc with its Python plugin, and liblz4.
"""

import argparse
import bisect
import ctypes
import json
import pathlib
import shutil
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
NS_PER_S = 1_000_000_000
LEFT_OUT_S = 3.5
# What comes later than this is told to be without an answer.
PATIENCE_S = 30.0


def unpacked(data, size):
    """An LZ4 frame."""
    lz4 = ctypes.CDLL("liblz4.so.1")
    context = ctypes.c_void_p()
    lz4.LZ4F_createDecompressionContext(ctypes.byref(context), 100)
    out, done, taken = ctypes.create_string_buffer(size), 0, 0
    source = ctypes.create_string_buffer(data, len(data))
    while taken < len(data) and done < size:
        room, given = ctypes.c_size_t(size - done), ctypes.c_size_t(len(data) - taken)
        lz4.LZ4F_decompress(context, ctypes.byref(out, done), ctypes.byref(room),
                            ctypes.byref(source, taken), ctypes.byref(given), None)
        if not room.value and not given.value:
            sys.exit("a chunk of the bag cannot be unpacked")
        done, taken = done + room.value, taken + given.value
    lz4.LZ4F_freeDecompressionContext(context)
    return out.raw


def records(data):
    """Of a ROS 1 bag: (fields, content)."""
    at = 0
    while at < len(data):
        (size,) = struct.unpack_from("<I", data, at)
        at, end, fields = at + 4, at + 4 + size, {}
        while at < end:
            (length,) = struct.unpack_from("<I", data, at)
            name, value = data[at + 4:at + 4 + length].split(b"=", 1)
            fields[name.decode()] = value
            at += 4 + length
        (size,) = struct.unpack_from("<I", data, at)
        yield fields, data[at + 4:at + 4 + size]
        at += 4 + size


def text(string):
    encoded = string if isinstance(string, bytes) else string.encode()
    return struct.pack("<I", len(encoded)) + encoded


def mcap(kind, content):
    return struct.pack("<BQ", kind, len(content)) + content


class Recording:
    """A bag as records of MCAP: those before the first message, and the messages by time."""

    def __init__(self, path):
        data = path.read_bytes()
        magic = b"#ROSBAG V2.0\n"
        if not data.startswith(magic):
            sys.exit(f"{path} is no bag of ROS 1")
        self.topics = {}
        self.head = b"\x89MCAP0\r\n" + mcap(1, text("ros1") + text("live_latency"))
        self.messages = []
        self.take(data[len(magic):])
        self.messages.sort(key=lambda message: message[0])

    def take(self, data):
        for fields, content in records(data):
            kind = fields["op"][0]
            if kind == 5:
                (size,) = struct.unpack("<I", fields["size"])
                is_packed = fields["compression"] == b"lz4"
                self.take(unpacked(content, size) if is_packed else content)
            elif kind == 7:
                self.add_topic(struct.unpack("<I", fields["conn"])[0], fields["topic"].decode(),
                               dict(next(records(struct.pack("<I", len(content)) + content +
                                                 struct.pack("<I", 0)))[0]))
            elif kind == 2:
                self.add_message(fields, content)

    def add_topic(self, number, topic, fields):
        if number in self.topics:
            return
        self.topics[number] = topic
        self.head += mcap(3, struct.pack("<H", number + 1) + text(fields["type"]) +
                          text("ros1msg") + text(fields["message_definition"]))
        self.head += mcap(4, struct.pack("<HH", number, number + 1) + text(topic) + text("ros1") +
                          text(""))

    def add_message(self, fields, content):
        (number,) = struct.unpack("<I", fields["conn"])
        seconds, nanoseconds = struct.unpack("<II", fields["time"])
        time_ns = seconds * NS_PER_S + nanoseconds
        head = struct.pack("<HIQQ", number, len(self.messages) % 2**32, time_ns, time_ns)
        self.messages.append((time_ns, self.topics[number], mcap(5, head + content)))


class Player(threading.Thread):
    """Appends messages to a file when their time has come."""

    def __init__(self, recording, path, speed):
        super().__init__(daemon=True)
        self.recording, self.path, self.speed = recording, path, speed
        self.begin_s = 0.0
        self.first_ns = recording.messages[0][0]
        self.largest_lag_s = 0.0

    def due_s(self, time_ns):
        return self.begin_s + (time_ns - self.first_ns) / NS_PER_S / self.speed

    def start(self):
        self.begin_s = time.monotonic() + 0.5
        super().start()

    def run(self):
        with open(self.path, "ab", buffering=0) as f:
            for time_ns, _, data in self.recording.messages:
                wait = self.due_s(time_ns) - time.monotonic()
                if wait > 0:
                    time.sleep(wait)
                self.largest_lag_s = max(self.largest_lag_s, -wait)
                f.write(data)
            # The end of the data, and of the file.
            f.write(mcap(15, struct.pack("<I", 0)) +
                    mcap(2, struct.pack("<QQI", 0, 0, 0)) + b"\x89MCAP0\r\n")


def service(folder, address):
    """The query service of a server, and its module of messages."""
    import grpc  # pylint: disable=import-outside-toplevel
    protos = sorted(str(p.relative_to(ROOT / "proto")) for p in ROOT.glob("proto/dsg/v1/*.proto"))
    subprocess.run(["protoc", "-I", str(ROOT / "proto"), f"--python_out={folder}",
                    f"--grpc_out={folder}", "--plugin=protoc-gen-grpc=/usr/bin/grpc_python_plugin",
                    *protos], check=True)
    sys.path.insert(0, str(folder))
    from dsg.v1 import query_service_pb2, query_service_pb2_grpc
    channel = grpc.insecure_channel(address)
    return query_service_pb2_grpc.QueryServiceStub(channel), query_service_pb2, grpc.RpcError


def is_answered(stub, messages, error, time_ns):
    try:
        reply = stub.LocateAgent(
            messages.LocateAgentRequest(map="m", agent="r0", at_ns=time_ns), timeout=5.0)
    except error:
        return False
    return reply.HasField("pose")


def measure(stamps, player, ask):
    """Seconds from each stamp until its answer; those without one are left out."""
    latencies = []
    for count, time_ns in enumerate(stamps):
        while time.monotonic() < player.due_s(time_ns):
            time.sleep(0.001)
        while not ask(time_ns):
            if time.monotonic() > player.due_s(time_ns) + PATIENCE_S:
                return latencies
            time.sleep(0.005)
        latencies.append(time.monotonic() - player.due_s(time_ns))
        if count % 100 == 99:
            print(f"{count + 1} of {len(stamps)} images", file=sys.stderr, flush=True)
    return latencies


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def run(arguments, work):
    recording = Recording(arguments.bag)
    images = sorted({time_ns for time_ns, topic, _ in recording.messages
                     if topic.endswith("left_cam/mono/image_raw")})
    images = images[bisect.bisect(images, images[0] + LEFT_OUT_S * NS_PER_S):]
    arguments.folder.mkdir(parents=True, exist_ok=True)
    store, log = arguments.folder / "store", arguments.folder / "live.mcap"
    shutil.rmtree(store, ignore_errors=True)
    store.mkdir()
    log.write_bytes(recording.head)
    address = f"unix:{work}/dsg.sock"
    player = Player(recording, log, arguments.speed)
    processes = []
    try:
        server = subprocess.Popen([arguments.bin / "dsg-server", "--store", store, "--listen",
                                   address, "--log-level", "error"], stdout=subprocess.PIPE)
        processes.append(server)
        server.stdout.readline()
        stub, messages, error = service(work, address)
        player.start()
        with open(arguments.folder / "ingest.log", "w", encoding="utf-8") as said:
            ingest = subprocess.Popen(
                [arguments.bin / "dsg-ingest", "--server", address, "--map", "m", "--follow",
                 "--quiet", *arguments.ingest, log], stdout=said, stderr=said)
        processes.append(ingest)
        latencies = measure(images, player, lambda t: is_answered(stub, messages, error, t))
        status = ingest.wait(timeout=PATIENCE_S * 20)
    finally:
        for process in processes:
            if process.poll() is None:
                process.terminate()
                process.wait()
        log.unlink()
    return {"images": len(images), "answered": len(latencies), "ingest_status": status,
            "median_s": statistics.median(latencies), "p90_s": quantile(latencies, 0.9),
            "p99_s": quantile(latencies, 0.99), "max_s": max(latencies),
            "p99_later_s": quantile(latencies[len(latencies) // 2:], 0.99),
            "player_late_s": player.largest_lag_s}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--bag", type=pathlib.Path, required=True)
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build/release/bin")
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path("live-data"))
    parser.add_argument("--speed", type=float, default=1.0)
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("ingest", nargs="*", help="options of dsg-ingest, after --")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="dsg-live-") as work:
        found = run(arguments, pathlib.Path(work))
    if arguments.json:
        arguments.json.write_text(json.dumps(found))
    print(f"{found['answered']} of {found['images']} images answered; from image to answer: "
          f"median {found['median_s']:.2f} s, p90 {found['p90_s']:.2f}, p99 {found['p99_s']:.2f} "
          f"(of the second half {found['p99_later_s']:.2f}), largest {found['max_s']:.2f}; "
          f"the log was written at most {found['player_late_s']:.2f} s late; "
          f"dsg-ingest: exit {found['ingest_status']}")
    return 0 if found["answered"] == found["images"] and found["ingest_status"] == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
