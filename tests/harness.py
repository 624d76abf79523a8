"""Runs one test program for ctest and keeps what each of its cases did.

    harness.py run --name NAME --cases FOLDER [--timeout S] -- PROGRAM [ARG...]
    harness.py unittest SCRIPT
    harness.py sum BUILD_FOLDER...

`run` starts PROGRAM in an empty folder of its own, which is also its TMPDIR and is removed
afterwards, and writes FOLDER/NAME.json. A program built on cmocka tells its cases by cmocka's XML;
anything else tells them on stdout as TAP: `ok 1 - name`, `not ok 2 - name`, `ok 3 - name # SKIP why`.
A Python script with unittest cases is run by `unittest`, which speaks TAP for it. A program that
tells no case, that ends badly without a failed case, that runs too long, or that skips without
saying why counts as one failed case.

`sum` adds up what the last ctest run in each build folder did, from its junit.xml and the kept
cases, prints what failed and what was skipped, and ends with `N passed, N failed, N skipped`.
"""

import argparse
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree

PASSED, FAILED, SKIPPED = "passed", "failed", "skipped"


def case(name, status, note=""):
    return {"name": name, "status": status, "note": note}


def cmocka_cases(text, output):
    """The cases of cmocka's XML, which is not always well-formed: messages are not escaped."""
    cases = []
    for suite in re.finditer(r'<testsuite name="(.*?)" ([^>]*)>(.*?)</testsuite>', text, re.S):
        counts = {k: int(v) for k, v in re.findall(r'(\w+)="(\d+)"', suite[2])}
        failed_before = sum(c["status"] == FAILED for c in cases)
        for found in re.finditer(r'<testcase name="(.*?)"[^>]*>(.*?)</testcase>', suite[3], re.S):
            name, body = found[1], found[2]
            failure = re.search(r"<failure><!\[CDATA\[(.*?)\]\]>", body, re.S)
            if failure:
                cases.append(case(name, FAILED, failure[1].strip()))
            elif "<skipped/>" in body:
                cases.append(skipped_case(name, output))
            else:
                cases.append(case(name, PASSED))
        failed = sum(c["status"] == FAILED for c in cases) - failed_before
        if counts.get("failures", 0) + counts.get("errors", 0) > failed:
            cases.append(case("group " + suite[1], FAILED, "set-up or tear-down failed"))
    return cases


def skipped_case(name, output):
    """cmocka's skip() takes no reason, so the test prints a line with the word skip before it."""
    lines = [line.strip() for line in output.splitlines() if "skip" in line.lower()]
    own = [line for line in lines if name in line]
    if not lines:
        return case(name, FAILED, "skipped without a line that says why")
    return case(name, SKIPPED, re.sub(rf"^skipped: *(?:{re.escape(name)}: *)?", "", (own or lines)[0]))


def tap_cases(output):
    cases = []
    for line in output.splitlines():
        m = re.match(r"(not )?ok\b *\d* *-? *(.*?)(?: # *SKIP\w* *(.*))?$", line, re.I)
        if not m:
            continue
        if m[3] is not None:
            cases.append(case(m[2], SKIPPED if m[3] else FAILED, m[3] or "skipped without a reason"))
        else:
            cases.append(case(m[2], FAILED if m[1] else PASSED))
    return cases


def ended(returncode):
    if returncode >= 0:
        return f"ended with status {returncode}"
    return f"was killed by {signal.Signals(-returncode).name}"


def start(command, folder, timeout):
    """Returns stdout, stderr and the returncode, None where the time ran out."""
    environment = dict(os.environ, TMPDIR=folder, CMOCKA_MESSAGE_OUTPUT="XML",
                       CMOCKA_XML_FILE=os.path.join(folder, "cmocka_%g.xml"))
    child = subprocess.Popen(command, cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                             stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                             errors="replace", start_new_session=True)
    try:
        out, err = child.communicate(timeout=timeout)
        return out, err, child.returncode
    except subprocess.TimeoutExpired:
        os.killpg(child.pid, signal.SIGKILL)
        out, err = child.communicate()
        return out, err, None


def command_of(program):
    if not program[0].endswith(".py"):
        return shlex.split(os.environ.get("TETRALOD_WRAP", "")) + program
    with open(program[0], encoding="utf-8") as script:
        uses_unittest = re.search(r"^import unittest|^from unittest", script.read(), re.M)
    return [sys.executable] + ([os.path.abspath(__file__), "unittest"] if uses_unittest else []) + program


