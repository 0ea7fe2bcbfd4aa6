#!/usr/bin/env python3
"""examples/cdn/nginx.conf with a real nginx: what viewers behind the edge cost the origin, and what they see of it.

usage: edge.py HTVM [VIEWERS]

HTVM packs a small synthetic stream into segments. So many viewers (default: 200) each fetch the playlist and all that it
names through the edge, once the origin has been asked the same by one viewer alone. Exits with 77 where there is no nginx.
"""
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

EXAMPLE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples", "cdn", "nginx.conf")
ORIGIN, EDGE = 18090, 18088


def get(port, name):
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/anna/{name}", timeout=20) as answer:
        return answer.read(), answer.headers


def names_in(playlist):
    maps = re.findall(r'URI="([^"]+)"', playlist)
    return maps + [line for line in playlist.splitlines() if line and not line.startswith("#")]


def watch(port):
    """Fetches all that a viewer does; gives the bytes by name."""
    playlist = get(port, "stream.m3u8")[0]
    return {name: get(port, name)[0] for name in names_in(playlist.decode())}


def asked(work):
    with open(f"{work}/log/origin.log", encoding="utf-8") as log:
        return [re.search(r'"GET (\S+) .*" (\d+) (\d+)', line).groups() for line in log]


def configuration(work):
    with open(EXAMPLE, encoding="utf-8") as file:
        text = file.read()
    for path, place in (("/var/www/streams", "www"), ("/var/log/nginx", "log"), ("/var/lib/nginx/streams", "cache")):
        text = text.replace(path, f"{work}/{place}")
    text = text.replace("127.0.0.1:8090", f"127.0.0.1:{ORIGIN}").replace("listen 8088", f"listen 127.0.0.1:{EDGE}")
    temporary = "".join(f"    {name}_temp_path {work}/temporary_{name};\n"
                        for name in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
    text = text.replace("http {\n", "http {\n" + temporary, 1)
    return f"user root;\ndaemon off;\npid {work}/nginx.pid;\nerror_log {work}/log/error.log;\n" + text


def start(work):
    nginx = subprocess.Popen(["nginx", "-p", work, "-c", f"{work}/nginx.conf", "-e", f"{work}/log/error.log"])
    for _ in range(200):
        try:
            get(EDGE, "nothing")
        except urllib.error.HTTPError:
            return nginx
        except OSError:
            time.sleep(0.05)
    sys.exit("nginx does not start: " + open(f"{work}/log/error.log", encoding="utf-8").read())


def check(work, viewers):
    alone = watch(ORIGIN)
    before = len(asked(work))
    with concurrent.futures.ThreadPoolExecutor(viewers) as pool:
        seen = list(pool.map(lambda _: watch(EDGE), range(viewers)))
    requests = asked(work)[before:]
    assert all(one == alone for one in seen), "viewers behind the edge see something else"
    of_files = [path for path, _, _ in requests if not path.endswith(".m3u8")]
    assert sorted(of_files) == sorted(set(of_files)), "a segment is asked for twice"
    assert len(of_files) == len(alone), f"{len(of_files)} of {len(alone)} files are asked for"
    own = sum(len(data) for data in alone.values())
    print(f"{viewers} viewers: {viewers * (len(alone) + 1)} requests, {viewers * own} bytes; the origin had "
          f"{len(requests)} requests, {sum(int(size) for _, _, size in requests)} bytes")

    segment = next(name for name in alone if name.endswith(".m4s"))
    headers = get(EDGE, segment)[1]
    assert headers["Cache-Control"] == "public, max-age=31536000, immutable", headers["Cache-Control"]
    assert headers["Access-Control-Allow-Origin"] == "*"
    assert headers["X-Cache"] == "HIT", headers["X-Cache"]
    assert get(EDGE, "stream.m3u8")[1]["Cache-Control"] == "public, max-age=1"
    try:
        get(EDGE, "000099-none.m4s")
        raise AssertionError("a segment that is not there is there")
    except urllib.error.HTTPError as error:
        assert error.code == 404, error.code

    # A playlist that was written anew is seen after its second, and the next request behind it.
    path = f"{work}/www/anna/stream.m3u8"
    with open(path, encoding="utf-8") as file:
        text = file.read()
    with open(path + ".new", "w", encoding="utf-8") as file:
        file.write(text.replace("#EXT-X-VERSION:7", "#EXT-X-VERSION:7\n#EXT-X-START:TIME-OFFSET=0"))
    os.rename(path + ".new", path)
    for _ in range(50):
        time.sleep(0.1)
        if b"EXT-X-START" in get(EDGE, "stream.m3u8")[0]:
            break
    else:
        raise AssertionError("the edge keeps an old playlist")


def main():
    if not shutil.which("nginx"):
        print("nginx is not installed: examples/cdn is not tested")
        return 77
    htvm, viewers = os.path.realpath(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 200
    with tempfile.TemporaryDirectory() as work:
        os.chmod(work, 0o755)  # nginx's workers are not root
        for folder in ("log", "www/anna", "cache"):
            os.makedirs(f"{work}/{folder}")
        quiet = {"check": True, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        subprocess.run([htvm, "synth", f"{work}/walk", "--frames", "60", "--vertices", "500"], **quiet)
        subprocess.run([htvm, "encode", f"{work}/walk", "-o", f"{work}/walk.htvm", "--access-interval", "10"], **quiet)
        subprocess.run([htvm, "pack", f"{work}/walk.htvm", "-o", f"{work}/www/anna/stream.m3u8", "--segment", "0.3"],
                       **quiet)
        with open(f"{work}/nginx.conf", "w", encoding="utf-8") as file:
            file.write(configuration(work))
        nginx = start(work)
        try:
            check(work, viewers)
        finally:
            nginx.terminate()
            nginx.wait()
    print("the origin is asked for each file once")
    return 0


if __name__ == "__main__":
    sys.exit(main())
