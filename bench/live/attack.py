#!/usr/bin/env python3
"""What somebody hostile does to an innocent viewer: frames of a stream of 30 a second, as one viewer gets them, while
others attack the hub, all on this machine. It prints the gaps between frames, how often the viewer was sent away, and
the hub's memory.

usage: attack.py HTVM ATTACK [--seconds 20] [--realtime]

--realtime: hub, publisher and viewer come before whatever else runs on the machine, the attackers included (chrt)

  none      nobody attacks
  memory    who has a token for one stream opens 75 connections and sends 14 MB of a message on each, again and again
  list      a visitor asks for /api/files of a folder of 9,000 streams, 400 times at once, again and again
  streams   the same for /api/streams of 250 streams
  chains    who has a token sends 15,000 empty frames that later ones need, and goes on as fast as it can
  pings     viewers send pings and empty fragments as fast as they can
"""
import argparse
import json
import os
import struct
import subprocess
import sys
import tempfile
import threading
import time
import zlib

import hub_process as hubs
import publish

OPEN_MESSAGE = 14_000_000


def request(port, target, extra=""):
    return f"GET {target} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{extra}\r\n".encode()


def upgraded(port, target):
    line = publish.socket.create_connection(("127.0.0.1", port))
    line.sendall(request(port, target, "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                         "Sec-WebSocket-Key: aHR2bSBsaXZlIGJlbmNoIQ==\r\n"))
    line.recv(4096)
    return line


class Viewer(threading.Thread):
    """Notes when each frame came, and goes back when it is sent away."""

    def __init__(self, port):
        super().__init__(daemon=True)
        self.port, self.times, self.lost, self.ended = port, [], 0, False

    def run(self):
        while not self.ended:
            try:
                self.watch()
            except OSError:
                pass
            self.lost += not self.ended
            time.sleep(0.1)

    def watch(self):
        with publish.socket.create_connection(("127.0.0.1", self.port)) as line:
            line.sendall(request(self.port, "/watch/anna"))
            while not self.ended:
                data = line.recv(1 << 20)
                if not data:
                    return
                if b"HTVM" in data or b"\r\n" in data:
                    self.times.append(time.monotonic())


def forever(attack):
    """One attacker, who goes on whatever the hub does."""
    def run():
        while True:
            try:
                attack()
            except OSError:
                time.sleep(0.01)
    threading.Thread(target=run, daemon=True).start()


def memory(port, token):
    def hold():
        line = publish.connect(port, "eve", token, False)
        line.sendall(bytes([130, 255]) + struct.pack(">Q", OPEN_MESSAGE + 1000) + publish.MASK + bytes(OPEN_MESSAGE))
        while line.recv(4096):
            pass
    for _ in range(75):
        forever(hold)


def ask(port, target):
    def flood():
        line = publish.socket.create_connection(("127.0.0.1", port))
        line.sendall(request(port, target) * 20)
        line.shutdown(publish.socket.SHUT_WR)
        while line.recv(1 << 20):
            pass
    for _ in range(20):
        forever(flood)


def chains(port, token, stream):
    with open(stream, "rb") as file:
        frames = publish.frames_of(file.read())
    (sync, _, _, version, first, *_), _ = frames[0][-1]
    empty = struct.pack("<I", zlib.crc32(b""))

    def flood():
        line = publish.connect(port, "eve", token, False)
        threading.Thread(target=lambda: drain(line), daemon=True).start()
        for one in frames[0]:
            line.sendall(publish.websocket_message(publish.renumbered(one, 0, 0)))
        frame = first
        while True:
            batch = []
            for _ in range(100):
                frame += 1
                head = ((sync, publish.TRACKED, 0x80 | 2, version, frame, frame - 1, 0, 0), empty)
                batch.append(publish.websocket_message(publish.renumbered(head, 0, 0)))
            line.sendall(b"".join(batch))
    forever(flood)


def drain(line):
    try:
        while line.recv(65536):
            pass
    except OSError:
        pass


def pings(port):
    def flood(frames):
        def run():
            line = upgraded(port, "/watch/anna")
            threading.Thread(target=lambda: drain(line), daemon=True).start()
            while True:
                line.sendall(frames)
        return run
    ping, empty = bytes([0x89, 128]) + publish.MASK, bytes([0x00, 128]) + publish.MASK
    for _ in range(4):
        forever(flood(ping * 1000))
        forever(flood(bytes([0x01, 128]) + publish.MASK + empty * 1000))


def token_of(htvm, publishers, name):
    return hubs.run(htvm, "serve", "--publishers", publishers, "--add-publisher", name).strip()


def percentile(values, percent):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(len(ordered) * percent / 100))] if ordered else float("nan")


