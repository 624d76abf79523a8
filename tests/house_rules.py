"""The rules of the tree that a program can check. Each function takes the root of a tree and returns
a list of complaints, one line each, empty where all is well. house_test.py applies them to this tree
and, to see that they can fail, to damaged ones."""

import os
import re
import shutil
import subprocess

FACES = ("cli", "viewer", "serve")
FILE_LINES_MAX = 1500
FUNCTION_LINES_MAX = 100
STAGE_README_LINES_MAX = 10
# Straight lists of named steps that may be longer than FUNCTION_LINES_MAX: "file:function".
DRIVERS = ()
C_FOLDERS = ("include", "src", "tests", "fuzz", "examples", "bench")


def files(root, *folders, endings=(".c", ".h")):
    """Paths below root, in order; build trees and hidden folders are no part of the tree."""
    found = []
    for folder in folders:
        for path, subfolders, names in os.walk(os.path.join(root, folder)):
            subfolders[:] = sorted(s for s in subfolders if not s.startswith(".") and s != "build")
            found += [os.path.relpath(os.path.join(path, n), root) for n in sorted(names) if n.endswith(endings)]
    return found


def text_of(root, path):
    with open(os.path.join(root, path), encoding="utf-8") as f:
        return f.read()


def code_of(root, path):
    """The text with comments and the insides of literals blanked; line breaks stay."""
    def blank(found):
        kept = found[0]
        if kept[0] in "\"'":
            return kept[0] * 2
        return re.sub(r"[^\n]", " ", kept)
    pattern = r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\''
    return re.sub(pattern, blank, text_of(root, path), flags=re.S)


def stages_of(root):
    return text_of(root, "src/STAGES").split()


def line_of(text, offset):
    return text.count("\n", 0, offset) + 1


# ---- stages ----

def stage_folders(root):
    """src/STAGES lists the folders of src/, each with a README that can be read at a glance."""
    listed = stages_of(root)
    there = sorted(n for n in os.listdir(os.path.join(root, "src")) if os.path.isdir(os.path.join(root, "src", n)))
    complaints = [f"src/{s}: is not in src/STAGES" for s in there if s not in listed]
    for stage in listed:
        if stage not in there:
            complaints.append(f"src/STAGES: there is no folder for {stage}")
        elif not os.path.exists(os.path.join(root, "src", stage, "README.md")):
            complaints.append(f"src/{stage}: has no README.md")
        else:
            lines = text_of(root, f"src/{stage}/README.md").count("\n")
            if lines > STAGE_README_LINES_MAX:
                complaints.append(f"src/{stage}/README.md: {lines} lines, at most {STAGE_README_LINES_MAX}")
    return complaints


def included_stage(root, stages, path, name):
    """The stage that `#include "name"` in path reaches, None where it is all of them, or a complaint."""
    folder, _, file = name.rpartition("/")
    own = path.split("/")[1]
    if ".." in name.split("/"):
        return f"includes '{name}': a path that goes up"
    if folder == "tetralod":
        stage = file.removesuffix(".h")
        return None if stage == "tetralod" else (stages.index(stage) if stage in stages else f"includes '{name}', of no stage")
    if folder in stages:
        return stages.index(folder)
    if not folder and os.path.exists(os.path.join(root, os.path.dirname(path), file)):
        return stages.index(own) if own in stages else None
    return f"includes '{name}', which is in no stage"


def includes(root):
    """A file includes only what stands at or above its own stage; faces include public headers alone."""
    stages = stages_of(root)
    complaints = []
    for path in files(root, "include", "src", "examples", "bench"):
        parts = path.split("/")
        if parts[0] == "src" and parts[1] not in stages:
            continue  # stage_folders complains
        if parts[0] == "src":
            own = stages.index(parts[1])
        elif parts[0] == "include":
            own = stages.index(parts[-1][:-2]) if parts[-1][:-2] in stages else len(stages)
        else:
            own = len(stages)
        face = parts[0] in ("examples", "bench") or parts[1] in FACES
        text = text_of(root, path)
        for found in re.finditer(r'^[ \t]*#[ \t]*include[ \t]*(["<])([^">]+)[">]', text, re.M):
            quote, name = found[1], found[2]
            where = f"{path}:{line_of(text, found.start())}"
            if quote == "<":
                if name.startswith("tetralod/"):
                    complaints.append(f"{where}: includes <{name}>; own headers stand in quotes")
                continue
            reached = included_stage(root, stages, path, name)
            if isinstance(reached, str):
                complaints.append(f"{where}: {reached}")
            elif reached is None and not face and parts[0] == "src":
                complaints.append(f"{where}: includes '{name}', which includes all stages")
            elif reached is not None and reached > own:
                complaints.append(f"{where}: {stages[own]} includes '{name}' of {stages[reached]}, which stands below it")
            elif face and "/" in name and not name.startswith("tetralod/") and name.split("/")[0] != parts[1]:
                complaints.append(f"{where}: a face includes '{name}', which is not public")
            elif parts[0] == "include" and not name.startswith("tetralod/"):
                complaints.append(f"{where}: a public header includes '{name}', which is not public")
    return complaints


