#!/usr/bin/env python3
"""Streams of every kind, damaged at places that a seed draws, with their checksums repaired, and decoded by the program.

The streams are those of tests/data/conformance and some that are encoded now. What is damaged is what a sender without
good intentions would write: bits and bytes of payloads, lengths, numbers and kinds of packets, which come, and in which
order. Each run is a process of its own, whose processor time and memory the kernel tells. It fails where one ends by a
signal, takes more memory or processor time than is promised, or ends with a code that no damaged stream should cause.
What failed is kept.
"""
import argparse
import collections
import os
import pathlib
import random
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import zlib

HEADER = 32
SEQUENCE, INTRA, PREDICTED, TRACKED = 1, 2, 6, 7
EXIT_CODES = (0, 3, 4, 5)  # decoded; corrupt, unsupported, beyond a limit: docs/use.md
SOURCE = pathlib.Path(__file__).resolve().parent.parent


def packets_of(data):
    """[[kind, flags, version, frame, reference, timestamp], payload] of each; streams begin with their first packet."""
    out, at = [], 0
    while at + HEADER <= len(data) and data[at:at + 4] == b"HTVP":
        kind, flags, version, frame, reference, timestamp, size = struct.unpack("<BBHIIqI", data[at + 4:at + 28])
        out.append([[kind, flags, version, frame, reference, timestamp], bytearray(data[at + HEADER:at + HEADER + size])])
        at += HEADER + size + 4
    return out


def written(packets):
    out = bytearray()
    for (kind, flags, version, frame, reference, timestamp), payload in packets:
        if kind == SEQUENCE:
            reference = zlib.crc32(payload)
        head = struct.pack("<BBHIIqI", kind, flags, version, frame, reference, timestamp, len(payload))
        out += b"HTVP" + head + struct.pack("<I", zlib.crc32(head)) + payload + struct.pack("<I", zlib.crc32(payload))
    return bytes(out)


def flip_bits(rng, packets):
    for _ in range(rng.choice((1, 1, 2, 4, 16))):
        payload = rng.choice(packets)[1]
        if payload:
            payload[rng.randrange(len(payload))] ^= 1 << rng.randrange(8)


def flip_early(rng, packets):
    """Where counts and lengths are."""
    payload = rng.choice(packets)[1]
    for _ in range(rng.choice((1, 2, 4))):
        if payload:
            payload[rng.randrange(min(len(payload), 40))] = rng.choice((0, 1, 0x7f, 0x80, 0xff, rng.randrange(256)))


def write_number(rng, packets):
    payload, size = rng.choice(packets)[1], rng.choice((1, 2, 4, 8))
    if len(payload) >= size:
        at = rng.randrange(len(payload) - size + 1)
        payload[at:at + size] = rng.choice((0, 1, 2 ** (8 * size) - 1, 2 ** (8 * size - 1))).to_bytes(size, "little")


def change_length(rng, packets):
    payload = rng.choice(packets)[1]
    if rng.random() < 0.6:
        del payload[rng.randrange(len(payload) + 1):]
    else:
        payload += bytes(rng.choice((0, 0xff, rng.randrange(256))) for _ in range(rng.choice((1, 16, 1000))))


def change_packet(rng, packets):
    head = rng.choice(packets)[0]
    which = rng.randrange(5)
    if which == 0:
        head[0] = rng.randrange(14)
    elif which == 1:
        head[1] ^= 1 << rng.randrange(8)
    elif which == 2:
        head[3] = rng.choice((0, 1, head[3] + 1, max(0, head[3] - 1), 2 ** 32 - 1)) % 2 ** 32
    elif which == 3:
        head[4] = rng.choice((0, head[4] + 1, 2 ** 32 - 1)) % 2 ** 32
    else:
        head[5] = rng.choice((0, -1, 2 ** 63 - 1, -2 ** 63))


def reorder(rng, packets):
    a, b = rng.randrange(len(packets)), rng.randrange(len(packets))
    packets[a], packets[b] = packets[b], packets[a]


def leave_out(rng, packets):
    if len(packets) > 1:
        del packets[rng.randrange(len(packets))]


def repeat_frame(rng, packets):
    """A chain of frames that cost their sender little."""
    frames = [i for i, (head, _) in enumerate(packets) if head[0] in (PREDICTED, TRACKED, INTRA)]
    if not frames:
        return
    at = rng.choice(frames)
    head, payload = packets[at]
    last = max(head[3] for head, _ in packets)
    for i in range(1, rng.choice((2, 20, 200)) + 1):
        copy = list(head)
        copy[3] = (last + i) % 2 ** 32
        copy[5] = min(head[5] + 1000 * i, 2 ** 63 - 1)
        if copy[0] == TRACKED:
            copy[4] = (last + i - 1) % 2 ** 32
        packets.append([copy, bytearray(payload)])


def exchange_payloads(rng, packets):
    a, b = rng.choice(packets), rng.choice(packets)
    a[1], b[1] = bytearray(b[1]), bytearray(a[1])


def splice(rng, packets):
    a, b = rng.choice(packets)[1], rng.choice(packets)[1]
    if a and b:
        at = rng.randrange(len(a))
        a[at:] = b[rng.randrange(len(b)):]


