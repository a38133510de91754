"""The site: what scripts/docs_filter.py hands to Doxygen, and, where Doxygen and MathJax are installed, the pages that come of it."""
import pathlib
import json
import re
import shutil
import subprocess
import sys
import unittest

from harness import ProgramTest, load_script

docs = load_script("docs")
docs_filter = docs.docs_filter


class Pages(unittest.TestCase):
    def filtered(self, text, file="kernel/METHOD.md"):
        return docs_filter.page(text, docs.ROOT / file)

    def test_headings_formulas_and_links(self):
        self.assertEqual(
            self.filtered("# Title\n\n## 2.1 A b, c\n\nLet $a$ and $$ b $$, not `$c$`.\n"),
            "# Title {#METHOD}\n\n## 2.1 A b, c {#METHOD_21-a-b-c}\n\nLet \\f$a\\f$ and \\f[ b \\f], not `$c$`.\n",
        )
        self.assertEqual(
            self.filtered("[x](#21-a-b-c) [y](REFERENCES.md) [z](../scripts/docs) [u](https://a.b/c)"),
            '@ref METHOD_21-a-b-c "x" @ref REFERENCES "y" z (`scripts/docs`) [u](https://a.b/c)',
        )
        self.assertEqual(
            self.filtered("[x](energy.md), [again](energy.md)", "reports/findings/README.md"), '@subpage findings-energy "x", @ref findings-energy "again"'
        )

    def test_pictures_are_found_by_their_name(self):
        self.assertEqual(self.filtered("![a b](pictures/c.png) [d](../METHOD.md)", "kernel/python/x.md"), '![a b](c.png) @ref METHOD "d"')

    def test_the_text_of_a_link_is_one_line(self):
        self.assertEqual(self.filtered("[x\ny](REFERENCES.md)"), '@ref REFERENCES "x y"')

    def test_commands_stay_as_they_are(self):
        self.assertEqual(
            self.filtered("Run\n\n    scripts/x $HOME [a](b)\n    y\n\nthen.\n"), "Run\n\n```{.unparsed}\nscripts/x $HOME [a](b)\ny\n```\n\n\nthen.\n"
        )


@unittest.skipUnless(shutil.which("doxygen") and (docs.MATHJAX / "MathJax.js").exists(), "needs scripts/setup --docs")
class Site(ProgramTest):
    def test_every_public_name_has_a_comment_and_no_link_is_dead(self):
        done = subprocess.run([sys.executable, docs.__file__, "--check", "--out", self.folder / "site"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        public = docs.public_names(self.folder / "site")
        self.assertLessEqual({"Simulation", "nlgs", "ContactLaw", "Buffer"}, set(public))
        self.assertLessEqual(len(public), 110, "a name that the kernel alone needs belongs in detail, one of a class in that class")
        html = self.folder / "site/html"
        pages = json.loads((html / "words.js").read_text().removeprefix("const pages = ").rstrip().rstrip(";"))
        self.assertEqual([page["file"] for page in pages if not (html / page["file"]).exists()], [], "pages that the search finds")
        self.assertTrue(any("findings-siconos" in page["file"] and "NSGS" in page["text"] for page in pages))
        texts = {page.name: page.read_text() for page in html.glob("*.html")}
        anchors = {name: set(re.findall(r'(?:id|name)="([^"]+)"', text)) for name, text in texts.items()}
        dead = set()
        for name, text in texts.items():
            self.assertNotIn("\\_form#", text, f"{name}: Doxygen lost its place")
            for target, anchor in re.findall(r'(?:href|src)="([^"#]*)#?([^"]*)"', text):
                if re.match(r"\w+:", target):
                    continue
                if target and not (html / target).exists() or anchor and anchor not in anchors.get(target or name, {anchor}):
                    dead.add((name, target, anchor))
        self.assertEqual(dead, set())
        self.assertTrue((html / "silo.png").exists() and 'src="silo.png"' in texts["manual-18-gallery.html"])
        for name in ("METHOD.html", "manual.html", "floors.html", "findings-energy.html", "classnscdd_1_1Simulation.html"):
            self.assertTrue((html / name).exists(), name)


if __name__ == "__main__":
    unittest.main()