# ---- names and sizes ----

def file_names(root):
    """Names of C files are unique, and those of a stage begin with it."""
    complaints, first = [], {}
    for path in files(root, *C_FOLDERS, endings=(".c",)):
        name = os.path.basename(path)
        if name in first:
            complaints.append(f"{path}: is called like {first[name]}")
        first.setdefault(name, path)
        stage = path.split("/")[1]
        if path.startswith("src/") and not re.match(rf"{stage}(_\w+)?\.c$", name):
            complaints.append(f"{path}: does not begin with '{stage}_'")
    return complaints


def function_lengths(root, path):
    """(name, first line, lines) of each function; its braces stand in the first column."""
    lines = code_of(root, path).split("\n")
    found, opened = [], None
    for number, line in enumerate(lines):
        if line.startswith("{"):
            opened = number
        elif line.startswith("}") and opened is not None:
            head = " ".join(lines[max(0, opened - 8):opened])
            names = re.findall(r"(\w+)\s*\(", re.split(r"[;}]", head)[-1])
            found.append((names[0] if names else "?", opened + 1, number - opened + 1))
            opened = None
    return found


def sizes(root):
    complaints = []
    for path in files(root, *C_FOLDERS):
        lines = text_of(root, path).count("\n")
        if lines > FILE_LINES_MAX:
            complaints.append(f"{path}: {lines} lines, at most {FILE_LINES_MAX}")
        for name, line, length in function_lengths(root, path):
            if length > FUNCTION_LINES_MAX and f"{path}:{name}" not in DRIVERS:
                complaints.append(f"{path}:{line}: {name} has {length} lines, at most {FUNCTION_LINES_MAX}")
    return complaints


# ---- words that have no place ----

def calls(root, path, names):
    """(line, name) of each call of one of names, members like x->free( left out."""
    code = code_of(root, path)
    pattern = rf"(?<![\w.])(?<!->)({'|'.join(names)})\s*\("
    return [(line_of(code, m.start()), m[1]) for m in re.finditer(pattern, code)]


def allocation(root):
    """One file of base asks the system for memory."""
    names = ("malloc", "calloc", "realloc", "free", "strdup", "strndup", "aligned_alloc", "posix_memalign", "asprintf", "getline")
    users = {}
    for path in files(root, "src"):
        found = calls(root, path, names)
        if found:
            users[path] = found[0]
    allowed = [p for p in users if p.startswith("src/base/")][:1]
    return [f"{p}:{line}: calls {name}" for p, (line, name) in users.items() if p not in allowed]


def quiet_library(root):
    """The library never exits, prints, reads the environment or changes signals; only the assert aborts."""
    names = ("exit", "_exit", "quick_exit", "abort", "getenv", "secure_getenv", "setenv", "putenv", "printf", "vprintf",
             "puts", "putchar", "perror", "signal", "sigaction", "system", "popen", "setlocale")
    complaints = []
    for path in files(root, "src"):
        if path.split("/")[1] in FACES:
            continue
        code = code_of(root, path)
        has_assert = re.search(r"^(_Noreturn )?void tli_assert_failed\([^;]*\n{", code, re.M)
        for line, name in calls(root, path, names):
            if not (has_assert and name == "abort"):
                complaints.append(f"{path}:{line}: the library calls {name}")
        for found in re.finditer(r"\b(stdout|stderr|errx?\s*\()", code):
            if not has_assert:
                complaints.append(f"{path}:{line_of(code, found.start())}: the library uses {found[1]}")
    return complaints


def numbers_of_locales(root):
    """The library reads and writes numbers with points, whatever the locale of its host: by tli_print and tli_number_f64."""
    complaints = []
    for path in files(root, "src"):
        if path.split("/")[1] in FACES or "int tli_vprint(char *text" in text_of(root, path) and path.endswith(".c"):
            continue
        names = ("strtod", "strtof", "strtold", "atof", "sscanf", "fscanf", "vsnprintf", "vfprintf")
        complaints += [f"{path}:{line}: {name} depends on the locale" for line, name in calls(root, path, names)]
        for found in re.finditer(r"\b(sn|f)printf\([^;]*?%[-+ #0-9.*]*[aefgAEFG]", text_of(root, path)):
            if not found[0].endswith("%.0f"):
                complaints.append(f"{path}:{line_of(text_of(root, path), found.start())}: {found[1]}printf of a real depends on the locale")
    return complaints


