#!/usr/bin/env python3
"""Which tests quick.py runs for a change, and what it says in builds that are made for it."""
import glob
import os
import re
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
import quick  # noqa: E402


def sources_of(program):
    return glob.glob(os.path.join(quick.TREE, "tests", program, "*.cpp"))


class Choice(unittest.TestCase):
    def test_a_changed_floor_is_tested_and_so_are_those_right_above(self):
        self.assertEqual(quick.programs_of("src/core/lattice.h"), ["core", "entropy", "surface", "codec", "io"])
        self.assertEqual(quick.programs_of("src/codec/encoder/tracked/group_coder.cpp"), ["codec", "c_api"])
        self.assertEqual(quick.programs_of("src/live/hub/hub.h"), ["live"])
        self.assertEqual(quick.programs_of("apps/htvm/encode.cpp"), ["apps"])

    def test_a_changed_test_runs_its_program(self):
        self.assertEqual(quick.programs_of("tests/codec/ball.h"), ["codec"])
        self.assertEqual(quick.programs_of("tests/data/conformance/tracked.htvm"), ["codec"])

    def test_what_no_program_tests_runs_none(self):
        for path in ("README.md", "web/build.mjs", "tests/apps/serve.sh", "tests/digests/digests.cpp",
                     "bench/captures.h"):
            self.assertEqual(quick.programs_of(path), [], path)

    def test_every_folder_of_src_has_a_program(self):
        for folder in os.listdir(os.path.join(quick.TREE, "src")):
            self.assertTrue(quick.programs_of(f"src/{folder}/a.cpp"), folder)

    def test_the_programs_are_those_of_the_build(self):
        with open(os.path.join(quick.TREE, "cmake", "tests.cmake"), encoding="utf-8") as file:
            self.assertEqual(set(quick.PROGRAMS), set(re.findall(r"^ *htvm_tests\((\w+)", file.read(), re.M)))

    def test_every_name_that_is_not_quick_is_that_of_a_test(self):
        for program, names in quick.NOT_QUICK.items():
            tests = set()
            for path in sources_of(program):
                with open(path, encoding="utf-8") as file:
                    tests |= set(re.findall(r"^\s*(?:TEST|TEST_F|TEST_P)\((\w+),\s*(\w+)\)", file.read(), re.M))
            for name in names:
                suite, test = name.removeprefix("*/").split(".")
                self.assertTrue([t for t in tests if t[0] == suite and test in ("*", t[1], t[1] + "*")], name)


class Run(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.build = folder.name

    def run_with(self, script, seconds=30, build_first="true"):
        """The exit status and output of quick.py for a change of core, where test_core is this shell script."""
        self.write("script", f"#!/bin/sh\n{script}\n")
        self.write("compile_commands.json", "[]")
        self.write("build.ninja", f"rule make\n  command = {build_first} && cp script $out && chmod +x $out\n"
                                  "build test_core: make script\n")
        done = subprocess.run([sys.executable, "-B", os.path.join(HERE, "quick.py"), self.build, str(seconds),
                               "tests/core/bytes_test.cpp"], check=False, capture_output=True, text=True)
        return done.returncode, done.stdout + done.stderr

    def write(self, name, text):
        with open(os.path.join(self.build, name), "w", encoding="utf-8") as file:
            file.write(text)

    def test_it_says_how_many_tests_passed(self):
        status, said = self.run_with('[ "$GTEST_SHARD_INDEX" = 0 ] || exit 0\n'
                                     'echo "[==========] 12 tests from 3 test suites ran. (5 ms total)"')
        self.assertEqual(status, 0)
        self.assertIn("Ran: 12 tests of test_core.", said)

    def test_a_test_that_fails_is_shown(self):
        status, said = self.run_with('echo "bytes_test.cpp:7: Failure"; exit 1')
        self.assertEqual(status, 1)
        self.assertIn("bytes_test.cpp:7: Failure", said)

    def test_what_does_not_compile_is_shown(self):
        status, said = self.run_with("true", build_first="echo bytes.h:3: error && false")
        self.assertEqual(status, 1)
        self.assertIn("bytes.h:3: error", said)

    def test_when_the_time_is_over_it_says_what_is_left(self):
        status, said = self.run_with("true", seconds=0.5, build_first="exec sleep 20")
        self.assertEqual(status, 0)
        self.assertIn("Left to ./dev test: test_core, which was not built in time", said)

    def test_it_stops_tests_when_the_time_is_over(self):
        self.write("test_core", "#!/bin/sh\nexec sleep 20\n")
        os.chmod(os.path.join(self.build, "test_core"), 0o755)
        run = quick.Quick(self.build, 0.1)
        run.ninja = lambda *targets: None  # it is built
        run.test("core")
        self.assertEqual((run.ran, run.left), ([], ["test_core, which was not over in time"]))


if __name__ == "__main__":
    unittest.main()
