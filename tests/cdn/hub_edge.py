#!/usr/bin/env python3
"""examples/cdn/hub.conf with a real nginx before a real hub: what viewers cost the hub, with and without the edge.

usage: hub_edge.py HTVM [VIEWERS [SECONDS]]

A stream is published to htvm serve --segments. So many viewers (default: 40) fetch the playlist each second, and each
segment that it has anew, for so long (default: 6 s): first from the hub, then through the edge. Then hub and edge are
killed and started again, and links are checked. Exits with 77 where there is no nginx.
"""
import asyncio
import concurrent.futures
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

EXAMPLE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples", "cdn", "hub.conf")
HUB, EDGE = 18180, 18188
QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}


def get(port, path, timeout=15):
    with urllib.request.urlopen(f"http://127.0.0.1:{port}{path}", timeout=timeout) as answer:
        return answer.read(), answer.headers


def status(port, path):
    try:
        get(port, path)
        return 200
    except urllib.error.HTTPError as error:
        return error.code
    except OSError:
        return 0


def wait_for(what, condition, seconds=30):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return
        time.sleep(0.1)
    raise AssertionError(f"{what} has not come within {seconds} seconds")


def names_in(playlist):
    maps = re.findall(r'MAP:URI="([^"]+)"', playlist)
    return maps + [line for line in playlist.splitlines() if line and not line.startswith("#")]


def counted():
    """The hub's requests and bytes for segments so far."""
    text = get(HUB, "/metrics")[0].decode()
    requests = sum(int(count) for count in re.findall(r"^htvm_segments_requests_total\{.*\} (\d+)", text, re.M))
    sent = re.search(r"^htvm_segments_sent_bytes_total (\d+)", text, re.M)
    return requests, int(sent.group(1)) if sent else 0


class Viewer:
    """One connection, kept alive, as a player has it."""

    def __init__(self, port, prefix):
        self.port, self.prefix = port, prefix
        self.requests = self.bytes = self.failed = 0
        self.slowest = 0.0
        self.had = set()

    async def fetch(self, name):
        begun = time.monotonic()
        self.writer.write(f"GET {self.prefix}/{name} HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\n\r\n".encode())
        head = (await self.reader.readuntil(b"\r\n\r\n")).decode()
        length = int(re.search(r"content-length: (\d+)", head, re.I).group(1))
        body = await self.reader.readexactly(length)
        self.requests += 1
        self.bytes += length
        self.slowest = max(self.slowest, time.monotonic() - begun)
        if " 200 " not in head.split("\r\n")[0] + " ":
            self.failed += 1
        return body

    async def watch(self, number, viewers, seconds):
        await asyncio.sleep(number / viewers)  # they do not ask all at the same moment
        end = time.monotonic() + seconds
        self.reader, self.writer = await asyncio.open_connection("127.0.0.1", self.port)
        while time.monotonic() < end:
            due = time.monotonic() + 1
            names = names_in((await self.fetch("stream.m3u8")).decode())
            for name in [name for name in names if name not in self.had][-4:]:
                await self.fetch(name)
            self.had.update(names)
            await asyncio.sleep(max(0, due - time.monotonic()))
        self.writer.close()


def measure(what, port, viewers, seconds, prefix="/hls/anna"):
    async def all_of_them():
        people = [Viewer(port, prefix) for _ in range(viewers)]
        await asyncio.gather(*(one.watch(i, viewers, seconds) for i, one in enumerate(people)))
        return people
    before = counted()
    people = asyncio.run(all_of_them())
    after = counted()
    requests, sent = after[0] - before[0], after[1] - before[1]
    slowest = sorted(one.slowest for one in people)
    print(f"{what}: {viewers} viewers had {sum(one.requests for one in people)} answers, "
          f"{sum(one.bytes for one in people)} bytes; the hub gave {requests} answers, {sent} bytes; each viewer's "
          f"slowest answer: half within {slowest[len(slowest) // 2] * 1000:.0f} ms, all within "
          f"{slowest[-1] * 1000:.0f} ms; {sum(one.failed for one in people)} failed")
    assert sum(one.failed for one in people) == 0
    return requests, sent


