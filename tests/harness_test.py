"""The harness counts what passes, and nothing that fails passes by it."""

import json
import os
import stat
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
HARNESS = os.path.join(HERE, "harness.py")

CMOCKA_XML = """<?xml version="1.0" encoding="UTF-8" ?>
<testsuites>
  <testsuite name="{group}" time="0.000" tests="3" failures="{failures}" errors="{errors}" skipped="0" >
    {cases}
  </testsuite>
</testsuites>
"""


class Harness(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def script(self, name, text):
        path = os.path.join(self.folder, name)
        with open(path, "w", encoding="utf-8") as f:
            f.write(text)
        os.chmod(path, os.stat(path).st_mode | stat.S_IXUSR)
        return path

    def run_program(self, path, timeout=60):
        done = subprocess.run([sys.executable, HARNESS, "run", "--name", "t", "--cases", self.folder, "--timeout",
                               str(timeout), "--", path], capture_output=True, text=True, check=False)
        with open(os.path.join(self.folder, "t.json"), encoding="utf-8") as f:
            return [(c["name"], c["status"], c["note"]) for c in json.load(f)], done.returncode, done.stdout

    def run_shell(self, text, timeout=60):
        return self.run_program(self.script("t.sh", "#!/bin/sh\n" + text), timeout)

    def run_cmocka(self, cases, end=0, failures=0, errors=0, before=""):
        xml = CMOCKA_XML.format(group="g", cases=cases, failures=failures, errors=errors)
        self.script("out.xml", xml)
        return self.run_shell(f"{before}\ncp '{self.folder}/out.xml' \"$(dirname \"$CMOCKA_XML_FILE\")/cmocka_g.xml\"\nexit {end}\n")

    def test_tap_lines_are_cases(self):
        cases, end, _ = self.run_shell("echo 'ok 1 - one'; echo 'ok 2 - two # SKIP no data'; echo noise; echo okay\n")
        self.assertEqual([("one", "passed", ""), ("two", "skipped", "no data")], cases)
        self.assertEqual(0, end)

    def test_a_failed_line_fails_even_with_status_0(self):
        cases, end, _ = self.run_shell("echo 'not ok 1 - one'\n")
        self.assertEqual(([("one", "failed", "")], 1), (cases, end))

    def test_a_program_without_cases_fails(self):
        cases, end, _ = self.run_shell("exit 0\n")
        self.assertEqual(([("cases", "failed", "told of no test case")], 1), (cases, end))

    def test_a_crash_fails_after_good_cases(self):
        cases, end, _ = self.run_shell("echo 'ok 1 - one'; kill -SEGV $$\n")
        self.assertEqual([("one", "passed", ""), ("end", "failed", "was killed by SIGSEGV")], cases)
        self.assertEqual(1, end)

    def test_a_bad_status_fails_after_good_cases(self):
        cases, _, _ = self.run_shell("echo 'ok 1 - one'; exit 3\n")
        self.assertEqual(("end", "failed", "ended with status 3"), cases[1])

    def test_a_program_that_hangs_is_ended_with_its_children(self):
        cases, end, _ = self.run_shell("echo 'ok 1 - one'; sleep 60 & wait\n", timeout=1)
        self.assertEqual(("time", "failed", "did not end within 1 s"), cases[1])
        self.assertEqual(1, end)

    def test_cmocka_cases_are_counted_one_by_one(self):
        cases, end, _ = self.run_cmocka('<testcase name="a" time="0" >\n</testcase><testcase name="b" time="0" >\n</testcase>')
        self.assertEqual([("a", "passed", ""), ("b", "passed", "")], cases)
        self.assertEqual(0, end)

    def test_a_cmocka_failure_with_odd_text(self):
        cases, end, _ = self.run_cmocka('<testcase name="a" ><failure><![CDATA[1 < 2 & \x01]]></failure></testcase>', 1, failures=1)
        self.assertEqual("failed", cases[0][1])
        self.assertEqual(1, end)

    def test_a_cmocka_group_that_was_not_set_up(self):
        cases, end, _ = self.run_cmocka("", 1, errors=1)
        self.assertEqual([("group g", "failed", "set-up or tear-down failed")], cases)
        self.assertEqual(1, end)

    def test_a_cmocka_skip_says_why(self):
        skipped = '<testcase name="a" ><skipped/></testcase>'
        cases, end, _ = self.run_cmocka(skipped, before="echo 'skipped: a: no data'")
        self.assertEqual([("a", "skipped", "no data")], cases)
        self.assertEqual(0, end)
        cases, end, _ = self.run_cmocka(skipped)
        self.assertEqual(("failed", 1), (cases[0][1], end))

    def test_unittest_scripts(self):
        path = self.script("sample_test.py", "import unittest\n\n\nclass T(unittest.TestCase):\n"
                           "    def test_good(self):\n        pass\n\n"
                           "    def test_bad(self):\n        self.assertEqual(1, 2)\n\n"
                           "    def test_error(self):\n        raise OSError('x')\n\n"
                           "    def test_sub(self):\n        with self.subTest(i=1):\n            self.fail('no')\n\n"
                           "    @unittest.skip('not here')\n    def test_skip(self):\n        pass\n")
        cases, end, out = self.run_program(path)
        self.assertEqual([("test_bad", "failed", ""), ("test_error", "failed", ""), ("test_good", "passed", ""),
                          ("test_skip", "skipped", "not here"), ("test_sub", "failed", "")], cases)
        self.assertEqual(1, end)
        self.assertIn("1 != 2", out)

    def test_a_script_that_can_not_be_loaded(self):
        cases, end, _ = self.run_program(self.script("broken_test.py", "import unittest\nimport no_such_module\n"))
        self.assertEqual(("failed", 1), (cases[0][1], end))

    def test_programs_run_in_a_folder_that_goes_away(self):
        _, _, out = self.run_shell("touch left; echo \"$PWD\" \"$TMPDIR\"; echo 'ok 1 - one'\n")
        own, temporary = out.split("\n", maxsplit=1)[0].split(" ")
        self.assertEqual(own, temporary)
        self.assertFalse(os.path.exists(own))

    def sum_up(self, junit, cases):
        os.makedirs(os.path.join(self.folder, "cases"))
        with open(os.path.join(self.folder, "junit.xml"), "w", encoding="utf-8") as f:
            f.write(f"<testsuite>{junit}</testsuite>")
        for name, statuses in cases.items():
            with open(os.path.join(self.folder, "cases", name + ".json"), "w", encoding="utf-8") as f:
                json.dump([{"name": "c", "status": s, "note": "why"} for s in statuses], f)
        done = subprocess.run([sys.executable, HARNESS, "sum", self.folder], capture_output=True, text=True, check=False)
        return done.stdout.splitlines()[-1], done.returncode, done.stdout

    def test_the_sum_counts_cases(self):
        last, end, out = self.sum_up('<testcase name="a" status="run"/><testcase name="b" status="run"/>',
                                     {"a": ["passed", "passed", "skipped"], "b": ["passed"], "stale": ["failed"]})
        self.assertEqual(("3 passed, 0 failed, 1 skipped", 0), (last, end))
        self.assertIn("a: c: why", out)

    def test_the_sum_fails_with_a_case(self):
        last, end, _ = self.sum_up('<testcase name="a" status="fail"/>', {"a": ["passed", "failed"]})
        self.assertEqual(("1 passed, 1 failed, 0 skipped", 1), (last, end))

    def test_the_sum_fails_where_ctest_saw_what_the_cases_do_not_tell(self):
        last, end, _ = self.sum_up('<testcase name="a" status="fail"/><testcase name="b" status="fail"/>', {"a": ["passed"]})
        self.assertEqual(("1 passed, 2 failed, 0 skipped", 1), (last, end))

    def test_the_sum_fails_where_nothing_ran(self):
        last, end, _ = self.sum_up("", {})
        self.assertEqual(("0 passed, 1 failed, 0 skipped", 1), (last, end))


if __name__ == "__main__":
    unittest.main()
