"""Compares the declarations in csharp/Htvm.cs, as `Program.exe interface` prints them, with htvm.h:

    Program.exe interface | check_interface.py HEADER

Sizes, offsets and constants are asked of the C compiler; functions are compared with the header's text.
"""

import re
import subprocess
import sys
import tempfile

header = sys.argv[1]
text = re.sub(r"/\*.*?\*/|^#.*?$", "", open(header).read(), flags=re.S | re.M)


def snake(name):
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()


constant_names = {"Status": "HTVM_{}", "FrameKind": "HTVM_FRAME_{}", "FrameReason": "HTVM_REASON_{}", "Attributes": "HTVM_{}", "Up": "HTVM_UP_{}",
                  "Profile": "HTVM_PROFILE_{}"}


def passed(type_):
    """How C passes a type, in the words of Program.cs."""
    type_ = re.sub(r"\bconst\b|\s", "", type_)
    if "*" in type_:
        return "pointer"
    return {"htvm_status": "int32_t", "int": "int32_t"}.get(type_, type_)


functions = {}
for result, name, parameters in re.findall(r"([\w \*]+?)\b(htvm_\w+)\(([^()]*)\);", text):
    types = [re.sub(r"(\w+)$", "", part.strip()) for part in parameters.split(",") if part.strip() != "void"]
    functions[name] = [passed(result), *map(passed, types)]

asserts, wrong, fields, checked = [], [], {}, 0
for line in sys.stdin:
    what, *words = line.split()
    checked += 1
    if what == "struct":
        name, size = words
        asserts.append((f"sizeof(htvm_{snake(name)}) == {size}", line))
    elif what == "field":
        struct, name, offset, type_ = words
        c_struct, c_field = f"htvm_{snake(struct)}", snake(name)
        fields.setdefault(c_struct, []).append(c_field)
        asserts.append((f"offsetof({c_struct}, {c_field}) == {offset}", line))
        if type_ not in ("pointer", "struct"):
            asserts.append((f"_Generic((({c_struct}*)0)->{c_field}, {type_}: 1)", line))
    elif what == "constant":
        type_, name, value = words
        asserts.append((f"{constant_names[type_].format(snake(name).upper())} == {value}", line))
    elif what == "function":
        name, *types = words
        if functions.get(name) != types:
            wrong.append(f"{name} is declared {types}, but is {functions.get(name)}")

for struct, names in fields.items():
    body = re.search(rf"typedef struct {struct} \{{(.*?)\}} {struct};", text, re.S).group(1)
    body = re.sub(r"\(\*(\w+)\)\([^()]*\)", r"\1", body)
    if re.findall(r"(\w+)\s*[;,]", body) != names:
        wrong.append(f"{struct} does not have the fields {names}")

with tempfile.NamedTemporaryFile("w", suffix=".c") as source:
    print(f'#include <stddef.h>\n#include "{header}"', file=source)
    for condition, line in asserts:
        print(f'_Static_assert({condition}, "{line.strip()}");', file=source)
    source.flush()
    result = subprocess.run(["cc", "-std=c11", "-fsyntax-only", source.name], capture_output=True, text=True)
if checked < 100:
    wrong.append(f"only {checked} declarations were printed")
if wrong or result.returncode:
    sys.exit("\n".join(wrong) + "\n" + result.stderr)
print(f"{checked} declarations are those of htvm.h")
