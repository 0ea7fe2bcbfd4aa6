"""_interface.py says of structs, constants and functions what the headers say."""

import ctypes
import re
import shutil
import subprocess

import pytest
from conftest import project

from htvm import _interface

headers = [project / "include/htvm/htvm.h", project / "python/native/mesh_files.h"]
structs = {name: value for name, value in vars(_interface).items()
           if isinstance(value, type) and issubclass(value, ctypes.Structure) and name.startswith("htvm_")}
constants = {name: value for name, value in vars(_interface).items() if name.startswith("HTVM_")}


def test_structs_and_constants_are_those_of_the_headers(tmp_path):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no C compiler")
    lines = ["#include <stddef.h>", "#include <stdint.h>"] + [f'#include "{header}"' for header in headers]
    for name, struct in structs.items():
        lines.append(f'_Static_assert(sizeof({name}) == {ctypes.sizeof(struct)}, "{name}");')
        for field, type_ in struct._fields_:
            described = getattr(struct, field)
            where = f"{name}.{field}"
            lines.append(f'_Static_assert(offsetof({name}, {field}) == {described.offset}, "{where}");')
            lines.append(f'_Static_assert(sizeof((({name}*)0)->{field}) == {described.size}, "{where}");')
            if type_ is not ctypes.c_void_p:
                spelt = ", ".join(f"{spelling}: 1, const {spelling}: 1" if "*" in spelling else f"{spelling}: 1"
                                  for spelling in field_types(type_))
                lines.append(f'_Static_assert(_Generic((({name}*)0)->{field}, {spelt}), "{where}");')
    lines += [f'_Static_assert({name} == {value}, "{name}");' for name, value in constants.items()]
    source = tmp_path / "layouts.c"
    source.write_text("\n".join(lines) + "\n")
    result = subprocess.run([compiler, "-std=c11", "-fsyntax-only", f"-I{project / 'include'}", str(source)],
                            capture_output=True, text=True)
    assert result.returncode == 0, result.stderr


def field_types(type_):
    """How C may spell the type of a field, as no two types that are the same."""
    return sorted(name.replace("char**", "char* const*") for name in of_ctypes(type_) - {"htvm_status", "size_t"})


@pytest.mark.parametrize("name", structs)
def test_structs_have_all_fields(name):
    body = re.search(rf"typedef struct {name} \{{(.*?)\}} {name};", declarations(), re.S).group(1)
    body = re.sub(r"\(\*(\w+)\)\([^()]*\)", r"\1", body)  # pointers to functions
    fields = re.findall(r"(\w+)\s*[;,]", body)
    assert fields == [field for field, _ in structs[name]._fields_]


def declarations():
    text = "\n".join(header.read_text() for header in headers)
    return re.sub(r"/\*.*?\*/|^#.*?$", "", text, flags=re.S | re.M)


def prototypes():
    """Of each function of the headers its result and its parameters, as C types without const."""
    for result, name, parameters in re.findall(r"([\w \*]+?)\b(htvm_\w+)\(([^()]*)\);", declarations()):
        types = [re.sub(r"(\w+)$", "", part.strip()) for part in parameters.split(",") if part.strip() != "void"]
        yield name, plain(result), [plain(type_) for type_ in types]


def plain(type_):
    return re.sub(r"\bconst\b|\s", "", type_)


def of_ctypes(type_):
    """How C spells a type of _interface.py; handles are pointers there."""
    if type_ is None:
        return {"void"}
    if isinstance(type_, type) and issubclass(type_, ctypes._Pointer):
        return {inner + "*" for inner in of_ctypes(type_._type_)}
    handles = {"htvm_decoder*", "htvm_encoder*", "htvm_encoder_options*", "htvm_dependencies*", "htvm_mesh_file*"}
    names = {ctypes.c_void_p: handles, ctypes.c_char_p: {"char*"}, ctypes.c_int32: {"int", "htvm_status"},
             ctypes.c_uint32: {"uint32_t"}, ctypes.c_int64: {"int64_t"}, ctypes.c_uint64: {"uint64_t", "size_t"},
             ctypes.c_uint8: {"uint8_t"}, ctypes.c_uint16: {"uint16_t"}, ctypes.c_double: {"double"},
             ctypes.c_float: {"float"}}
    return names.get(type_) or {type_.__name__}


def test_functions_are_those_of_the_headers():
    declared = {name: (result, parameters) for name, result, parameters in prototypes()}
    assert len(declared) > 50, "the headers were not understood"
    for name, (result, parameters) in _interface.functions.items():
        c_result, c_parameters = declared[name]
        assert c_result in of_ctypes(result), name
        assert len(c_parameters) == len(parameters), name
        for c_type, type_ in zip(c_parameters, parameters):
            assert c_type in of_ctypes(type_), f"{name}: {c_type}"
