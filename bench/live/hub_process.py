"""htvm serve as a process of its own, its publisher and viewers, and the streams that they are measured with."""
import contextlib
import json
import os
import re
import socket
import subprocess
import sys
import time
import urllib.request

FOLDER = os.path.dirname(os.path.abspath(__file__))
WORK = os.path.join("out", "live")  # streams are kept here; removing it makes them anew
FRAMES, FPS = 120, 30
VIEWERS_AT_AN_ADDRESS = 32
TICKS = os.sysconf("SC_CLK_TCK")


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}\n{done.stdout}{done.stderr}")
    return done.stdout


def stream_of(htvm, megabits):
    """Path of a synthetic person of four seconds, encoded at this rate as live streams are: no frame takes long."""
    capture, path = os.path.join(WORK, "capture"), os.path.join(WORK, f"person_{megabits}.htvm")
    if not os.path.exists(path):
        os.makedirs(WORK, exist_ok=True)
        print(f"encoding {path}, once", file=sys.stderr)
        run(htvm, "synth", capture, "--frames", FRAMES, "--fps", FPS)
        run(htvm, "encode", capture, "--bitrate", megabits, "--buffer", 0.25, "-o", path + ".new")
        os.rename(path + ".new", path)
    return path


@contextlib.contextmanager
def started(words, **options):
    """A process that ends with the block."""
    process = subprocess.Popen([str(word) for word in words], **options)
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@contextlib.contextmanager
def hub(htvm, *options, inside=()):
    """(process, port) of htvm serve. inside: words before the command, such as ip netns exec NAME."""
    with started([*inside, htvm, "serve", "--files", WORK, *([] if "--port" in options else ["--port", 0]), *options],
                 stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        line = process.stdout.readline()
        address = re.search(r":(\d+)/", line)
        if not address:
            sys.exit(f"htvm serve has not started: {line}")
        yield process, int(address.group(1))


def certificate(folder):
    """htvm serve's options for TLS, by a certificate that is made in this folder."""
    paths = [os.path.join(folder, name) for name in ("chain.pem", "key.pem")]
    run("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", 2,
        "-subj", "/CN=127.0.0.1", "-out", paths[0], "-keyout", paths[1])
    return ["--cert", paths[0], "--key", paths[1]]


def publisher(stream, name, port, inside=(), tls=False):
    return started([*inside, sys.executable, os.path.join(FOLDER, "publish.py"), stream, name, port,
                    *(["--tls"] if tls else [])])


def free_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


def streams(port):
    """What the hub tells of its streams, by name."""
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/streams", timeout=5) as answer:
        return {stream["name"]: stream for stream in json.load(answer)}


def nats_server(port):
    return started(["nats-server", "-a", "127.0.0.1", "-p", port], stderr=subprocess.DEVNULL)


@contextlib.contextmanager
def joined_hubs(htvm, count, nats_port, *options):
    """[(process, port)] of hubs that are joined through NATS and tell of each other."""
    with contextlib.ExitStack() as stack:
        hubs = []
        for i in range(count):
            port = free_port()
            hubs.append(stack.enter_context(
                hub(htvm, "--port", port, "--hub-url", f"ws://127.0.0.1:{port}", "--hub-name", f"hub{i}", "--nats",
                    f"nats://127.0.0.1:{nats_port}", *options)))
        yield hubs


def memory_bytes(pid):
    """Resident memory of a process."""
    with open(f"/proc/{pid}/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def socket_bytes():
    """What the kernel holds for all TCP sockets of this machine, both ends of a connection."""
    with open("/proc/net/sockstat", encoding="ascii") as file:
        pages = int(re.search(r"^TCP:.* mem (\d+)", file.read(), re.M).group(1))
    return pages * os.sysconf("SC_PAGE_SIZE")


def processor_seconds(pid):
    with open(f"/proc/{pid}/stat", encoding="ascii") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def now_us():
    return time.clock_gettime_ns(time.CLOCK_MONOTONIC) // 1000


def print_json(value):
    print(json.dumps(value, indent=1))
