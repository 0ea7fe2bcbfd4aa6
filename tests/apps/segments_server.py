#!/usr/bin/env python3
"""A web server for tests of playlists by address: the files of a folder, with the manners of the first part of a path.

usage: segments_server.py FOLDER

Prints its port. Paths are MANNER/FILE:
ok        as it is
moved     answers that it is at ok/
round     answers that it is where it was asked for
gone      404 for the second segment
cut       the second segment's connection ends half way
busy      503 for each file, the first time
down      503, always
missing   404, always
secret    403, always
page      a web page, whatever is asked for
endless   a body that does not end
live      a playlist that grows by a segment each time it is asked for, and ends
"""
import http.server
import os
import re
import sys

folder = sys.argv[1]
seen = set()
live = {"segments": 1}


def segments_of(text):
    return re.findall(r"^(\d{6}-.*)$", text, re.M)


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def answer(self, status, body=b"", **headers):
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def do_GET(self):
        manner, name = self.path.split("?")[0].strip("/").split("/", 1)
        name = name.removeprefix("ok/")
        by_status = {"missing": 404, "secret": 403, "down": 503}
        if manner in by_status:
            return self.answer(by_status[manner], b"come again\n")
        if manner == "moved":
            return self.answer(302, Location=f"../ok/{name}")
        if manner == "round":
            return self.answer(302, Location=name)
        if manner == "page":
            return self.answer(200, b"<!doctype html><title>Sign in</title>")
        if manner == "endless":
            return self.endless()
        if manner == "busy" and name not in seen:
            seen.add(name)
            return self.answer(503, b"come again\n")
        try:
            with open(os.path.join(folder, name), "rb") as file:
                body = file.read()
        except OSError:
            return self.answer(404)
        if manner in ("gone", "cut") and name.startswith("000001"):
            if manner == "gone":
                return self.answer(404)
            self.send_response(200)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body[: len(body) // 2])
            self.close_connection = True
            return None
        if manner == "live" and name.endswith(".m3u8"):
            body = self.growing(body.decode()).encode()
        return self.answer(200, body)

    def growing(self, text):
        names = segments_of(text)
        listed = names[: live["segments"]]
        live["segments"] = 1 if len(listed) == len(names) else live["segments"] + 1  # the next one sees it from the beginning
        text = re.sub(r"#EXT-X-PLAYLIST-TYPE:VOD\n", "", text).replace("#EXT-X-TARGETDURATION:1", "#EXT-X-TARGETDURATION:0.4")
        if len(listed) == len(names):
            return text
        return text[: text.index(listed[-1])] + listed[-1] + "\n"

    def endless(self):
        self.send_response(200)
        self.send_header("Connection", "close")
        self.end_headers()
        try:
            while True:
                self.wfile.write(b"#EXTM3U\n" * 8192)
        except OSError:
            pass
        self.close_connection = True


server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
print(server.server_address[1], flush=True)
server.serve_forever()
