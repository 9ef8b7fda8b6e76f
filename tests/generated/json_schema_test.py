"""The JSON that the transcripts, the README and docs/promises.md show, against the published schema.

Also the other way round: a schema that lets everything pass would be worth nothing, so every line is
spoilt in all the ways that matter, and must be refused then.
"""

import copy
import json
import os
import pathlib
import re
import unittest

try:
    from jsonschema import Draft202012Validator
except ImportError:
    raise SystemExit(77)  # skipped: python3-jsonschema is not installed

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCHEMA = json.loads((ROOT / "share" / "spindle-1.schema.json").read_text())
HEAD = ["schema", "type", "time", "target"]


def load(line):
    """A repeated key would hide what stands behind the first one."""

    def unique(pairs):
        keys = [key for key, _ in pairs]
        if len(set(keys)) != len(keys):
            raise ValueError(f"repeated key: {sorted(key for key in keys if keys.count(key) > 1)}")
        return dict(pairs)

    return json.loads(line, object_pairs_hook=unique)


def shown_lines():
    """Place and text of every line of JSON that is shown, on standard output or from a file."""
    pages = [ROOT / "README.md", ROOT / "docs" / "promises.md"]
    for path in sorted((ROOT / "tests" / "transcripts").glob("*.transcript")) + pages:
        for number, line in enumerate(path.read_text().splitlines(), 1):
            if line.startswith('{"'):
                yield f"{path.name}:{number}", line


def emitted_types():
    """The types of records that the code writes."""
    types = set()
    for path in (ROOT / "src").rglob("*.cpp"):
        text = path.read_text()
        for after in re.findall(r"\.type = ([^,;]*)", text):
            types.update(re.findall(r'"([a-z]+)"', re.sub(r'== "[a-z]+"', "", after)))
        types.update(re.findall(r'\bblank\("([a-z]+)"', text))
        types.update(re.findall(r'\\"type\\":\\"([a-z]+)\\"', text))
    return types


def required_keys(record):
    """Keys without which the record must be refused: those of all, of its type, and of the variant that it is."""
    definition = SCHEMA["$defs"][record["type"]]
    keys = set(HEAD) | set(definition["required"])
    variants = [set(variant["required"]) for variant in definition.get("anyOf", ())]
    fitting = [variant for variant in variants if variant <= set(record)]
    if fitting:
        keys |= set.intersection(*fitting)
    return keys


class JsonSchemaTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.validator = Draft202012Validator(SCHEMA)
        cls.records = [(place, load(line)) for place, line in shown_lines()]

    def faults(self, record):
        return [error.message for error in self.validator.iter_errors(record)]

    def test_the_schema_is_one(self):
        Draft202012Validator.check_schema(SCHEMA)
        ruled = [rule["if"]["properties"]["type"]["const"] for rule in SCHEMA["allOf"]]
        self.assertEqual(ruled, SCHEMA["properties"]["type"]["enum"])
        for rule, name in zip(SCHEMA["allOf"], ruled):
            self.assertEqual(rule["then"], {"$ref": f"#/$defs/{name}"})

    def test_required_keys_are_described(self):
        for name in SCHEMA["properties"]["type"]["enum"]:
            definition = SCHEMA["$defs"][name]
            known = set(definition["properties"])
            variants = [key for variant in definition.get("anyOf", ()) for key in variant["required"]]
            for key in definition["required"] + variants:
                self.assertIn(key, known, name)

    def test_every_line_fits(self):
        self.assertGreater(len(self.records), 50)
        for place, record in self.records:
            with self.subTest(place):
                self.assertEqual(self.faults(record), [])

    def test_every_line_begins_alike(self):
        for place, record in self.records:
            if record["type"] == "changed":  # in a file of its own, where it says first who did it
                continue
            with self.subTest(place):
                self.assertEqual(list(record)[:4], HEAD)

    def test_every_type_of_the_code_is_described_and_shown(self):
        types = emitted_types()
        self.assertGreater(len(types), 15)
        self.assertEqual(sorted(types - set(SCHEMA["properties"]["type"]["enum"])), [])
        self.assertEqual(sorted(types - {record["type"] for _, record in self.records}), [])

    def test_an_unknown_type_is_refused(self):
        for place, record in self.records:
            with self.subTest(place):
                self.assertNotEqual(self.faults({**record, "type": "rumour"}), [])

    def test_a_missing_key_is_refused(self):
        for place, record in self.records:
            for key in sorted(required_keys(record)):
                with self.subTest(f"{place} without {key}"):
                    spoilt = copy.deepcopy(record)
                    del spoilt[key]
                    self.assertNotEqual(self.faults(spoilt), [])

    def test_a_wrong_kind_of_value_is_refused(self):
        for place, record in self.records:
            for key in record:
                with self.subTest(f"{place} with an object for {key}"):
                    if key != "labels":
                        self.assertNotEqual(self.faults({**record, key: {"is": 1}}), [])

    def test_an_added_key_is_welcome(self):
        for place, record in self.records:
            with self.subTest(place):
                self.assertEqual(self.faults({**record, "of_a_later_version": [1, None]}), [])

    def test_statuses_are_those_of_the_code(self):
        table = (ROOT / "src" / "base" / "error.cpp").read_text()
        rows = re.findall(r'StatusInfo\{ExitStatus::\w+,\s*"(\w+)"', table)
        self.assertEqual(sorted(set(rows) - {"ok"}), sorted(SCHEMA["$defs"]["error"]["properties"]["code"]["enum"]))
        header = (ROOT / "include" / "spindle" / "base" / "error.hpp").read_text()
        block = re.search(r"enum class ExitStatus[^{]*\{([^}]*)\}", header).group(1)
        numbers = sorted(int(number) for number in re.findall(r"= (\d+)", block))
        self.assertEqual(numbers, SCHEMA["$defs"]["exit-status"]["enum"])


if __name__ == "__main__":
    os.chdir(ROOT)
    unittest.main()
