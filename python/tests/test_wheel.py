"""The wheel's name follows from its library, and what would not run everywhere is refused."""

import io
import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

import htvm._interface

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import htvm_wheel  # noqa: E402
from library_tag import Unfit, platform_tag  # noqa: E402

library = Path(htvm._interface.library._name)
code = library.read_bytes()


def test_the_tag_has_the_newest_version_of_the_c_library_that_is_needed():
    newest = max(tuple(map(int, found)) for found in re.findall(rb"GLIBC_(\d+)\.(\d+)", code))
    assert platform_tag(code).startswith(f"manylinux_{newest[0]}_{newest[1]}_")
    newer = code.replace(b"GLIBC_%d.%d\0" % newest, b"GLIBC_2.97\0")
    assert platform_tag(newer).startswith("manylinux_2_97_")


def test_a_library_that_needs_another_is_refused():
    with pytest.raises(Unfit, match="needs libz.so.6"):
        platform_tag(code.replace(b"\0libm.so.6\0", b"\0libz.so.6\0"))


def test_a_library_that_looks_elsewhere_for_others_is_refused(tmp_path):
    source = tmp_path / "empty.c"
    source.write_text("")
    build = ["cc", "-shared", "-fPIC", "-o", str(tmp_path / "it.so"), str(source)]
    try:
        subprocess.run(build, check=True)
    except FileNotFoundError:
        pytest.skip("there is no C compiler")
    platform_tag((tmp_path / "it.so").read_bytes())
    subprocess.run([*build, "-Wl,-rpath,/opt/elsewhere"], check=True)
    with pytest.raises(Unfit, match="/opt/elsewhere"):
        platform_tag((tmp_path / "it.so").read_bytes())


@pytest.mark.parametrize("bytes_", [b"", b"a text", b"MZ" + bytes(100)])
def test_what_is_no_library_is_refused(bytes_):
    with pytest.raises(Exception):
        platform_tag(bytes_)


def test_the_wheel_has_its_tag_and_the_library(tmp_path):
    name = htvm_wheel.write_wheel(library, tmp_path)
    tag = platform_tag(code)
    assert name == f"htvm-{htvm_wheel.version()}-py3-none-{tag}.whl"
    with zipfile.ZipFile(tmp_path / name) as wheel:
        assert wheel.read("htvm/libhtvm.so") == code
        told = wheel.read(f"htvm-{htvm_wheel.version()}.dist-info/WHEEL").decode()
    assert f"Tag: py3-none-{tag}\n" in told


def test_the_source_distribution_is_the_same_twice_and_has_what_pip_and_cmake_need(tmp_path):
    name = htvm_wheel.write_source(tmp_path / "one")
    htvm_wheel.write_source(tmp_path / "two")
    archive = (tmp_path / "one" / name).read_bytes()
    assert archive == (tmp_path / "two" / name).read_bytes()
    stem = f"htvm-{htvm_wheel.version()}"
    with tarfile.open(fileobj=io.BytesIO(archive)) as files:
        names = files.getnames()
        settings = files.extractfile(f"{stem}/pyproject.toml").read().decode()
    for path in ("PKG-INFO", "CMakeLists.txt", "cmake/python.cmake", "src/c_api/exported_functions.map", "python/htvm/__init__.py"):
        assert f"{stem}/{path}" in names
    assert 'backend-path = ["python"]' in settings