def measure(options):
    stream = hubs.stream_of(options.htvm, 1.6)
    with tempfile.TemporaryDirectory() as folder:
        publishers, served = os.path.join(folder, "publishers.json"), os.path.join(folder, "served")
        os.mkdir(served)
        if options.attack == "list":
            for i in range(9000):
                open(os.path.join(served, f"stream{i}.htvm"), "w").close()
        anna, eve = token_of(options.htvm, publishers, "anna"), token_of(options.htvm, publishers, "eve")
        others = [token_of(options.htvm, publishers, f"other{i}") for i in range(250)] \
            if options.attack == "streams" else []
        before = ["chrt", "-r", "10"] if options.realtime else []
        with hubs.started([*before, options.htvm, "serve", "--files", served, "--port", 0, "--publishers", publishers],
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as hub:
            port = int(hub.stdout.readline().rsplit(":", 1)[1].strip("/\n"))
            with open(stream, "rb") as file:
                begin = publish.frames_of(file.read())[0][:1]
            kept = []
            for i, token in enumerate(others):
                kept.append(publish.connect(port, f"other{i}", token, False))
                kept[-1].sendall(publish.websocket_message(publish.renumbered(begin[0], 0, 0)))
            with hubs.started([*before, sys.executable, os.path.join(hubs.FOLDER, "publish.py"), stream, "anna", port,
                               "--token", anna], stderr=subprocess.DEVNULL) as publisher:
                time.sleep(1)
                watching = hubs.started([*before, sys.executable, __file__, options.htvm, "watch", "--port", port,
                                         "--seconds", options.seconds], stdout=subprocess.PIPE, text=True)
                with watching as viewer:
                    time.sleep(1)
                    {"none": lambda: None, "memory": lambda: memory(port, eve),
                     "list": lambda: ask(port, "/api/files"), "streams": lambda: ask(port, "/api/streams"),
                     "chains": lambda: chains(port, eve, stream), "pings": lambda: pings(port)}[options.attack]()
                    most = 0
                    while viewer.poll() is None and hub.poll() is None:
                        most = max(most, hubs.memory_bytes(hub.pid))
                        time.sleep(0.1)
                    seen = json.loads(viewer.stdout.read() or "{}")
                seen["publisher sent away"] = publisher.poll() is not None
                seen["hub's memory, MB"] = round(most / 1e6)
    hubs.print_json({"attack": options.attack, **seen})
    os._exit(0)  # the attackers go on


def watch(options):
    viewer = Viewer(options.port)
    viewer.start()
    time.sleep(options.seconds)
    viewer.ended = True
    times = viewer.times + [time.monotonic()]
    gaps = [1000 * (b - a) for a, b in zip(times, times[1:])]
    hubs.print_json({"frames": len(gaps), "gap p50, ms": round(percentile(gaps, 50), 1),
                     "gap p99, ms": round(percentile(gaps, 99), 1), "longest gap, ms": round(max(gaps, default=0)),
                     "viewer sent away": viewer.lost})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("htvm")
    parser.add_argument("attack", choices=["none", "memory", "list", "streams", "chains", "pings", "watch"])
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--realtime", action="store_true")
    parser.add_argument("--port", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    (watch if options.attack == "watch" else measure)(options)


if __name__ == "__main__":
    main()
