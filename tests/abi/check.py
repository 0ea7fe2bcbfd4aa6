#!/usr/bin/env python3
"""Whether programs linked with an earlier libhtvm_c go on working: what the C headers say, and the library exports, is
compared with c_interface.txt, a line for each function, field and constant.

    check.py [LIBRARY]       LIBRARY: a libhtvm_c.so, which must export all the functions of htvm.h that are listed
    check.py --record        lists anew, for a version that may change the interface (docs/releases.md)
    check.py --self-test     headers changed in ways that break programs are found, those that break none are not

What may change within a version of the library's name: functions and constants are added, and fields behind the last of
a struct that begins with its size. Offsets, sizes and values are asked of the C compiler of this system. (libabigail's
abidiff cannot be told of such structs: version 2.2 passes over any change of theirs, or over none.)
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Dict, List, Tuple

here = Path(__file__).resolve().parent
include = here.parent.parent / "include"
headers = ["htvm/htvm.h", "htvm/htvm_live.h"]
baseline = here / "c_interface.txt"
# These change with what is added, or are no part of a program.
passing = re.compile(r"HTVM_VERSION_\w+|HTVM_HTVM\w*_H|HTVM_REASONS|HTVM_FRAME_KINDS|HTVM_LAYERS")


def texts() -> Dict[str, str]:
    return {name: (include / name).read_text() for name in headers}


def code(text: str) -> str:
    """Without comments and the preprocessor's lines, in one line."""
    bare = re.sub(r"/\*.*?\*/", " ", text, flags=re.S)
    return re.sub(r"\s+", " ", re.sub(r"^\s*#.*?$", "", bare, flags=re.M))


def unnamed(parameter: str) -> str:
    """A parameter's type: what it is called does not matter."""
    if "(*" in parameter:
        return re.sub(r"\(\*\w*\)", "(*)", parameter.strip())
    words = re.fullmatch(r"(.*?[\w*])\s*\b(\w+)", parameter.strip())
    return words[1].strip() if words and words[1] != "const" else parameter.strip()


def split(parameters: str) -> List[str]:
    """At commas that are in no parentheses."""
    return re.split(r",(?![^(]*\))", parameters)


def functions(source: str) -> List[str]:
    found = re.findall(r"(?:(?<=[;}{])|(?<=C\" \{)) ?((?:const )?\w+\*?) (htvm_\w+)\(((?:[^();]|\([^()]*\))*)\);", source)
    return [f"function {result} {name}({', '.join(map(unnamed, split(parameters)))})" for result, name, parameters in found]


def structs(source: str) -> Dict[str, List[Tuple[str, str]]]:
    """Of each its fields: type and name."""
    out: Dict[str, List[Tuple[str, str]]] = {}
    for body, name in re.findall(r"typedef struct \w* ?\{([^{}]*)\} (\w+);", source):
        fields: List[Tuple[str, str]] = []
        for declared in filter(str.strip, body.split(";")):
            if pointer := re.search(r"\(\*(\w+)\)", declared):
                fields.append((re.sub(r"\(\*\w+\)", "(*)", declared.strip()), pointer[1]))
                continue
            type_, names = re.fullmatch(r"(.*?)(\w+(?:\[\w+\])*(?:\s*,\s*\w+)*)", declared.strip()).groups()
            fields += [(type_.strip(), one.strip()) for one in names.split(",")]
        out[name] = fields
    return out


def interface(header_texts: Dict[str, str]) -> List[str]:
    """Its lines, sorted."""
    sources = {name: code(text) for name, text in header_texts.items()}
    lines = [one for source in sources.values() for one in functions(source)]
    words = {word for source in sources.values() for word in re.findall(r"\bHTVM_[A-Z0-9_]+\b(?= ?[=,}])", source)}
    printed = [f'"constant {word} %lld\\n", (long long){word}' for word in sorted(words) if not passing.fullmatch(word)]
    for source in sources.values():
        for struct, fields in structs(source).items():
            for type_, name in fields:
                base = name.split("[")[0]
                printed.append(f'"field {struct}.{name} {type_} at %zu\\n", offsetof({struct}, {base})')
            if fields[0][1] != "struct_size":
                printed.append(f'"size {struct} %zu\\n", sizeof({struct})')
    with tempfile.TemporaryDirectory() as folder:
        for name, text in header_texts.items():
            Path(folder, name).parent.mkdir(parents=True, exist_ok=True)
            Path(folder, name).write_text(text)
        program = "#include <stddef.h>\n#include <stdio.h>\n" + "".join(f'#include "{name}"\n' for name in header_texts)
        program += "int main(void) {\n" + "".join(f"    printf({one});\n" for one in printed) + "    return 0;\n}\n"
        Path(folder, "print.c").write_text(program)
        subprocess.run(["cc", "-w", "-I", folder, "-o", f"{folder}/print", f"{folder}/print.c"], check=True)
        lines += subprocess.run([f"{folder}/print"], check=True, capture_output=True, text=True).stdout.splitlines()
    return sorted(lines)


