#!/usr/bin/env python3
"""Publishes a stream file round after round to a hub, for measurements: numbers of frames go on from round to round,
and the timestamp of each packet is the moment it is sent, in microseconds of CLOCK_MONOTONIC (see watch.cpp).

usage: publish.py FILE NAME PORT [SECONDS] [--fps RATE] [--token TOKEN] [--tls]
"""
import argparse
import select
import socket
import ssl
import struct
import time
import zlib

HEADER = struct.Struct("<4sBBHIIqI")  # docs/bitstream.md, section 2, up to the header's checksum
HEADER_BYTES, CHECKSUM_BYTES = HEADER.size + 4, 4
SEQUENCE, INTRA, ENHANCED, PREDICTED, TRACKED = 1, 2, 3, 6, 7
FRAMES = (INTRA, ENHANCED, PREDICTED, TRACKED)
INDEXES = (5, 8)
BINARY_MESSAGE = 2
MASK = b"\0\0\0\0"  # leaves the bytes as they are


def packets_of(data):
    """Headers, as tuples, and payloads with their checksums."""
    at = 0
    while at < len(data):
        header = HEADER.unpack_from(data, at)
        end = at + HEADER_BYTES + header[-1] + CHECKSUM_BYTES
        yield header, data[at + HEADER_BYTES:end]
        at = end


def frames_of(data):
    """The stream's frames, each with the packets that come before it; no indexes, which speak of the file."""
    frames, frame = [], []
    for header, payload in packets_of(data):
        if header[1] in INDEXES:
            continue
        frame.append((header, payload))
        if header[1] in FRAMES:
            frames.append(frame)
            frame = []
    return frames


def renumbered(packet, offset, timestamp):
    """The packet `offset` frames later."""
    (sync, kind, flags, version, frame, reference, _, size), payload = packet
    fields = HEADER.pack(sync, kind, flags, version, frame + offset,
                         reference if kind == SEQUENCE else reference + offset, timestamp, size)
    return fields + struct.pack("<I", zlib.crc32(fields[4:])) + payload


def websocket_message(payload):
    size = len(payload)
    length = (struct.pack(">B", 128 | size) if size < 126 else
              struct.pack(">BH", 128 | 126, size) if size < 65536 else struct.pack(">BQ", 128 | 127, size))
    return bytes([128 | BINARY_MESSAGE]) + length + MASK + payload


def connect(port, name, token, tls):
    line = socket.create_connection(("127.0.0.1", port))
    line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    if tls:
        line = ssl._create_unverified_context().wrap_socket(line)  # whatever its certificate
    line.sendall((f"GET /publish/{name} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\n"
                  "Connection: Upgrade\r\nSec-WebSocket-Key: aHR2bSBsaXZlIGJlbmNoIQ==\r\nSec-WebSocket-Version: 13\r\n"
                  "Sec-WebSocket-Protocol: htvm.1\r\n" +
                  (f"Authorization: Bearer {token}\r\n" if token else "") + "\r\n").encode())
    answer = line.recv(4096)
    if b" 101 " not in answer.split(b"\r\n")[0]:
        raise SystemExit(f"publish.py: the hub refused: {answer.decode(errors='replace')}")
    return line


def publish(path, name, port, seconds, fps, token, tls):
    with open(path, "rb") as file:
        frames = frames_of(file.read())
    line = connect(port, name, token, tls)
    begin, number = time.monotonic(), 0
    while number < seconds * fps:
        time.sleep(max(0, begin + number / fps - time.monotonic()))
        round_, place = divmod(number, len(frames))
        for packet in frames[place]:
            if round_ == 0 or packet[0][1] != SEQUENCE:
                stamped = renumbered(packet, round_ * len(frames), time.clock_gettime_ns(time.CLOCK_MONOTONIC) // 1000)
                line.sendall(websocket_message(stamped))
        while select.select([line], [], [], 0)[0]:  # what the hub tells
            if not line.recv(65536):
                raise SystemExit("publish.py: the hub has closed the connection")
        number += 1


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    parser.add_argument("name")
    parser.add_argument("port", type=int)
    parser.add_argument("seconds", type=float, nargs="?", default=float("inf"))
    parser.add_argument("--fps", type=float, default=30)
    parser.add_argument("--token")
    parser.add_argument("--tls", action="store_true")
    options = parser.parse_args()
    publish(options.file, options.name, options.port, options.seconds, options.fps, options.token, options.tls)


if __name__ == "__main__":
    main()
