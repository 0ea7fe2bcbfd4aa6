#!/usr/bin/env python3
"""What check.py finds in small trees that are made for it."""
import os
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
import check  # noqa: E402


class Tree(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.tree = folder.name
        for header in ("include/htvm/mesh.hpp", "include/htvm/decoder.hpp", "include/htvm/encoder.hpp",
                       "src/core/bytes.h", "src/surface/surface_index.h", "src/codec/format/sequence.h",
                       "src/codec/reference/reference.h", "src/codec/tracked/tracked_frame.h",
                       "src/codec/bones/codebook.h", "src/codec/encoder/coded_frame.h",
                       "src/codec/encoder/tracked/tracked_strategy.h", "src/codec/encoder/bones/bones_strategy.h",
                       "src/codec/encoder/control/rate_control.h", "src/live/client/line.h", "src/live/hub/hub.h",
                       "src/live/server/server.h", "apps/htvm/commands.h", "apps/command_line/program.h"):
            self.write(header)

    def write(self, path, *lines):
        whole = os.path.join(self.tree, path)
        os.makedirs(os.path.dirname(whole), exist_ok=True)
        with open(whole, "w", encoding="utf-8") as file:
            file.writelines(line + "\n" for line in lines)

    def found(self):
        return list(check.offences(self.tree))

    def assert_allowed(self, path, *headers):
        self.write(path, *(f'#include "{header}"' for header in headers))
        self.assertEqual(self.found(), [])

    def assert_refused(self, path, header):
        self.write(path, "// A comment first.", f'#include "{header}"')
        found = self.found()
        os.remove(os.path.join(self.tree, path))
        self.assertEqual(len(found), 1, f"{path} may include {header}")
        self.assertTrue(found[0].startswith(f"{path}:2: includes "), found[0])

    def test_a_higher_floor_includes_lower_ones(self):
        self.assert_allowed("src/codec/tracked/a.cpp", "codec/tracked/tracked_frame.h", "codec/reference/reference.h",
                            "codec/format/sequence.h", "core/bytes.h", "htvm/mesh.hpp", "vector.h")
        self.assert_allowed("src/codec/encoder/tracked/a.cpp", "codec/encoder/coded_frame.h",
                            "codec/tracked/tracked_frame.h", "surface/surface_index.h", "htvm/encoder.hpp")
        self.assert_allowed("src/codec/encoder/encoder.cpp", "codec/encoder/tracked/tracked_strategy.h",
                            "codec/encoder/bones/bones_strategy.h", "htvm/decoder.hpp")
        self.assert_allowed("src/live/server/a.cpp", "live/hub/hub.h", "live/client/line.h")
        self.assert_allowed("apps/htvm/a.cpp", "commands.h", "command_line/program.h", "live/server/server.h",
                            "codec/encoder/control/rate_control.h", "htvm/encoder.hpp")

    def test_a_lower_floor_includes_no_higher_one(self):
        for path, header in (("src/core/a.cpp", "codec/format/sequence.h"),
                             ("src/codec/format/a.cpp", "codec/bones/codebook.h"),
                             ("src/codec/reference/a.h", "codec/tracked/tracked_frame.h"),
                             ("src/codec/decoder/a.cpp", "codec/encoder/coded_frame.h"),
                             ("src/codec/decoder/a.cpp", "surface/surface_index.h"),
                             ("src/codec/encoder/a.cpp", "codec/encoder/tracked/tracked_strategy.h"),
                             ("src/live/client/a.cpp", "live/hub/hub.h"),
                             ("src/live/hub/a.cpp", "live/server/server.h"),
                             ("src/live/server/a.cpp", "htvm/commands.h"),
                             ("include/htvm/a.hpp", "core/bytes.h"),
                             ("apps/command_line/a.cpp", "htvm/commands.h")):
            self.assert_refused(path, header)

    def test_the_strategies_do_not_know_each_other_and_the_control_knows_neither(self):
        for path, header in (("src/codec/tracked/a.cpp", "codec/bones/codebook.h"),
                             ("src/codec/bones/a.cpp", "codec/tracked/tracked_frame.h"),
                             ("src/codec/encoder/tracked/a.cpp", "codec/encoder/bones/bones_strategy.h"),
                             ("src/codec/encoder/bones/a.cpp", "codec/encoder/tracked/tracked_strategy.h"),
                             ("src/codec/encoder/control/a.cpp", "codec/encoder/tracked/tracked_strategy.h"),
                             ("src/codec/encoder/control/a.cpp", "codec/encoder/bones/bones_strategy.h"),
                             ("src/codec/encoder/control/a.cpp", "codec/tracked/tracked_frame.h")):
            self.assert_refused(path, header)

    def test_public_headers_of_a_floor_are_not_for_those_below(self):
        for path, header in (("src/core/a.cpp", "htvm/decoder.hpp"), ("src/codec/decoder/a.cpp", "htvm/encoder.hpp"),
                             ("src/codec/encoder/tracked/a.cpp", "htvm/decoder.hpp"),
                             ("src/io/a.cpp", "htvm/encoder.hpp"), ("include/htvm/a.hpp", "htvm/decoder.hpp")):
            self.assert_refused(path, header)

    def test_every_way_to_write_an_include_is_seen(self):
        self.write("src/core/a.cpp", "#include <codec/format/sequence.h>", '  #  include   "codec/format/sequence.h"',
                   '#include "../codec/format/sequence.h"', '#include "./bytes.h"  // its own',
                   '// #include "codec/format/sequence.h"')
        self.assertEqual([line.split(":")[1] for line in self.found()], ["1", "2", "3"])

    def test_what_is_allowed_is_said(self):
        self.write("src/surface/a.cpp", '#include "codec/format/sequence.h"')
        self.assertEqual(self.found(), ["src/surface/a.cpp:1: includes src/codec/format/sequence.h; "
                                        "allowed: surface, include/htvm, core"])

    def test_a_folder_without_a_row_is_found(self):
        self.write("src/codec/utils/a.h")
        found = self.found()
        self.assertEqual(len(found), 1)
        self.assertTrue(found[0].startswith("src/codec/utils: "), found[0])

    def test_the_program_fails_where_something_is_found(self):
        program = [sys.executable, "-B", os.path.join(HERE, "check.py"), self.tree]
        self.assertEqual(subprocess.run(program, check=False).returncode, 0)
        self.write("src/core/a.cpp", '#include "codec/format/sequence.h"')
        done = subprocess.run(program, check=False, stdout=subprocess.PIPE, text=True)
        self.assertEqual((done.returncode, done.stdout.count("\n")), (1, 1))


class Table(unittest.TestCase):
    def test_each_row_names_only_rows_above_it_in_the_table(self):
        above = set(check.INTERFACES)
        for folder, allowed in check.FLOORS:
            self.assertLessEqual(set(allowed), above, folder)
            above.add(folder.removeprefix("src/"))

    def test_each_row_is_of_something_that_is_there(self):
        tree = os.path.join(HERE, "..", "..")
        for path in [*(row for row, _ in check.FLOORS), *("include/" + header for header in check.INTERFACES)]:
            self.assertTrue(os.path.exists(os.path.join(tree, path)), path)


if __name__ == "__main__":
    unittest.main()
