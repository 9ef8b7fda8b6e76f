"""The pictures of README.md show what the program prints today."""

import importlib.util
import os
import pathlib
import re
import tempfile
import unittest

import support

DOCS = support.ROOT / "docs"


def pictures():
    """docs/pictures.py as a module."""
    found = importlib.util.spec_from_file_location("pictures", DOCS / "pictures.py")
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


class PicturesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        # The programs of a build, in the folders where its script looks for them.
        with tempfile.TemporaryDirectory() as folder:
            build = pathlib.Path(folder)
            (build / "spindle").symlink_to(support.binary())
            (build / "tests").symlink_to(os.environ["SPINDLE_PEER_PROGRAMS"])
            cls.drawn = pictures().pictures(build)

    def test_they_are_current(self):
        for name, text in self.drawn.items():
            with self.subTest(name):
                self.assertTrue((DOCS / name).read_text("utf-8") == text, "run docs/pictures.py build/release")

    def test_they_are_those_of_the_readme(self):
        shown = re.findall(r"!\[[^]]+\]\(docs/([^)]+)\)", (support.ROOT / "README.md").read_text())
        self.assertEqual(sorted(shown), sorted(self.drawn))

    def test_they_show_what_they_are_about(self):
        session, report = self.drawn["session.svg"], self.drawn["report.svg"]
        for text in ("spindle identify station3", "is above 6.00", "written", "fastening-ok", "fastening-ng"):
            self.assertIn(text, session)
        for text in ("Fastening results", "station3 preset 1, 2.71 N.m", "96.92", "<path"):
            self.assertIn(text, report)
        self.assertNotRegex(session + report, "<script|<image|href=")


if __name__ == "__main__":
    unittest.main()
