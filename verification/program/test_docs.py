"""The site: what scripts/docs_filter.py hands to Doxygen, and, where Doxygen and MathJax are installed, the pages that come of it."""
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

from harness import ProgramTest, load_script

docs = load_script("docs")
docs_filter = docs.docs_filter


class Headers(unittest.TestCase):
    def filtered(self, *lines, stem=""):
        text = "\n".join(["// A header.", "#pragma once", "", "namespace nscdd { inline namespace NSCDD_ABI {", "", *lines, "", "}}  // namespace nscdd::NSCDD_ABI"]) + "\n"
        out = docs_filter.header(text, stem)
        self.assertEqual(out.count("\n"), text.count("\n"), "lines of warnings would be wrong")
        self.assertTrue(out.startswith("/// \\aboutfile A header.\n"))
        return out.split("\n")[5:5 + len(lines)]

    def test_comments_before_and_behind_belong_to_names(self):
        self.assertEqual(self.filtered("// A pair.", "struct Pair {", "    int i = 0;  // the first, i < j", "    double gap;  // negative where",
                                       "                 // they overlap", "};", "struct Empty {};  // nothing"),
                         ["/// A pair.", "struct Pair {", "    int i = 0; /**< the first, i \\< j */", "    double gap; /**< negative where */",
                          "                 ///< they overlap", "};", "/** nothing */ struct Empty {};"])

    def test_what_is_within_a_function_is_not_told(self):
        lines = ["// Adds.", "template <class M>", "int add(int a,  // one", "        int b) {", "    // why", "    int c = a;  // a copy",
                 "    return c + b;", "}"]
        self.assertEqual(self.filtered(*lines), ["/// Adds.", "template <class M>", "int add(int a,", *lines[3:5], "    int c = a;", *lines[6:]])

    def test_a_function_with_braces_among_its_parameters_ends_where_its_body_does(self):
        self.assertEqual(self.filtered("struct A {", "    void f(B b = {}) {", "        b();", "    }", "    // After.", "    int a;", "};")[4:6],
                         ["    /// After.", "    int a;"])

    def test_a_comment_on_two_variables_is_that_of_both(self):
        self.assertEqual(self.filtered("std::map<int, int> a{1, 2}, b;  // both"),
                         ["std::map<int, int> a{1, 2}; /**< both */ std::map<int, int> b; /**< both */"])
        self.assertEqual(self.filtered("// Both.", "int a = f(1, 2), b = 3;"), ["/// Both.", "int a = f(1, 2); /** Both. */ int b = 3;"])

    def test_overloads_and_the_name_of_the_file_share_a_comment(self):
        self.assertEqual(self.filtered("// Of one.", "int size(int a);", "int size(double a);", "int other();"),
                         ["/// Of one.", "int size(int a);", "/** Of one. */ int size(double a);", "int other();"])
        self.assertEqual(self.filtered("template <class M>", "struct TheName {", "};", stem="the_name"),
                         ["/** A header. */ template <class M>", "struct TheName {", "};"])

    def test_code_in_a_comment_stays_code(self):
        self.assertEqual(self.filtered("// As in", "//", "//   a < b;", "//", "// and so on.", "int a;"),
                         ["/// As in", "/// \\code{.cpp}", "/// a < b;", "/// \\endcode", "/// and so on.", "int a;"])

    def test_every_header_keeps_its_lines(self):
        for path in (docs.ROOT / "kernel/include").rglob("*.hpp"):
            text = path.read_text()
            self.assertEqual(docs_filter.header(text, path.stem).count("\n"), text.count("\n"), path)


class Pages(unittest.TestCase):
    def filtered(self, text, file="kernel/METHOD.md"):
        return docs_filter.page(text, docs.ROOT / file)

    def test_headings_formulas_and_links(self):
        self.assertEqual(self.filtered("# Title\n\n## 2.1 A b, c\n\nLet $a$ and $$ b $$, not `$c$`.\n"),
                         "# Title {#METHOD}\n\n## 2.1 A b, c {#METHOD_21-a-b-c}\n\nLet \\f$a\\f$ and \\f[ b \\f], not `$c$`.\n")
        self.assertEqual(self.filtered("[x](#21-a-b-c) [y](REFERENCES.md) [z](../scripts/docs) [u](https://a.b/c)"),
                         '@ref METHOD_21-a-b-c "x" @ref REFERENCES "y" z (`scripts/docs`) [u](https://a.b/c)')
        self.assertEqual(self.filtered("[x](energy.md), [again](energy.md)", "reports/findings/README.md"),
                         '@subpage findings-energy "x", @ref findings-energy "again"')

    def test_commands_stay_as_they_are(self):
        self.assertEqual(self.filtered("Run\n\n    scripts/x $HOME [a](b)\n    y\n\nthen.\n"),
                         "Run\n\n```{.unparsed}\nscripts/x $HOME [a](b)\ny\n```\n\n\nthen.\n")


@unittest.skipUnless(shutil.which("doxygen") and (docs.MATHJAX / "MathJax.js").exists(), "needs scripts/setup --docs")
class Site(ProgramTest):
    def test_every_public_name_has_a_comment_and_no_link_is_dead(self):
        done = subprocess.run([sys.executable, docs.__file__, "--check", "--out", self.folder / "site"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        html = self.folder / "site/html"
        dead = set()
        for page in html.glob("*.html"):
            for target in re.findall(r'(?:href|src)="([^"#]+)', page.read_text()):
                if not re.match(r"\w+:", target) and not (html / target).exists():
                    dead.add((page.name, target))
        self.assertEqual(dead, set())
        for name in ("METHOD.html", "manual.html", "floors.html", "findings-energy.html", "classnscdd_1_1Simulation.html"):
            self.assertTrue((html / name).exists(), name)


if __name__ == "__main__":
    unittest.main()
