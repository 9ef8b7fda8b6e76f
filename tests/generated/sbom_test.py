"""The SBOM of a build, against the shape that SPDX 2.3 demands and against what the programs themselves say: sbom_test.py BUILD"""

import json
import os
import pathlib
import re
import subprocess
import sys
import unittest

try:
    from jsonschema import Draft202012Validator
except ImportError:
    raise SystemExit(77)  # skipped: python3-jsonschema is not installed

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(sys.argv.pop()).resolve()
SHAPE = json.loads((ROOT / "tests" / "generated" / "spdx-2.3-shape.json").read_text())


def sbom():
    environment = {**os.environ, "SOURCE_DATE_EPOCH": "1796018400", "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run([ROOT / "packaging" / "sbom.py", BUILD], capture_output=True, check=True, text=True,
                          env=environment).stdout


def needed(program):
    """The names of the libraries that a program says it loads."""
    told = subprocess.run(["readelf", "-d", BUILD / program], capture_output=True, check=True, text=True).stdout
    return re.findall(r"\(NEEDED\).*\[lib(\w+)[^]]*\.so", told)


class SbomTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.text = sbom()
        cls.document = json.loads(cls.text)
        cls.packages = {package["SPDXID"]: package for package in cls.document["packages"]}
        cls.programs = {package["name"]: key for key, package in cls.packages.items()
                        if package.get("primaryPackagePurpose") == "APPLICATION"}

    def parts(self, program, *kinds):
        return {self.packages[relation["relatedSpdxElement"]]["name"] for relation in self.document["relationships"]
                if relation["spdxElementId"] == self.programs[program] and relation["relationshipType"] in kinds}

    def test_it_has_the_shape_of_spdx(self):
        Draft202012Validator.check_schema(SHAPE)
        self.assertEqual([error.message for error in Draft202012Validator(SHAPE).iter_errors(self.document)], [])

    def test_the_shape_refuses_what_is_not_spdx(self):
        for spoil in (lambda made: made.pop("dataLicense"), lambda made: made.update(spdxVersion="SPDX-2.2"),
                      lambda made: made["packages"][0].update(SPDXID="x y"),
                      lambda made: made["packages"][0].pop("downloadLocation"),
                      lambda made: made["relationships"][0].update(relationshipType="IS_LIKE")):
            made = json.loads(self.text)
            spoil(made)
            self.assertFalse(Draft202012Validator(SHAPE).is_valid(made))

    def test_every_id_is_there_once_and_every_package_belongs_to_something(self):
        self.assertEqual(len(self.packages), len(self.document["packages"]))
        named = {"SPDXRef-DOCUMENT"}
        for relation in self.document["relationships"]:
            for end in (relation["spdxElementId"], relation["relatedSpdxElement"]):
                self.assertIn(end, {*self.packages, "SPDXRef-DOCUMENT"})
                named.add(end)
        self.assertLessEqual(set(self.packages), named)

    def test_what_a_program_loads_is_in_it(self):
        for program in self.programs:
            loaded = " ".join(self.parts(program, "DYNAMIC_LINK"))
            for library in needed(program):
                # libc and libm are of one package, whose name is that of the library elsewhere.
                self.assertIn("libc6" if library in ("c", "m") else f"lib{library}".replace("_", "-"), loaded, program)

    def test_what_is_compiled_into_it_is_in_it(self):
        for library in ("libyaml-dev", "libsqlite3-dev", "libfmt-dev", "libcli11-dev", "libexpected-dev", "libstdc++-12-dev"):
            self.assertIn(library, self.parts("spindle", "STATIC_LINK"))
        self.assertEqual(self.parts("spindle", "CONTAINS"), {"uPlot"})
        self.assertNotIn("doctest-dev", str(self.text))

    def test_it_is_the_same_for_the_same_build(self):
        self.assertEqual(sbom(), self.text)


if __name__ == "__main__":
    unittest.main()