def configuration(work):
    with open(EXAMPLE, encoding="utf-8") as file:
        text = file.read()
    text = text.replace("/var/lib/nginx", f"{work}/cache").replace("127.0.0.1:8080", f"127.0.0.1:{HUB}")
    text = text.replace("listen 8088", f"listen 127.0.0.1:{EDGE}").replace("worker_rlimit_nofile 65536;", "")
    temporary = "".join(f"    {name}_temp_path {work}/temporary_{name};\n"
                        for name in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
    text = text.replace("http {\n", "http {\n" + temporary, 1)
    return f"user root;\ndaemon off;\npid {work}/nginx.pid;\nerror_log {work}/error.log;\n" + text


class Bench:
    def __init__(self, htvm, work):
        self.htvm, self.work, self.running = htvm, work, {}

    def start(self, name, command, ready=None):
        self.running[name] = subprocess.Popen(command, **QUIET)
        if ready:
            wait_for(name, ready)

    def kill(self, name):
        process = self.running.pop(name)
        process.kill()
        process.wait()

    def stop(self, name):
        """nginx's workers end with it when it is told to."""
        process = self.running.pop(name)
        process.terminate()
        process.wait()

    def start_hub(self, *more):
        self.start("hub", [self.htvm, "serve", "--port", str(HUB), "--segments", "1", "--window", "10",
                           "--trust-proxy", "127.0.0.1", *more], lambda: status(HUB, "/healthz") == 200)

    def start_publisher(self):
        self.start("publisher", [self.htvm, "publish", f"{self.work}/walk.htvm",
                                 f"ws://127.0.0.1:{HUB}/publish/anna", "--loop"])

    def start_edge(self):
        self.start("edge", ["nginx", "-p", self.work, "-c", f"{self.work}/nginx.conf", "-e", f"{self.work}/error.log"],
                   lambda: status(EDGE, "/nothing") == 404)

    def end(self):
        for name in list(self.running):
            self.stop(name)


def number_of(playlist):
    return int(re.search(r"#EXT-X-MEDIA-SEQUENCE:(\d+)", playlist.decode()).group(1))


def check_failures(bench):
    path = "/hls/anna/stream.m3u8"
    before = get(EDGE, path)[0]
    for name in names_in(before.decode()):
        get(EDGE, f"/hls/anna/{name}")
    bench.kill("hub")
    time.sleep(2)
    answer, headers = get(EDGE, path)
    assert headers["X-Cache"] in ("STALE", "UPDATING"), headers["X-Cache"]
    for name in names_in(before.decode()):
        get(EDGE, f"/hls/anna/{name}")
    print("while the hub is away its edge hands out the last playlist, and the segments that somebody had")
    bench.start_hub()
    begun = time.monotonic()
    wait_for("the stream behind the edge", lambda: number_of(get(EDGE, path)[0]) > number_of(answer), 60)
    print(f"the stream goes on {time.monotonic() - begun:.1f} s after the hub was started again")

    names = names_in(get(EDGE, path)[0].decode())
    for name in names:
        get(EDGE, f"/hls/anna/{name}")
    bench.stop("edge")
    assert status(EDGE, path) == 0
    assert status(HUB, path) == 200
    requests = counted()[0]
    bench.start_edge()
    assert all(status(EDGE, f"/hls/anna/{name}") == 200 for name in names)
    asked = counted()[0] - requests - 1
    assert asked <= 0, f"the hub is asked {asked} times for what the edge has on its disk"
    print(f"an edge that was started again has {len(names)} files on its disk, for which it does not ask again")


def check_links(bench):
    keys = f"{bench.work}/keys.json"
    subprocess.run([bench.htvm, "serve", "--link-keys", keys, "--add-link-key"], check=True, **QUIET)
    bench.stop("publisher")
    bench.stop("hub")
    bench.start_hub("--link-keys", keys, "--parts", "0.3")
    bench.start_publisher()

    def link(name):
        made = subprocess.run([bench.htvm, "link", name, "--for", "1h", "--keys", keys, "--segments"], check=True,
                              stdout=subprocess.PIPE, text=True)
        return re.sub(r"^http://[^/]+", "", made.stdout.strip())
    good, other = link("anna"), link("berta").replace("berta", "anna")
    wait_for("the stream by link", lambda: status(HUB, good) == 200)
    assert status(EDGE, good) == 200
    assert status(EDGE, other) == 403, status(EDGE, other)
    assert status(HUB, "/hls/anna/stream.m3u8") == 403
    ladder, headers = get(EDGE, good.replace("stream.m3u8", "master.m3u8"))
    assert names_in(ladder.decode()) == ["stream.m3u8"] and headers["Cache-Control"] == "public, max-age=1"
    assert status(EDGE, other.replace("stream.m3u8", "master.m3u8")) == 403
    for name in names_in(get(EDGE, good)[0].decode()):
        get(EDGE, good.replace("stream.m3u8", name))
    # Another link has from the cache what this one has fetched, and one that is none has nothing of it.
    before = counted()[0]
    second = link("anna")
    segment = names_in(get(EDGE, good)[0].decode())[-1]
    get(EDGE, second.replace("stream.m3u8", segment))
    assert get(EDGE, second.replace("stream.m3u8", segment))[1]["X-Cache"] == "HIT"
    assert status(EDGE, other.replace("stream.m3u8", segment)) == 403
    assert counted()[0] - before <= 3, counted()[0] - before
    print("links are checked by the hub once, and what is behind them is kept once")
    check_parts(good)


def check_parts(playlist):
    """Who has the playlist asks for the part that is next, and has it as soon as it is there."""
    text = get(HUB, playlist)[0].decode()  # the edge's may be a second old
    number = number_of(text.encode()) + len(re.findall("#EXTINF", text))
    before = counted()[0]
    with concurrent.futures.ThreadPoolExecutor(20) as pool:
        asked = f"{playlist}?_HLS_msn={number + 1}&_HLS_part=0"
        seen = {body for body, _ in pool.map(lambda _: get(EDGE, asked), range(20))}
    assert len(seen) == 1 and f"/{number + 1}-" in "/" + "/".join(re.findall(r'PART:.*URI="([^"]+)', seen.pop().decode()))
    assert counted()[0] - before == 1, "one of those who wait asks the hub"
    hint = re.search(r'PRELOAD-HINT:TYPE=PART,URI="([^"]+)"', get(HUB, playlist)[0].decode()).group(1)
    part = get(EDGE, playlist.replace("stream.m3u8", hint))
    assert part[1]["Cache-Control"].endswith("immutable") and len(part[0]) > 0
    assert status(EDGE, f"{playlist}?_HLS_msn={number + 100}") == 400
    print("who waits for a part waits with all others behind one request")


def main():
    if not shutil.which("nginx"):
        print("nginx is not installed: examples/cdn/hub.conf is not tested")
        return 77
    htvm = os.path.realpath(sys.argv[1])
    viewers, seconds = (int(argument) for argument in (sys.argv[2:] + ["40", "6"][len(sys.argv) - 2:])[:2])
    with tempfile.TemporaryDirectory() as work:
        os.chmod(work, 0o755)
        os.makedirs(f"{work}/cache")
        bench = Bench(htvm, work)
        subprocess.run([htvm, "synth", f"{work}/walk", "--frames", "90", "--vertices", "3000"], check=True, **QUIET)
        subprocess.run([htvm, "encode", f"{work}/walk", "-o", f"{work}/walk.htvm"], check=True, **QUIET)
        with open(f"{work}/nginx.conf", "w", encoding="utf-8") as file:
            file.write(configuration(work))
        try:
            bench.start_hub("--connections-per-address", "4096")
            bench.start_publisher()
            bench.start_edge()
            wait_for("the stream", lambda: status(HUB, "/hls/anna/stream.m3u8") == 200)
            one = measure("one viewer at the hub", HUB, 1, seconds)
            measure("without an edge", HUB, viewers, seconds)
            requests, sent = measure("with an edge", EDGE, viewers, seconds)
            assert requests <= 3 * one[0] + 10, "the edge asks for more than a viewer does"
            assert sent <= 3 * one[1] + 100000, "the edge takes more than a viewer does"
            headers = get(EDGE, "/hls/anna/stream.m3u8")[1]
            assert headers["Access-Control-Allow-Origin"] == "*" and headers["Cache-Control"] == "public, max-age=1"
            check_failures(bench)
            check_links(bench)
        finally:
            bench.end()
    return 0


if __name__ == "__main__":
    sys.exit(main())