def broken(header_texts: Dict[str, str]) -> List[str]:
    """What was listed and is not so any more; none if programs go on working."""
    now = set(interface(header_texts))
    return [f"no more: {line}" for line in baseline.read_text().splitlines() if line not in now]


def exported(library: str) -> List[str]:
    told = subprocess.run(["nm", "-D", "--defined-only", library], check=True, capture_output=True, text=True).stdout
    return [line.split()[2] for line in told.splitlines()]


def self_test() -> None:
    """Each change of htvm.h, and whether programs break by it."""
    changes = [
        ("a function is gone", r"const char\* htvm_version_string\(void\);", "", True),
        ("a result's type", r"uint32_t htvm_version\(void\)", "uint64_t htvm_version(void)", True),
        ("a parameter's type", r"(htvm_status htvm_decoder_send_bytes\(htvm_decoder\* decoder, const) uint8_t\*", r"\1 char*", True),
        ("a field in the middle", r"(typedef struct htvm_frame_info \{\s*uint32_t struct_size;)", r"\1 uint32_t more;", True),
        ("a field's type", r"double lattice_step;", "float lattice_step;", True),
        ("a struct in arrays grows", r"(\} htvm_index_entry;)", r"uint32_t more; \1", True),
        ("a constant's value", r"HTVM_END = 2,", "HTVM_END = 3,", True),
        ("a constant is gone", r"HTVM_UP_MINUS_Z = 6", "HTVM_UP_LAST = 6", True),
        ("nothing", "", "", False),
        ("a parameter's name", r"htvm_status_text\(htvm_status status\)", "htvm_status_text(htvm_status what)", False),
        ("a function is new", r"uint32_t htvm_version\(void\);", "uint32_t htvm_version(void);\nuint32_t htvm_new(void);", False),
        ("a constant is new", r"HTVM_END = 2,", "HTVM_END = 2, HTVM_LATER = 9,", False),
        ("a field behind the last", r"(\} htvm_sequence_info;)", r"uint64_t more; \1", False),
    ]
    for what, old, new, breaks in changes:
        text = texts()
        changed = re.sub(old, new, text["htvm/htvm.h"]) if old else text["htvm/htvm.h"]
        if bool(old) == (changed == text["htvm/htvm.h"]):
            raise SystemExit(f"self-test: htvm.h has no place for '{what}'")
        found = broken({**text, "htvm/htvm.h": changed})
        if bool(found) != breaks:
            raise SystemExit(f"self-test: {what}: {found or 'not found'}")
    print(f"{len(changes)} changes judged as they should be")


def main() -> None:
    argument = sys.argv[1] if len(sys.argv) > 1 else ""
    if argument == "--self-test":
        return self_test()
    if argument == "--record":
        baseline.write_text("\n".join(interface(texts())) + "\n")
        return print(f"{len(interface(texts()))} lines recorded")
    told = broken(texts())
    if argument:
        wanted = re.findall(r"^function .*?(htvm_\w+)\(", "\n".join(functions(code(texts()["htvm/htvm.h"]))), re.M)
        told += [f"{argument} does not export {one}" for one in sorted(set(wanted) - set(exported(argument)))]
    if told:
        raise SystemExit("\n".join(told) + "\nPrograms linked with an earlier library would break: docs/releases.md says when that may be.")
    print(f"the C interface has all the {len(baseline.read_text().splitlines())} functions, fields and constants that are listed, or more")


if __name__ == "__main__":
    main()
