#!/usr/bin/env python3
"""Every relative link in the repository's Markdown files leads to a file, and every #anchor to a heading of it; every page
of docs/ that a source names exists.

usage: links.py [ROOT]     exit code 1, and a line a link, where one leads nowhere
"""
import pathlib
import re
import subprocess
import sys
import urllib.parse

SOURCES = (".c", ".cpp", ".h", ".hpp", ".hpp.in", ".py", ".sh", ".cmake", ".ts", ".mjs", ".cs", ".txt")
LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)")
NAMED = re.compile(r"\bdocs/[\w/]+\.md\b")


def files_of(root):
    listed = subprocess.run(["git", "-C", root, "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                            capture_output=True, text=True)
    if listed.returncode == 0:
        paths = [root / name for name in listed.stdout.split("\0") if name]
    else:
        # No checkout: a source archive.
        left_out = {"build", "out", "node_modules", ".git"}
        paths = [p for p in root.rglob("*") if not left_out & set(p.relative_to(root).parts)]
    return [p for p in paths if p.is_file()]


def without_code(text):
    """Fenced blocks and code spans contain no links."""
    text = re.sub(r"^(```|~~~).*?^\1", lambda m: "\n" * m.group(0).count("\n"), text, flags=re.M | re.S)
    return re.sub(r"(`+)(?!`).*?(?<!`)\1(?!`)", lambda m: "x" * len(m.group(0)), text)


def anchors_of(text):
    """The anchors of a page's headings, as GitHub makes them."""
    counts, anchors = {}, set()
    # Code spans keep their text here, fenced blocks do not.
    text = re.sub(r"^(```|~~~).*?^\1", "", text, flags=re.M | re.S)
    for heading in re.findall(r"^#{1,6}\s+(.*?)\s*#*\s*$", text, flags=re.M):
        heading = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        anchor = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        number = counts.get(anchor, 0)
        counts[anchor] = number + 1
        anchors.add(f"{anchor}-{number}" if number else anchor)
    return anchors | set(re.findall(r"<a\s+(?:id|name)=\"([^\"]+)\"", text))


def faults(root):
    files = files_of(root)
    pages = {p.resolve(): p.read_text(encoding="utf-8") for p in files if p.suffix == ".md"}
    anchors = {p: anchors_of(text) for p, text in pages.items()}
    for page, text in sorted(pages.items()):
        clean = without_code(text)
        for link in LINK.finditer(clean):
            address = link.group(1)
            if re.match(r"[a-z][a-z+.-]*:|//", address):
                continue
            path, _, anchor = address.partition("#")
            target = (page.parent / urllib.parse.unquote(path)).resolve() if path else page
            where = f"{page.relative_to(root)}:{clean.count(chr(10), 0, link.start()) + 1}: {address}"
            if not target.exists():
                yield f"{where}: no such file"
            elif anchor and target in anchors and urllib.parse.unquote(anchor) not in anchors[target]:
                yield f"{where}: no such heading"
    for source in files:
        if source.name.endswith(SOURCES) or source.name == "dev":
            text = source.read_text(encoding="utf-8", errors="replace")
            for name in sorted(set(NAMED.findall(text))):
                if not (root / name).exists():
                    yield f"{source.relative_to(root)}: names {name}, which is not there"


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parents[2]).resolve()
    found = list(faults(root))
    for fault in found:
        print(fault)
    if found:
        sys.exit(1)


if __name__ == "__main__":
    main()
