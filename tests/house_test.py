"""The tree keeps its rules, and the checks of the rules notice when it does not."""

import os
import shutil
import tempfile
import unittest

import house_rules as rules

ROOT = os.environ.get("TETRALOD_SOURCE") or os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


class ThisTree(unittest.TestCase):
    def keeps(self, complaints):
        if complaints:
            self.fail("\n" + "\n".join(complaints))

    def test_stages_are_listed_and_described(self):
        self.keeps(rules.stage_folders(ROOT))

    def test_includes_never_point_down(self):
        self.keeps(rules.includes(ROOT))

    def test_file_names_are_unique_and_say_the_stage(self):
        self.keeps(rules.file_names(ROOT))

    def test_files_and_functions_are_short(self):
        self.keeps(rules.sizes(ROOT))

    def test_one_file_allocates(self):
        self.keeps(rules.allocation(ROOT))

    def test_the_library_is_quiet(self):
        self.keeps(rules.quiet_library(ROOT))

    def test_numbers_have_points_in_any_locale(self):
        self.keeps(rules.numbers_of_locales(ROOT))

    def test_every_function_is_used(self):
        self.keeps(rules.unused_functions(ROOT))

    def test_no_dead_code(self):
        self.keeps(rules.dead_code(ROOT))

    def test_public_headers_compile_alone(self):
        self.keeps(rules.lone_headers(ROOT))

    def test_documents_point_to_what_is_there(self):
        self.keeps(rules.doc_links(ROOT))

    def test_versions_agree(self):
        self.keeps(rules.versions(ROOT))

    def test_formatting(self):
        formatter = shutil.which("clang-format-14")
        if not formatter:
            self.skipTest("clang-format-14 is not installed")
        self.keeps(rules.formatting(ROOT, formatter))


GOOD_TREE = {
    "CMakeLists.txt": "project(tetralod VERSION 1.2.3)\n",
    "README.md": "See [the map](docs/MAP.md) and `src/STAGES`.\n",
    "docs/MAP.md": "A map.\n",
    "include/tetralod/base.h": "#define TL_VERSION 10203\nint tl_base(void);\n#define TL_BASE() tl_base()\n",
    "include/tetralod/mesh.h": '#include "tetralod/base.h"\nint tl_mesh(void);\n',
    "include/tetralod/tetralod.h": '#include "tetralod/mesh.h"\n',
    "src/STAGES": "base\nmesh\ncli\n",
    "src/base/README.md": "What all share.\n",
    "src/base/base.h": '#include "tetralod/base.h"\n',
    "src/base/base_memory.c": '#include "base/base.h"\n#include <stdlib.h>\n'
                              "int tl_base(void)\n{\n    free(malloc(1)); /* exit( */\n    return 0;\n}\n",
    "src/mesh/README.md": "Meshes.\n",
    "src/mesh/mesh_read.c": '#include "base/base.h"\n#include "tetralod/mesh.h"\n\n'
                            'int tl_mesh(void)\n{\n    return sizeof "printf(" > 0; // TODAY\n}\n',
    "src/cli/README.md": "The program.\n",
    "src/cli/cli_main.c": '#include "tetralod/tetralod.h"\n\nint main(void)\n{\n    return tl_mesh();\n}\n',
    "bench/bench_mesh.c": '#include "tetralod/tetralod.h"\n',
}
LONG_FUNCTION = "int tl_mesh_more(void)\n{\n" + "    (void)0;\n" * 100 + "    return 0;\n}\n"