DAMAGES = (flip_bits, flip_bits, flip_bits, flip_early, flip_early, write_number, change_length, change_packet, reorder,
           leave_out, repeat_frame, exchange_payloads, splice)


def encoded_now(htvm, folder):
    """Small streams of what the encoder writes by default, and of its other strategies."""
    capture = folder / "capture"
    run = lambda *command: subprocess.run([str(part) for part in command], check=True, capture_output=True)
    run(htvm, "synth", capture, "--first-frame", 30, "--frames", 6, "--vertices", 400)
    skeleton = ("-s", capture / "skeleton.json")
    for name, *options in (("default",), ("quality_10", "-q", 10), ("short_groups", "--keyint", 3),
                           ("topology", "--profile", "topology", *skeleton), ("paper", "--profile", "paper", *skeleton)):
        stream = folder / f"{name}.htvm"
        run(htvm, "encode", capture, "-o", stream, *options)
        yield name, stream.read_bytes()


def decode(htvm, stream, options):
    """Exit code (negative: the signal), seconds of processor time, bytes of memory."""
    child = subprocess.Popen([htvm, "decode", str(stream), "-o", "-", "--threads", "1"], stdin=subprocess.DEVNULL,
                             stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                             preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (options.hang, options.hang + 1)))
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    return child.returncode, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024


def main():
    parser = argparse.ArgumentParser(prog="./dev damage", description=__doc__)
    parser.add_argument("htvm", help=argparse.SUPPRESS)
    parser.add_argument("runs", nargs="?", type=int, default=1000, help="how many (default 1000)")
    parser.add_argument("--seed", type=int, default=1, help="another one draws other damage (default 1)")
    parser.add_argument("--first", type=int, default=0, help="number of the first run (default 0)")
    parser.add_argument("--memory", type=int, default=128, help="MiB that no run may take more than (default 128)")
    parser.add_argument("--seconds-a-kilobyte", type=float, default=1.0, help="of processor time, that no run may take "
                        "more than besides half a second (default 1)")
    parser.add_argument("--hang", type=int, default=60, help="seconds of processor time after which it hangs (default 60)")
    parser.add_argument("--keep", default="build/damage", help="where streams are kept that failed (default build/damage)")
    options = parser.parse_args()
    work = pathlib.Path(tempfile.mkdtemp(prefix="htvm-damage-"))
    try:
        streams = [(path.stem, path.read_bytes()) for path in sorted((SOURCE / "tests/data/conformance").glob("*.htvm"))]
        streams += list(encoded_now(options.htvm, work))
        streams = [(name, data, packets_of(data)) for name, data in streams]
        failures = campaign(options, work, streams)
    finally:
        shutil.rmtree(work)
    sys.exit(1 if failures else 0)


def campaign(options, work, streams):
    codes, slowest, largest, longest, failures = collections.Counter(), (0.0, ""), (0, ""), (0.0, ""), 0
    print(f"{len(streams)} streams of {sum(len(data) for _, data, _ in streams) // len(streams)} bytes on average")
    begun = 0
    ended = []  # once somebody has had enough, what was found so far is told
    signal.signal(signal.SIGINT, lambda *_: ended.append(True))
    for run in range(options.first, options.first + options.runs):
        if ended:
            break
        begun += 1
        rng = random.Random(f"{options.seed} {run}")
        name, _, whole = rng.choice(streams)
        packets = [[list(head), bytearray(payload)] for head, payload in whole]
        done = [rng.choice(DAMAGES) for _ in range(rng.choice((1, 1, 2, 3)))]
        for damage in done:
            damage(rng, packets)
        told = f"run {run} of {name}: {', '.join(damage.__name__ for damage in done)}"
        data, stream = written(packets), work / "damaged.htvm"
        stream.write_bytes(data)
        code, seconds, memory = decode(options.htvm, stream, options)
        # The first of it is the process's own.
        per_kilobyte = max(0.0, seconds - 0.05) / (len(data) / 1024)
        slowest, largest = max(slowest, (per_kilobyte, told)), max(largest, (memory, told))
        longest = max(longest, (seconds, told))
        codes[code] += 1
        too_slow = seconds > 0.5 + options.seconds_a_kilobyte * len(data) / 1024
        if code in EXIT_CODES and memory <= options.memory << 20 and not too_slow:
            continue
        failures += 1
        kept = pathlib.Path(options.keep)
        kept.mkdir(parents=True, exist_ok=True)
        kept = kept / f"{options.seed}_{run}.htvm"
        kept.write_bytes(data)
        how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        print(f"FAILED: {told}: {how}, {seconds:.2f} s, {memory >> 20} MiB, {len(data)} bytes: {kept}", flush=True)
    print(f"{begun} runs: " + ", ".join(f"{count} ended with {code}" for code, count in sorted(codes.items())))
    print(f"slowest: {slowest[0]:.3f} s a KB ({slowest[1]})\nlongest: {longest[0]:.2f} s ({longest[1]})")
    print(f"largest memory: {largest[0] / 2 ** 20:.1f} MiB ({largest[1]})\n{failures} failed")
    return failures


if __name__ == "__main__":
    main()
