"""htvm serve as a process of its own, its publisher and viewers, and the streams that they are measured with."""
import contextlib
import json
import os
import re
import subprocess
import sys
import time

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
    """Path of a synthetic person of four seconds, encoded at this rate."""
    capture, path = os.path.join(WORK, "capture"), os.path.join(WORK, f"person_{megabits}.htvm")
    if not os.path.exists(path):
        os.makedirs(WORK, exist_ok=True)
        print(f"encoding {path}, once", file=sys.stderr)
        run(htvm, "synth", capture, "--frames", FRAMES, "--fps", FPS)
        run(htvm, "encode", capture, "--bitrate", megabits, "-o", path + ".new")
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
    with started([*inside, htvm, "serve", "--files", WORK, "--port", 0, *options],
                 stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        line = process.stdout.readline()
        address = re.search(r":(\d+)/", line)
        if not address:
            sys.exit(f"htvm serve has not started: {line}")
        yield process, int(address.group(1))


def publisher(stream, name, port, inside=()):
    return started([*inside, sys.executable, os.path.join(FOLDER, "publish.py"), stream, name, port])


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