def dead_code(root):
    complaints = []
    for path in files(root, *C_FOLDERS):
        text = text_of(root, path)
        for found in re.finditer(r"^\s*#\s*if\s+0\b|\b(TODO|FIXME|XXX)\b", text, re.M):
            complaints.append(f"{path}:{line_of(text, found.start())}: '{found[0].strip()}'")
    return complaints


def unused_functions(root):
    """Each function that other files can reach has a caller or a test."""
    declared, mentions = {}, {}
    for path in files(root, *C_FOLDERS):
        code = code_of(root, path)
        if path.endswith(".h"):
            for found in re.finditer(r"^(?!static|typedef|#|[ }])[^;{}()=]*?\b(tli?_\w+)\s*\(", code, re.M):
                declared.setdefault(found[1], f"{path}:{line_of(code, found.start(1))}")
            code = re.sub(r"^(?!static|[ }])[^;{}=#]*;", "", code, flags=re.M)
        else:
            code = re.sub(r"^(?!static|#|[ }])[^;{}=]*?(?=\n\{)", "", code, flags=re.M)
        for name in re.findall(r"\btli?_\w+\b", code):
            mentions[name] = mentions.get(name, 0) + 1
    return [f"{where}: {name} has neither caller nor test" for name, where in declared.items() if name not in mentions]


# ---- headers, formatting, words around the code ----

def lone_headers(root):
    """Each public header compiles alone, as C17 and as C++17, without a warning."""
    complaints = []
    strict = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only", "-I", os.path.join(root, "include")]
    compilers = [["gcc", "-std=c17", "-x", "c"], ["g++", "-std=c++17", "-x", "c++"]]
    if shutil.which("clang-14"):
        compilers += [["clang-14", "-std=c17", "-x", "c"], ["clang-14", "-std=c++17", "-x", "c++"]]
    for path in files(root, "include"):
        for compiler in compilers:
            done = subprocess.run(compiler + strict + ["-"], input=f'#include "{path.removeprefix("include/")}"\n',
                                  capture_output=True, text=True, check=False)
            if done.returncode:
                complaints.append(f"{path}: {' '.join(compiler)}: {done.stderr.strip()}")
    return complaints


def formatting(root, formatter):
    paths = files(root, *C_FOLDERS)
    done = subprocess.run([formatter, "--dry-run", "-Werror", *paths], cwd=root, capture_output=True, text=True, check=False)
    return sorted({f"{m}: not as {formatter} has it; ./run format" for m in re.findall(r"^(\S+?):\d+:\d+: ", done.stderr, re.M)})


def doc_links(root):
    """Relative links and the paths in backquotes of the documents lead to something."""
    complaints = []
    documents = [p for p in ("README.md", "CHANGELOG.md") if os.path.exists(os.path.join(root, p))]
    for path in documents + files(root, "docs", endings=(".md",)):
        text = text_of(root, path)
        for found in re.finditer(r"\]\(([^)#\s]+)(#[^)]*)?\)", text):
            target = found[1]
            if "://" not in target and not os.path.exists(os.path.join(root, os.path.dirname(path), target)):
                complaints.append(f"{path}:{line_of(text, found.start())}: nothing at '{target}'")
        for found in re.finditer(r"`((?:src|include|tests|docs|cmake|fuzz|bench|examples)/[\w./-]+)`", text):
            if not os.path.exists(os.path.join(root, found[1])):
                complaints.append(f"{path}:{line_of(text, found.start())}: nothing at '{found[1]}'")
    return complaints


def versions(root):
    """CMake and the header agree on the version."""
    cmake = re.search(r"project\(tetralod VERSION (\d+)\.(\d+)\.(\d+)", text_of(root, "CMakeLists.txt"))
    header = re.search(r"#define TL_VERSION (\d+)", text_of(root, "include/tetralod/base.h"))
    if not cmake or not header:
        return ["CMakeLists.txt, include/tetralod/base.h: no version found"]
    major, minor, patch = map(int, cmake.groups())
    expected = major * 10000 + minor * 100 + patch
    return [] if expected == int(header[1]) else [f"include/tetralod/base.h: TL_VERSION is {header[1]}, expected {expected}"]
