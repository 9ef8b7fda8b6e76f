"""Files are compiled in one batch only if none of them comes to mean something else by it."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
HEADER = "#pragma once\nnamespace spindle::layer {\nvoid used();\n}  // namespace spindle::layer\n"


def source(hidden="", shown="", include="#include <string>"):
    return (f"{include}\n\nnamespace spindle::layer {{\nnamespace {{\n\n{hidden}\n\n}}  // namespace\n\n{shown}\n\n"
            "}  // namespace spindle::layer\n")


class BatchesTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def compiled(self, way, *texts, **headers):
        """The names of the files that are to be compiled instead of the given ones."""
        for name, text in headers.items():
            (self.folder / f"{name}.hpp").write_text(text)
        paths = [self.folder / f"file_{number}.cpp" for number in range(len(texts))]
        for path, text in zip(paths, texts):
            path.write_text(text)
        command = [sys.executable, ROOT / "cmake" / "batches.py", "--output", self.folder / "out", "--include",
                   self.folder, way, *paths]
        printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        return [pathlib.Path(path).name for path in printed.split(";")]

    def assert_together(self, *texts, **headers):
        self.assertEqual(self.compiled("--proven", *texts, **headers), ["batch_0.cpp"])

    def assert_apart(self, *texts, **headers):
        self.assertEqual(self.compiled("--proven", *texts, **headers),
                         [f"file_{number}.cpp" for number in range(len(texts))])

    def test_a_batch_has_all_headers_before_all_files(self):
        self.assertEqual(self.compiled("--wrapped", '#include "a.hpp"\nint a;', "#include <map>\nint a;", a=HEADER),
                         ["batch_0.cpp"])
        self.assertEqual((self.folder / "out" / "batch_0.cpp").read_text(), (
            f'#include "{self.folder}/a.hpp"\n#include <map>\n'
            f'namespace file_0 {{\n#include "{self.folder}/file_0.cpp"\n}}\n'
            f'namespace file_1 {{\n#include "{self.folder}/file_1.cpp"\n}}\n'))

    def test_what_reaches_out_of_a_namespace_stays_alone(self):
        for text in ("namespace spindle {\n}", "template <>\nstruct A<int> {};", "#define A", 'extern "C" void f();'):
            self.assertEqual(self.compiled("--wrapped", "int a;", text, "int b;"), ["batch_0.cpp", "file_1.cpp"])

    def test_private_names_that_no_other_file_mentions_are_safe(self):
        self.assert_together(source("int first() { return 1; }"), source("int second() { return 2; }"))

    def test_a_private_name_of_two_files_keeps_them_apart(self):
        for one in ("int same() { return 1; }", "struct same {};", "constexpr double same = 1;",
                    "using same = int;", "enum class same { a };", "const std::map<int, std::pair<int, int>> same{};",
                    "template <typename T>\nbool same(T) { return true; }"):
            self.assert_apart(source(one), source("int same(int) { return 2; }"))

    def test_a_private_name_that_another_file_mentions_keeps_them_apart(self):
        self.assert_apart(source("void used(double) {}"), source("", "void f() { used(1); }", '#include "a.hpp"'),
                          a=HEADER)

    def test_what_is_no_name_of_the_namespace_is_not_taken_for_a_mention(self):
        self.assert_together(source("void name(double) {}"), source("", 'void f() { a.name(1); b->name(); c("name"); }'),
                             source("", "void g() { other::name(); } // name"))

    def test_an_overload_that_only_another_file_sees_keeps_them_apart(self):
        more = HEADER.replace("used()", "used(int)")
        self.assert_apart(source("", "void f() { used(); }", '#include "a.hpp"'), source("", "", '#include "b.hpp"'),
                          a=HEADER, b=more)

    def test_a_nearer_type_that_only_another_file_sees_keeps_them_apart(self):
        far = "#pragma once\nnamespace spindle {\nstruct Range {};\n}  // namespace spindle\n"
        near = far.replace("spindle {", "spindle::layer {")
        elsewhere = far.replace("spindle {", "spindle::other {")
        user = source("", "void f(Range) {}", '#include "far.hpp"')
        self.assert_apart(user, source("", "", '#include "near.hpp"'), far=far, near=near)
        self.assert_together(user, source("", "", '#include "elsewhere.hpp"'), far=far, elsewhere=elsewhere)

    def test_an_import_is_shared_only_by_files_that_mean_the_same(self):
        one = source("using one::Name;", "Name f();")
        self.assert_together(one, source("using one::Name;", "Name g();"))
        self.assert_apart(one, source("using other::Name;", "Name g();"))

    def test_what_is_not_understood_stays_alone(self):
        for line in ("#define A", "template <>", "bool operator==(A, B) { return true; }", "enum Old { a };",
                     'extern "C" void f();', "using namespace other;", "SOME_MACRO", "inline namespace a {",
                     "void swap(A&, A&) {}"):
            self.assert_apart(source(line), source())


if __name__ == "__main__":
    unittest.main()