class DamagedTree(unittest.TestCase):
    """Each case changes one thing in a good tree and expects the complaint that names it."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        for path, text in GOOD_TREE.items():
            self.put(path, text)

    def put(self, path, text):
        full = os.path.join(self.folder.name, path)
        os.makedirs(os.path.dirname(full), exist_ok=True)
        with open(full, "w", encoding="utf-8") as f:
            f.write(text)

    def append(self, path, text):
        self.put(path, rules.text_of(self.folder.name, path) + text)

    def names(self, rule, *expected):
        complaints = rule(self.folder.name)
        self.assertEqual(len(expected), len(complaints), complaints)
        for text, complaint in zip(expected, complaints):
            self.assertIn(text, complaint)

    def test_a_good_tree_gives_no_complaint(self):
        for rule in (rules.stage_folders, rules.includes, rules.file_names, rules.sizes, rules.allocation,
                     rules.quiet_library, rules.numbers_of_locales, rules.unused_functions, rules.dead_code, rules.lone_headers, rules.doc_links, rules.versions):
            self.assertEqual([], rule(self.folder.name), rule.__name__)

    def test_an_include_down_the_list(self):
        self.append("src/base/base_memory.c", '#include "mesh/mesh.h"\n')
        self.names(rules.includes, "src/base/base_memory.c:8: base includes 'mesh/mesh.h' of mesh")

    def test_a_public_include_down_the_list(self):
        self.append("src/base/base.h", ' # include "tetralod/mesh.h"\n')
        self.names(rules.includes, "src/base/base.h:2: base includes 'tetralod/mesh.h' of mesh")

    def test_a_public_header_that_includes_down_the_list(self):
        self.append("include/tetralod/base.h", '#include "tetralod/mesh.h"\n')
        self.names(rules.includes, "include/tetralod/base.h:4: base includes")

    def test_a_public_header_that_includes_an_internal_one(self):
        self.append("include/tetralod/mesh.h", '#include "base/base.h"\n')
        self.names(rules.includes, "a public header includes 'base/base.h'")

    def test_the_header_of_all_stages_inside_the_library(self):
        self.append("src/mesh/mesh_read.c", '#include "tetralod/tetralod.h"\n')
        self.names(rules.includes, "which includes all stages")

    def test_a_way_around_by_dots(self):
        self.append("src/base/base_memory.c", '#include "../mesh/mesh.h"\n')
        self.names(rules.includes, "a path that goes up")

    def test_a_face_that_reaches_inside(self):
        self.append("src/cli/cli_main.c", '#include "base/base.h"\n')
        self.append("bench/bench_mesh.c", '#include "mesh/mesh.h"\n')
        self.names(rules.includes, "src/cli/cli_main.c:7: a face includes", "bench/bench_mesh.c:2: a face includes")

    def test_a_stage_that_is_not_listed(self):
        self.put("src/misc/README.md", "All sorts.\n")
        self.names(rules.stage_folders, "src/misc: is not in src/STAGES")

    def test_a_stage_without_readme_and_one_with_a_long_one(self):
        os.remove(os.path.join(self.folder.name, "src/base/README.md"))
        self.put("src/mesh/README.md", "A line.\n" * 11)
        self.names(rules.stage_folders, "src/base: has no README.md", "src/mesh/README.md: 11 lines")

    def test_a_name_used_twice(self):
        self.put("tests/mesh_read.c", "")
        self.names(rules.file_names, "tests/mesh_read.c: is called like src/mesh/mesh_read.c")

    def test_a_name_without_its_stage(self):
        self.put("src/mesh/reading.c", "")
        self.names(rules.file_names, "src/mesh/reading.c: does not begin with 'mesh_'")

    def test_a_long_file(self):
        self.put("src/mesh/mesh_tables.c", "\n" * 1501)
        self.names(rules.sizes, "src/mesh/mesh_tables.c: 1501 lines")

    def test_a_long_function(self):
        self.append("src/mesh/mesh_read.c", LONG_FUNCTION)
        self.names(rules.sizes, "tl_mesh_more has 103 lines")

    def test_a_second_file_that_allocates(self):
        self.append("src/mesh/mesh_read.c", "void *p = realloc(0, 3);\n")
        self.names(rules.allocation, "src/mesh/mesh_read.c:8: calls realloc")

    def test_a_stage_that_allocates_where_base_does_not(self):
        self.put("src/base/base_memory.c", "")
        self.append("src/mesh/mesh_read.c", "void *p = malloc(3);\n")
        self.names(rules.allocation, "src/mesh/mesh_read.c:8: calls malloc")

    def test_a_library_that_speaks_up(self):
        self.append("src/mesh/mesh_read.c", 'void f(void)\n{\n    printf("x");\n    exit(1);\n}\n')
        self.append("src/base/base_memory.c", "char *home(void)\n{\n    abort();\n    return getenv(0);\n}\n")
        self.names(rules.quiet_library, "calls abort", "calls getenv", "calls printf", "calls exit")

    def test_numbers_that_depend_on_the_locale(self):
        self.append("src/mesh/mesh_read.c", 'void f(char *t)\n{\n    snprintf(t, 9, "%d %.3g", 1, strtod(t, 0));\n    snprintf(t, 9, "%.0f %d", 1.0, 1);\n}\n')
        self.names(rules.numbers_of_locales, "strtod depends", "snprintf of a real")

    def test_the_assert_may_abort(self):
        self.append("src/base/base_memory.c", "void tli_assert_failed(const char *c)\n{\n    abort();\n}\n")
        self.names(rules.quiet_library)

    def test_a_function_that_nobody_calls(self):
        self.append("src/base/base.h", "void tli_gone(int a,\n              int b);\n")
        self.append("src/base/base_memory.c", "void tli_gone(int a, int b)\n{\n}\n")
        self.names(rules.unused_functions, "src/base/base.h:2: tli_gone has neither caller nor test")

    def test_code_that_is_switched_off(self):
        self.append("src/mesh/mesh_read.c", "#if 0\n#endif\n/* TO" "DO: more */\n")
        self.names(rules.dead_code, "mesh_read.c:8", "mesh_read.c:10")

    def test_a_header_that_leans_on_another(self):
        self.append("include/tetralod/mesh.h", "size_t tl_mesh_count(void);\n")
        complaints = rules.lone_headers(self.folder.name)
        self.assertTrue(any("mesh.h: gcc" in c for c in complaints), complaints)
        self.assertTrue(any("mesh.h: g++" in c for c in complaints), complaints)

    def test_a_header_that_is_no_cplusplus(self):
        self.append("include/tetralod/mesh.h", "static inline int *tl_new(void *p)\n{\n    return p;\n}\n")
        complaints = rules.lone_headers(self.folder.name)
        self.assertFalse(any("-std=c17" in c for c in complaints), complaints)
        self.assertTrue(any("mesh.h: g++" in c for c in complaints), complaints)

    def test_a_document_that_points_nowhere(self):
        self.append("README.md", "[gone](docs/GONE.md) and `src/gone.c`\n")
        self.names(rules.doc_links, "README.md:2: nothing at 'docs/GONE.md'", "README.md:2: nothing at 'src/gone.c'")

    def test_versions_that_differ(self):
        self.put("CMakeLists.txt", "project(tetralod VERSION 1.2.4)\n")
        self.names(rules.versions, "TL_VERSION is 10203, expected 10204")

    def test_a_file_that_is_not_formatted(self):
        formatter = shutil.which("clang-format-14")
        if not formatter:
            self.skipTest("clang-format-14 is not installed")
        self.put(".clang-format", rules.text_of(ROOT, ".clang-format"))
        self.assertEqual([], rules.formatting(self.folder.name, formatter))
        self.append("src/mesh/mesh_read.c", "int  spaced ;\n")
        self.assertEqual(1, len(rules.formatting(self.folder.name, formatter)))


if __name__ == "__main__":
    unittest.main()
