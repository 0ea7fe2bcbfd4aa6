#!/usr/bin/env python3
"""Three hubs joined by a real nats-server: what viewers of each are sent while the publisher moves to another hub, a hub
is killed, and NATS is killed and comes back. Every packet must be one of the publisher's, every frame decodable from
what came before it on the same connection, and frames flow again; how soon is printed.

usage: nats.py HTVM
"""
import base64
import contextlib
import hashlib
import json
import os
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
import zlib

SKIPPED = 77
FPS, GROUP = 30, 60  # an I-frame begins each group; the others refer to the one before
SEQUENCE, INTRA, TRACKED = 1, 2, 7
REFERRED, ACCESS, SESSION, TOLD = 1, 2, 16, 128
TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10
TRY_LATER, SHUT_DOWN, ENDED = 1013, 1001, 1000
NAME = "anna.berta"  # whose dot must not divide a subject


def packet(kind, flags, frame, reference, payload):
    head = struct.pack("<BBHIIqI", kind, flags | TOLD, 0, frame, reference, frame * 1_000_000 // FPS, len(payload))
    return b"HTVP" + head + struct.pack("<I", zlib.crc32(head)) + payload + struct.pack("<I", zlib.crc32(payload))


def header_packet():
    payload = b"the header of " + os.urandom(8).hex().encode()
    return packet(SEQUENCE, SESSION, 0, zlib.crc32(payload), payload)


def frame_packet(number):
    payload = hashlib.sha512(struct.pack("<I", number)).digest() * (100 if number % GROUP == 0 else 20)
    if number % (5 * GROUP) == 0:
        payload *= 110  # more than a part of a message between hubs, less than may wait for a viewer
    if number % GROUP == 0:
        return packet(INTRA, REFERRED | ACCESS, number, number, payload)
    return packet(TRACKED, REFERRED, number, number - 1, payload)


def kind_and_frame(data):
    return data[4], struct.unpack_from("<I", data, 8)[0]


class Closed(Exception):
    def __init__(self, code=None):
        super().__init__(f"closed with {code}")
        self.code = code


class Socket:
    """A WebSocket of a client."""

    def __init__(self, port, path):
        self.line = socket.create_connection(("127.0.0.1", port), 2)
        key = base64.b64encode(os.urandom(16)).decode()
        self.line.sendall((f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\n"
                           f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
                           "Sec-WebSocket-Protocol: htvm.1\r\n\r\n").encode())
        self.line.settimeout(3)  # of silence; docs/live.md, section 2
        self.bytes = b""
        while b"\r\n\r\n" not in self.bytes:
            self.fill()
        answer, self.bytes = self.bytes.split(b"\r\n\r\n", 1)
        if b" 101 " not in answer.split(b"\r\n")[0]:
            raise Closed()

    def fill(self):
        more = self.line.recv(1 << 20)
        if not more:
            raise Closed()
        self.bytes += more

    def take(self, count):
        while len(self.bytes) < count:
            self.fill()
        out, self.bytes = self.bytes[:count], self.bytes[count:]
        return out

    def send(self, kind, payload):
        size = len(payload)
        length = (struct.pack(">B", 128 | size) if size < 126 else
                  struct.pack(">BH", 254, size) if size < 65536 else struct.pack(">BQ", 255, size))
        self.line.sendall(bytes([128 | kind]) + length + b"\0\0\0\0" + payload)

    def receive(self):
        """The next message: (kind, payload)."""
        message = b""
        first = None
        while True:
            kind, size = self.take(2)
            size &= 127
            if size > 125:
                size = struct.unpack(">H", self.take(2))[0] if size == 126 else struct.unpack(">Q", self.take(8))[0]
            payload = self.take(size)
            if kind & 15 == PING:
                self.send(PONG, payload)
            elif kind & 15 == CLOSE:
                raise Closed(struct.unpack(">H", payload[:2])[0] if len(payload) > 1 else None)
            elif kind & 15 != PONG:
                first = first or kind & 15
                message += payload
                if kind & 128:
                    return first, message

    def close(self):
        with contextlib.suppress(OSError):
            self.line.close()


class Publisher(threading.Thread):
    """Publishes frames of its own; after its connection broke, to the next hub, beginning with what is needed."""

    def __init__(self, ports):
        super().__init__(daemon=True)
        self.ports, self.at, self.moves = ports, 0, False
        self.header = header_packet()
        self.sent, self.times = [], []  # by number of frame
        self.ends = self.ended_by = None

    def listen(self, line):
        try:
            while True:
                line.receive()
        except Closed as closed:
            self.ended_by = closed.code
        except OSError:
            pass
        line.close()

    def run(self):
        begin = time.monotonic()
        line = None
        while not self.ends:
            number = len(self.sent)
            time.sleep(max(0, begin + number / FPS - time.monotonic()))
            self.sent.append(frame_packet(number))
            self.times.append(time.monotonic())
            try:
                if self.moves:
                    line.line.shutdown(socket.SHUT_RDWR)  # as if the line had broken
                    line, self.moves, self.at = None, False, self.at + 1
                if line:
                    line.send(BINARY, self.sent[-1])
                    if number % FPS == 0:
                        line.send(TEXT, json.dumps({"type": "heartbeat", "clock": number * 1_000_000 // FPS}).encode())
                    continue
                line = Socket(self.ports[self.at % len(self.ports)], f"/publish/{NAME}")
                threading.Thread(target=self.listen, args=(line,), daemon=True).start()
                line.send(BINARY, self.header)
                for data in self.sent[number // GROUP * GROUP:]:
                    line.send(BINARY, data)
            except (OSError, Closed):
                line, self.at = None, self.at + 1


class Viewer(threading.Thread):
    def __init__(self, ports):
        super().__init__(daemon=True)
        self.ports, self.at = ports, 0
        self.connections = []  # lists of (time, packet)
        self.codes = []

    def run(self):
        while True:
            try:
                line = Socket(self.ports[self.at % len(self.ports)], f"/watch/{NAME}")
                self.connections.append([])
                while True:
                    kind, data = line.receive()
                    if kind == BINARY:
                        self.connections[-1].append((time.monotonic(), data))
            except Closed as closed:
                self.codes.append(closed.code)
                if closed.code not in (TRY_LATER, SHUT_DOWN, None):
                    return
            except OSError:
                pass
            time.sleep(0.1)
            self.at += 1

    def newest(self):
        """Number of the newest frame that came."""
        for connection in reversed(self.connections):
            if connection:
                return kind_and_frame(connection[-1][1])[1]
        return -1

    def check(self, publisher):
        """What it got is the publisher's, byte for byte, and each frame decodable."""
        got, own = hashlib.sha256(), hashlib.sha256()
        for connection in self.connections:
            had, header = set(), False
            for _, data in connection:
                kind, frame = kind_and_frame(data)
                got.update(data)
                own.update(publisher.header if kind == SEQUENCE else publisher.sent[frame])
                header = header or kind == SEQUENCE
                assert header, "a frame came before the header"
                assert kind != TRACKED or frame - 1 in had, f"frame {frame} cannot be decoded"
                assert kind == SEQUENCE or frame not in had, f"frame {frame} came twice"
                if kind != SEQUENCE:
                    had.add(frame)
        assert got.digest() == own.digest(), "a packet is not the publisher's"
        return sum(map(len, self.connections)), got.hexdigest()[:16]


def free_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


def streams_at(port):
    """What the hub lists, by name."""
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/streams", timeout=2) as answer:
        return {stream["name"]: stream for stream in json.load(answer)}


def has_nats(htvm):
    """Whether the program was built with it."""
    said = subprocess.run([htvm, "serve", "--port", "0", "--nats", "-"], capture_output=True, text=True).stderr
    return "built without NATS" not in said


class Machines:
    def __init__(self, htvm, folder):
        self.htvm, self.folder = htvm, folder
        self.nats_port, self.ports = free_port(), [free_port() for _ in range(3)]
        self.nats, self.hubs = None, [None] * 3

    def start_nats(self):
        self.nats = subprocess.Popen(["nats-server", "-a", "127.0.0.1", "-p", str(self.nats_port), "--user", "hubs",
                                      "--pass", "secret"], stderr=subprocess.DEVNULL)

    def start_hub(self, i):
        log = open(os.path.join(self.folder, f"hub{i}.log"), "ab")
        self.hubs[i] = subprocess.Popen(
            [self.htvm, "serve", "--port", str(self.ports[i]), "--nats", f"nats://hubs:secret@127.0.0.1:{self.nats_port}",
             "--hub-name", f"hub{i}", "--hub-url", f"ws://127.0.0.1:{self.ports[i]}"], stdout=log, stderr=log)

    def streams(self, i):
        return streams_at(self.ports[i])

    def end(self):
        for process in [self.nats, *self.hubs]:
            if process and process.poll() is None:
                process.kill()
                process.wait()


def wait_until(what, true, seconds=30.0):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, f"not within {seconds} s: {what}"
        time.sleep(0.02)


def back(what, publisher, viewers):
    """Until each viewer was sent a frame that was published after now."""
    begin, number = time.monotonic(), len(publisher.sent)
    took = []
    for viewer in viewers:
        wait_until(f"{what}: viewer {viewers.index(viewer)} sees what is new", lambda: viewer.newest() >= number)
        took.append(time.monotonic() - begin)
    print(f"{what}: back within {max(took):.2f} s", flush=True)


def run(machines):
    machines.start_nats()
    for i in range(3):
        machines.start_hub(i)
    for i in range(3):
        wait_until(f"hub {i} serves", lambda: machines.hubs[i].poll() is None and reachable(machines.ports[i]))
    a, b, c = machines.ports
    publisher = Publisher([a, b, c])
    publisher.start()
    for i in range(3):
        wait_until(f"hub {i} lists the stream", lambda: NAME in machines.streams(i))
    viewers = [Viewer(ports) for ports in ([a, b, c], [b, c, a], [c, a, b])]
    for viewer in viewers:
        viewer.start()
    back("three viewers on three hubs", publisher, viewers)
    time.sleep(2)

    publisher.moves = True
    back("the publisher moves to the second hub", publisher, viewers)
    time.sleep(2)

    machines.hubs[1].kill()
    back("the second hub is killed", publisher, viewers)
    machines.start_hub(1)
    wait_until("the second hub lists the stream again", lambda: reachable(b) and NAME in machines.streams(1))
    late = Viewer([b])
    late.start()
    back("a viewer comes to the second hub", publisher, [late])

    machines.nats.kill()
    machines.nats.wait()
    time.sleep(1)
    back("without NATS, the publisher's hub", publisher, [viewers[2]])
    stale = late.newest()
    time.sleep(3)
    assert late.newest() == stale, "nothing can come over without NATS"
    machines.start_nats()
    back("NATS is back", publisher, [*viewers, late])
    assert late.connections[0] and len(late.connections) == 1, "its connection outlived NATS"

    time.sleep(1)
    publisher.ends = True
    publisher.join()
    time.sleep(1)
    for i, viewer in enumerate([*viewers, late]):
        packets, digest = viewer.check(publisher)
        assert viewer.newest() == len(publisher.sent) - 1, f"viewer {i} lacks the end"
        print(f"viewer {i}: {packets} packets over {len(viewer.connections)} connections, sha256 {digest}…, as published")


def reachable(port):
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 0.2):
        return True
    return False


def main():
    htvm = sys.argv[1]
    if not shutil.which("nats-server"):
        print("Skipped: there is no nats-server.")
        return SKIPPED
    if not has_nats(htvm):
        print("Skipped: this htvm was built without NATS.")
        return SKIPPED
    with tempfile.TemporaryDirectory() as folder:
        machines = Machines(htvm, folder)
        try:
            run(machines)
        except BaseException:
            for i in range(3):
                with contextlib.suppress(OSError), open(os.path.join(folder, f"hub{i}.log"), encoding="utf-8") as log:
                    print(f"--- hub {i}\n{log.read()}", file=sys.stderr)
            raise
        finally:
            machines.end()
    return 0


if __name__ == "__main__":
    sys.exit(main())
