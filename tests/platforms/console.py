#!/usr/bin/env python3
"""What somebody sees and does at the console of a program that Wine runs: console.py PREFIX HTVM_EXE CAPTURE OUTPUT HERE FEED_EXE

Encodes a capture of PLY files at a console, again with Ctrl-C once twenty are on their way, and plays the stream.
OUTPUT must not be there; HERE is this machine's own htvm, which reads what is written; FEED_EXE is feed.cpp. Wine makes
a terminal the console of the program that is started in it.
"""

import os
import pathlib
import pty
import re
import select
import shutil
import signal
import subprocess
import sys

CTRL_C = b"\x03"
SILENCE = 120  # seconds without a word, after which a program hangs


def at_console(words: list[str], press_at: bytes = b"") -> tuple[bytes, int]:
    """All that comes to the terminal, and the exit code. Presses Ctrl-C once the pattern has come."""
    process, terminal = pty.fork()
    if process == 0:
        os.execvp(words[0], words)
    said = b""
    while True:
        if not select.select([terminal], [], [], SILENCE)[0]:
            os.kill(process, signal.SIGKILL)
            sys.exit(f"not so: {' '.join(words)} goes on\n{said!r}")
        try:
            piece = os.read(terminal, 65536)
        except OSError:  # so a terminal ends
            break
        said += piece
        if press_at and re.search(press_at, said):
            os.write(terminal, CTRL_C)
            press_at = b""
    return said, os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def text_of(said: bytes) -> str:
    """Without the terminal's control sequences, and without the breaks of lines that are too long for it."""
    return re.sub(rb"\x1b\[[?0-9;]*[A-Za-z]|[\r\n]", b"", said).decode()


def check(is_so: bool, what: str, said: bytes) -> None:
    if not is_so:
        sys.exit(f"not so: {what}\n{said!r}")


def main() -> None:
    prefix, program, capture, output, here, feed = sys.argv[1:]
    wine = shutil.which("wine64") or "/usr/lib/wine/wine64"
    os.environ.update(WINEPREFIX=prefix, WINEDEBUG="-all", LC_ALL="C.UTF-8", TERM="xterm")
    meshes = output + ".ply"
    with open(meshes, "wb") as all_meshes:
        for file in sorted(pathlib.Path(capture).glob("*.ply")):
            all_meshes.write(file.read_bytes())
    encode = [wine, program, "encode", capture, "-o", output]

    said, code = at_console(encode)
    check(code == 0, "a capture is encoded at a console", said)
    progress = re.findall(rb"\r?\x1b\[Kencoding (\d+)/\d+ ", said)
    check(len(progress) >= 1, "progress is shown on a line that is written anew", said)
    check(re.search(rb"encoding [^\n]*\r\x1b\[K[^\n]*bits/vertex", said) is not None,
          "the line of progress goes before the table comes", said)
    check(" frames/s" in text_of(said), "the last line says what was done", said)
    whole = open(output, "rb").read()

    # From files, and from a rig's pipe that has sent all of them and may send more.
    live = [wine, feed, meshes, program, "encode", "-", "-o", output]
    for words in (encode, live):
        said, code = at_console(words, press_at=rb"encoding [2-5]\d\b")
        check(code == 130, f"Ctrl-C ends with 130, not with {code}", said)
        left = re.search(r"interrupted; (\d+) frames? (was|were) encoded before, now in .*\.partial, which is a whole "
                         "stream", text_of(said))
        check(left is not None, "who presses Ctrl-C is told what is left", said)
        check(open(output, "rb").read() == whole, "Ctrl-C leaves the file that was there", said)
        frames = subprocess.run([here, "verify", output + ".partial"], capture_output=True, text=True)
        check(frames.returncode == 0 and f": {left[1]} frame" in frames.stdout,
              f"what Ctrl-C leaves is a whole stream of {left[1]} frames: {frames.stdout}{frames.stderr}", said)
        os.remove(output + ".partial")

    said, code = at_console([wine, program, "play", output, "--no-open"], press_at=rb"Ctrl-C ends\.")
    check(code == 0, f"who has seen enough ends play by Ctrl-C with 0, not with {code}", said)


main()