def run(options):
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="tetralod-") as folder:
        out, err, returncode = start(command_of(options.program), folder, options.timeout)
        xml_text = err
        for name in sorted(os.listdir(folder)):
            if name.startswith("cmocka_"):
                with open(os.path.join(folder, name), encoding="utf-8", errors="replace") as f:
                    xml_text += f.read()
    cases = cmocka_cases(xml_text, out + err) if "<testsuite " in xml_text else tap_cases(out)
    if returncode is None:
        cases.append(case("time", FAILED, f"did not end within {options.timeout:g} s"))
    elif returncode != 0 and not any(c["status"] == FAILED for c in cases):
        cases.append(case("end", FAILED, ended(returncode)))
    if not cases:
        cases.append(case("cases", FAILED, "told of no test case"))

    os.makedirs(options.cases, exist_ok=True)
    with open(os.path.join(options.cases, options.name + ".json"), "w", encoding="utf-8") as f:
        json.dump(cases, f, indent=1)
    sys.stdout.write(out)
    sys.stdout.write(re.sub(r"<\?xml.*?</testsuites>\s*", "", err, flags=re.S))
    for c in cases:
        if c["status"] != PASSED:
            print(f"{c['status']} {options.name}: {c['name']}" + (f": {c['note']}" if c["note"] else ""))
    print(f"{len(cases)} cases in {time.monotonic() - began:.1f} s")
    return any(c["status"] == FAILED for c in cases)


class TapResult(unittest.TestResult):
    """Prints each case as a line of TAP, and the text of a failure as comment lines before it."""

    def line(self, good, test, rest=""):
        self.count = getattr(self, "count", 0) + 1
        name = getattr(test, "_testMethodName", None) or str(test)
        print(f"{'ok' if good else 'not ok'} {self.count} - {name}{rest}", flush=True)

    def bad(self, test, err):
        text = self._exc_info_to_string(err, test)
        print("".join("# " + line + "\n" for line in text.splitlines()), end="")
        self.line(False, test)

    def addSuccess(self, test):
        if not getattr(test, "failed_subtests", False):
            self.line(True, test)

    def addError(self, test, err):
        super().addError(test, err)
        self.bad(test, err)

    def addFailure(self, test, err):
        super().addFailure(test, err)
        self.bad(test, err)

    def addSubTest(self, test, subtest, err):
        super().addSubTest(test, subtest, err)
        if err:
            print("#", subtest.id())
            self.bad(test, err)
            test.failed_subtests = True

    def addSkip(self, test, reason):
        super().addSkip(test, reason)
        self.line(True, test, " # SKIP " + reason)

    def addExpectedFailure(self, test, err):
        self.line(False, test, " (an expected failure is no test)")

    def addUnexpectedSuccess(self, test):
        super().addUnexpectedSuccess(test)
        self.line(False, test)


def run_unittest(script):
    sys.path.insert(0, os.path.dirname(os.path.abspath(script)))
    sys.dont_write_bytecode = True
    name = os.path.splitext(os.path.basename(script))[0]
    suite = unittest.defaultTestLoader.loadTestsFromName(name)
    result = TapResult()
    suite.run(result)
    return not result.wasSuccessful()


def sum_up(folders):
    """Counts the cases of the tests that ctest ran; a test without kept cases is one case."""
    totals = {PASSED: 0, FAILED: 0, SKIPPED: 0}
    skipped = {}
    for folder in folders:
        label = os.path.basename(os.path.normpath(folder))
        junit = xml.etree.ElementTree.parse(os.path.join(folder, "junit.xml")).getroot()
        for test in junit.iter("testcase"):
            name, good = test.get("name"), test.get("status") == "run"
            path = os.path.join(folder, "cases", name + ".json")
            cases = []
            if os.path.exists(path):
                with open(path, encoding="utf-8") as f:
                    cases = json.load(f)
            if not cases or (not good and not any(c["status"] == FAILED for c in cases)):
                cases.append(case("program", PASSED if good else FAILED, test.get("status")))
            for c in cases:
                totals[c["status"]] += 1
                text = f"{name}: {c['name']}" + (f": {c['note']}" if c["note"] else "")
                if c["status"] == FAILED:
                    print(f"failed ({label}) {text}")
                elif c["status"] == SKIPPED:
                    skipped.setdefault(text, []).append(label)
        if not junit.findall(".//testcase"):
            totals[FAILED] += 1
            print(f"failed ({label}) ctest ran nothing")
    for text, labels in skipped.items():
        print(f"skipped ({', '.join(labels)}) {text}")
    print(f"{totals[PASSED]} passed, {totals[FAILED]} failed, {totals[SKIPPED]} skipped")
    return totals[FAILED] > 0 or totals[PASSED] == 0


def main():
    parser = argparse.ArgumentParser()
    verbs = parser.add_subparsers(dest="verb", required=True)
    verb = verbs.add_parser("run")
    verb.add_argument("--name", required=True)
    verb.add_argument("--cases", required=True)
    verb.add_argument("--timeout", type=float, default=280)
    verb.add_argument("program", nargs="+")
    verb = verbs.add_parser("unittest")
    verb.add_argument("script")
    verb = verbs.add_parser("sum")
    verb.add_argument("folders", nargs="+")
    options = parser.parse_args()
    if options.verb == "run":
        return run(options)
    if options.verb == "unittest":
        return run_unittest(options.script)
    return sum_up(options.folders)


if __name__ == "__main__":
    sys.exit(main())
