"""Templates of a public catalogue, converted to profiles: what a profile cannot say would be told here."""

import pathlib
import sys
import tempfile
import unittest

import support

TESTS = pathlib.Path(__file__).resolve().parents[1]
CONVERTER = TESTS / "support" / "template_to_profile.py"
METER = TESTS / "templates" / "meter.json"


class TemplateTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def convert(self, template):
        profile = self.folder / "converted.yaml"
        done = support.completed([sys.executable, CONVERTER, template, profile], capture_output=True, text=True)
        return done, profile

    def test_all_of_it_can_be_said(self):
        done, profile = self.convert(METER)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        checked = support.run("profile", "check", str(profile))
        self.assertEqual(checked.status, 0, checked)
        listed = support.run("list", "--profile", str(profile), "--json")
        by_name = {entry["name"]: entry for entry in listed.records() if entry["type"] == "parameter"}
        self.assertEqual(by_name["power"]["encoding"], "f32")
        self.assertEqual((by_name["one-bit"]["first_bit"], by_name["relay"]["table"]), (5, "coil"))

    def test_every_value_of_it_is_read(self):
        _, profile = self.convert(METER)
        read = support.run("get", f"sim:{profile}", "--json")
        self.assertEqual(read.status, 0, read)
        listed = support.run("list", "--profile", str(profile), "--json")
        names = [entry["name"] for entry in listed.records() if entry["type"] == "parameter"]
        self.assertEqual([value["name"] for value in read.records() if value["type"] == "value"], names)

    def test_what_cannot_be_said_is_told(self):
        template = self.folder / "strange.json"
        template.write_text('{"device": {"channels": [{"name": "Odd", "reg_type": "holding", "address": 1, '
                            '"format": "s96"}, {"name": "Even", "reg_type": "holding", "address": 2}]}}')
        done, profile = self.convert(template)
        self.assertEqual((done.returncode, done.stderr), (1, "Odd: format s96\n"))
        self.assertIn("even", profile.read_text())


if __name__ == "__main__":
    unittest.main()
