#!/usr/bin/env python3
"""What an index of fragments would spare ffmpeg that takes one picture of an .mp4 by HTTP.

usage: fragment_index.py HTVM STREAM.htvm [SECOND]

The stream has pictures. It is packed with tables in front and in fragments of 1 s; to the latter a box `mfra` is added
behind, or `sidx` in front. For each file: requests and bytes that a slow server counts until ffmpeg has the picture at
that second (default: 50).
"""
import http.server
import os
import re
import struct
import subprocess
import sys
import tempfile
import threading
import time

MESHES, PICTURES = 1, 2  # numbers of tracks
TICKS = 1000000  # a second, in both


def box(kind, inside):
    return struct.pack(">I4s", len(inside) + 8, kind) + inside


def boxes(data, begin, end):
    """(kind, begin, begin of what is inside, end) of each; none has 4 GiB or more."""
    while begin + 8 <= end:
        size, kind = struct.unpack(">I4s", data[begin:begin + 8])
        yield kind, begin, begin + 8, begin + size
        begin += size


def fragments(data):
    """Of each: where it begins, and for both tracks when, and as which `traf`."""
    out = []
    for kind, begin, inside, end in boxes(data, 0, len(data)):
        if kind != b"moof":
            continue
        tracks, number = {}, 0
        for kind_of_run, _, run, run_end in boxes(data, inside, end):
            if kind_of_run != b"traf":
                continue
            number += 1
            parts = {part: data[at:to] for part, _, at, to in boxes(data, run, run_end)}
            track = struct.unpack(">I", parts[b"tfhd"][4:8])[0]
            tracks.setdefault(track, (struct.unpack(">Q", parts[b"tfdt"][4:12])[0], number))
        out.append((begin, tracks))
    return out


def with_mfra(data):
    tables = b""
    for track in (MESHES, PICTURES):
        found = [(tracks[track], begin) for begin, tracks in fragments(data) if track in tracks]
        entries = b"".join(struct.pack(">QQBBB", when, begin, number, 1, 1) for (when, number), begin in found)
        tables += box(b"tfra", struct.pack(">IIII", 1 << 24, track, 0, len(found)) + entries)
    return data + box(b"mfra", tables + box(b"mfro", struct.pack(">II", 0, len(tables) + 8 + 16)))


def with_sidx(data):
    found = fragments(data)
    ends = [begin for begin, _ in found[1:]] + [len(data)]

    def index(track, behind):
        times = [tracks[track][0] for _, tracks in found]
        times.append(times[-1] + TICKS)
        entries = b"".join(struct.pack(">III", end - begin, after - when, 0x90000000)
                           for (begin, _), end, when, after in zip(found, ends, times, times[1:]))
        return box(b"sidx", struct.pack(">IIIQQHH", 1 << 24, track, TICKS, times[0], behind, 0, len(found)) + entries)
    pictures = index(PICTURES, 0)
    first = found[0][0]
    return data[:first] + index(MESHES, len(pictures)) + pictures + data[first:]


class Counting(http.server.BaseHTTPRequestHandler):
    """At most 2 MB/s."""
    protocol_version = "HTTP/1.1"
    folder, requests, sent = "", 0, 0

    def log_message(self, *_):
        pass

    def do_GET(self):
        with open(os.path.join(Counting.folder, os.path.basename(self.path)), "rb") as file:
            data = file.read()
        asked = re.match(r"bytes=(\d+)-(\d*)", self.headers.get("Range", ""))
        begin = int(asked.group(1)) if asked else 0
        end = int(asked.group(2)) + 1 if asked and asked.group(2) else len(data)
        Counting.requests += 1
        self.send_response(206 if asked else 200)
        self.send_header("Accept-Ranges", "bytes")
        self.send_header("Content-Length", str(end - begin))
        if asked:
            self.send_header("Content-Range", f"bytes {begin}-{end - 1}/{len(data)}")
        self.end_headers()
        try:
            for at in range(begin, end, 4096):
                Counting.sent += self.wfile.write(data[at:min(at + 4096, end)])
                time.sleep(0.002)
        except OSError:
            self.close_connection = True


def main():
    htvm, stream, second = (sys.argv[1:] + ["50"])[:3]
    with tempfile.TemporaryDirectory() as Counting.folder:
        def place(name):
            return os.path.join(Counting.folder, name)
        subprocess.run([htvm, "pack", stream, "-o", place("in_front.mp4"), "--quiet"], check=True)
        subprocess.run([htvm, "pack", stream, "-o", place("fragments.mp4"), "--fragmented", "--fragment", "1", "--quiet"],
                       check=True)
        with open(place("fragments.mp4"), "rb") as file:
            plain = file.read()
        for name, data in ("with_mfra.mp4", with_mfra(plain)), ("with_sidx.mp4", with_sidx(plain)):
            with open(place(name), "wb") as file:
                file.write(data)
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Counting)
        server.daemon_threads = True
        threading.Thread(target=server.serve_forever, daemon=True).start()
        pictures = set()
        for name in "in_front.mp4", "fragments.mp4", "with_mfra.mp4", "with_sidx.mp4":
            Counting.requests = Counting.sent = 0
            said = subprocess.run(["ffmpeg", "-v", "error", "-ss", second, "-i",
                                   f"http://127.0.0.1:{server.server_port}/{name}", "-map", "0:v:1", "-frames:v", "1",
                                   "-f", "framemd5", "-"], check=True, stdout=subprocess.PIPE, text=True).stdout
            pictures.add(said.split()[-1])
            print(f"{name}: {os.path.getsize(place(name))} bytes, {Counting.requests} requests, {Counting.sent} bytes sent")
        print("the same picture in all" if len(pictures) == 1 else "the pictures differ")


if __name__ == "__main__":
    main()
