"""scripts/words: sentences of texts, and whether those of the project are short enough."""
import contextlib
import io
import unittest
import unittest.mock

from harness import ProgramTest, load_script

script = load_script("words")


class Words(ProgramTest):
    def counts(self, text):
        return [sentence.words for sentence in script.sentences(self.write("page.md", text))]

    def test_sentences_of_paragraphs_and_items_are_counted(self):
        self.assertEqual(self.counts("# Not this\n\nOne two three. Four `five six` seven,\neight!\n\n- Nine [ten](a/b.md)\n- 11 of 12.\n"), [3, 4, 2, 3])

    def test_code_tables_and_abbreviations_end_nothing(self):
        self.assertEqual(
            self.counts("Take one, e.g. This.\n\n    not this one. Nor this.\n\n| nor. | This. |\n\n```sh\nnor. This.\n```\nsee Fig. 2 there\n"), [4, 4]
        )

    def test_public_comments_are_joined_and_counted(self):
        header = self.write(
            "header.hpp",
            """/// @file
/// One two
/// three.
namespace nscdd { namespace detail {
/// Not this, nor the next.
int hidden;  ///< nor this
}}  // namespace nscdd::detail
// Nor this.
///@{
/// Four five. Six.
int code;  ///< seven eight nine
           ///< ten
int more;  ///< eleven [m]
///@}
/// - Twelve is an item.
/// ```
/// not this
/// ```
""",
        )
        found = [(sentence.line, sentence.words) for sentence in script.sentences(header)]
        self.assertEqual(found, [(2, 3), (10, 2), (10, 1), (11, 4), (13, 2), (15, 4)])

    def test_what_is_too_long_is_told(self):
        text = self.write("README.md", " ".join(["word"] * 36) + ".\n")
        said = io.StringIO()
        with unittest.mock.patch.object(script, "ROOT", self.folder), unittest.mock.patch.object(
            script, "LIMITS", (("README", ("README.md",), 14, 35),)
        ), unittest.mock.patch("sys.argv", ["words", "--list", str(text)]), contextlib.redirect_stdout(said):
            self.assertEqual(script.main(), 1)
        self.assertIn("README.md:1: 36 words: word word", said.getvalue())

    def test_texts_of_the_project_can_be_read_in_a_hurry(self):
        said = io.StringIO()
        with unittest.mock.patch("sys.argv", ["words"]), contextlib.redirect_stdout(said):
            self.assertEqual(script.main(), 0, said.getvalue() + "scripts/words --list says which sentences")


if __name__ == "__main__":
    unittest.main()
