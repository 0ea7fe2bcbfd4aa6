"""What a wheel with a shared library inside may be called: its platform tag, read from the library itself, and whether
it needs only what every system of that name has. (What auditwheel does, for one library that carries all else inside.)

    python3 library_tag.py LIBRARY      prints the tag, or says what is wrong
"""

from __future__ import annotations

import re
import struct
import sys
from pathlib import Path
from typing import List, Tuple

# The libraries that PEP 600 lets a manylinux wheel expect, of those that code in C++ without others may need.
manylinux_libraries = {"libc.so.6", "libm.so.6", "libpthread.so.0", "libdl.so.2", "librt.so.1", "libgcc_s.so.1", "libstdc++.so.6",
                       "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}
elf_machines = {62: "x86_64", 183: "aarch64"}
pe_machines = {0x8664: "win_amd64", 0xAA64: "win_arm64"}
windows_libraries = {"kernel32.dll", "msvcrt.dll", "advapi32.dll", "ole32.dll", "ucrtbase.dll", "user32.dll", "ws2_32.dll"}


class Unfit(Exception):
    """The library cannot go into a wheel, and why."""


def _text(data: bytes, at: int) -> str:
    return data[at:data.index(b"\0", at)].decode("ascii")


def elf_needs(data: bytes) -> Tuple[str, List[str]]:
    """The processor, and the shared libraries that a 64-bit ELF library needs. It may not look for them elsewhere than the
    system does, nor be changed by the loader where it is code."""
    if data[4:6] != b"\2\1":
        raise Unfit("it is not for a 64-bit, little-endian processor")
    machine, = struct.unpack_from("<H", data, 18)
    sections, = struct.unpack_from("<Q", data, 40)
    size, count = struct.unpack_from("<HH", data, 58)
    needed: List[str] = []
    headers = [struct.unpack_from("<IIQQQQIIQQ", data, sections + size * i) for i in range(count)]
    for _, kind, _, _, offset, length, link, *_ in headers:
        if kind == 6:  # SHT_DYNAMIC
            names = headers[link][4]
            entries = (struct.unpack_from("<QQ", data, at) for at in range(offset, offset + length, 16))
            for tag, value in entries:
                if tag == 1:  # DT_NEEDED
                    needed.append(_text(data, names + value))
                elif tag in (15, 29):  # DT_RPATH, DT_RUNPATH
                    raise Unfit(f"it looks for libraries in {_text(data, names + value)}")
                elif tag == 22:  # DT_TEXTREL
                    raise Unfit("its code is relocated: build it with -fPIC")
    if machine not in elf_machines:
        raise Unfit(f"there is no tag for ELF's machine {machine}")
    return elf_machines[machine], needed


def pe_needs(data: bytes) -> Tuple[str, List[str]]:
    """The tag, and the DLLs that a 64-bit DLL needs."""
    header, = struct.unpack_from("<I", data, 0x3C)
    if data[header:header + 4] != b"PE\0\0":
        raise Unfit("it is no DLL")
    machine, section_count = struct.unpack_from("<HH", data, header + 4)
    optional_size, = struct.unpack_from("<H", data, header + 20)
    optional = header + 24
    imports, = struct.unpack_from("<I", data, optional + 112 + 8)
    sections = [struct.unpack_from("<8xIIII", data, optional + optional_size + 40 * i) for i in range(section_count)]

    def place(address: int) -> int:
        for length, virtual, _, raw in sections:
            if virtual <= address < virtual + length:
                return raw + address - virtual
        raise Unfit("its table of imports is damaged")

    needed: List[str] = []
    at = place(imports)
    while name := struct.unpack_from("<12xI", data, at)[0]:
        needed.append(_text(data, place(name)))
        at += 20
    if machine not in pe_machines:
        raise Unfit(f"there is no tag for Windows' machine {machine:#x}")
    return pe_machines[machine], needed


def platform_tag(data: bytes) -> str:
    if data[:4] == b"\x7fELF":
        machine, needed = elf_needs(data)
        if foreign := sorted(set(needed) - manylinux_libraries):
            raise Unfit(f"it needs {', '.join(foreign)}, which not every Linux has")
        versions = [tuple(map(int, found)) for found in re.findall(rb"\0GLIBC_(\d+)\.(\d+)(?:\.\d+)?(?=\0)", data)]
        major, minor = max(versions, default=(2, 17))
        return f"manylinux_{major}_{max(minor, 17)}_{machine}"
    if data[:2] == b"MZ":
        tag, needed = pe_needs(data)
        if foreign := sorted({name.lower() for name in needed} - windows_libraries):
            raise Unfit(f"it needs {', '.join(foreign)}, which not every Windows has")
        return tag
    raise Unfit("it is neither an ELF library nor a DLL")


def library_name(tag: str) -> str:
    """What the package calls the library inside of it."""
    return "htvm.dll" if tag.startswith("win") else "libhtvm.so"


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit("usage: library_tag.py LIBRARY")
    try:
        print(platform_tag(Path(sys.argv[1]).read_bytes()))
    except (Unfit, struct.error, ValueError, IndexError) as problem:
        raise SystemExit(f"{sys.argv[1]}: {problem}")
