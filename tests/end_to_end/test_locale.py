"""Technicians' locales: numbers look and are read the same in all of them, always with a point."""

import os
import pathlib
import re
import shutil
import tempfile
import unittest

import support

TORQUE = "preset.1.target-torque"
COMMANDS = (
    ["get", "URL", "--profile", "doga-bm", TORQUE, "preset.1.speed", "--limits"],
    ["list", "--profile", "doga-bm"],
    ["profile", "show", "doga-bm"],
    ["set", "URL", "--profile", "doga-bm", f"{TORQUE}=2.8", "--dry-run"],
    ["diff", "FILE", "URL"],
    ["restore", "URL", "FILE", "--dry-run"],
    ["get", "URL", "--profile", "doga-bm", "p726"],
)
# A comma, or what parts thousands, where a number is typed: what is given, and what would help.
COMMAS = (
    (["set", "URL", "--profile", "doga-bm", f"{TORQUE}=2,8"], "decimal point"),
    (["set", "URL", "--profile", "doga-bm", "preset.1.speed=1,000"], "without separators"),
    (["set", "URL", "--profile", "doga-bm", "preset.1.speed=1.000,5"], "without separators"),
    (["set", "URL", "--profile", "doga-bm", "preset.1.speed=1\u202f000"], "without separators"),
    (["set", "URL", "--profile", "doga-bm", "p2=2,71"], "without separators"),
    (["do", "URL", "--profile", "doga-bm", "select-preset=1,5"], "1 to 15"),
    (["ping", "URL", "--interval", "0,5s"], "2.5s"),
    (["ping", "URL", "--count", "1,0"], "from 1"),
    (["get", "URL", TORQUE, "--timeout", "1,5s"], "2.5s"),
    (["remote-start", "sim:orientalmotor-blv", "--speed", "1,000"], "without separators"),
    (["remote-start", "sim:orientalmotor-blv", "--speed", "500", "--for", "2,5s"], "2.5s"),
    (["simulate", "doga-bm", "--fault", "late=0,5s"], "500ms"),
)


def without_times(text):
    text = re.sub(r"\d{4}-\d\d-\d\dT[\d:.]+Z", "TIME", text)
    return re.sub(r'"round_trip_ms":[\d.]+', '"round_trip_ms":0', text)


class LocaleTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """The locales are made here, so that the test needs none that is installed."""
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="spindle-locales-"))
        if not shutil.which("localedef") or not os.path.isdir("/usr/share/i18n/locales"):
            return
        for name in ("de_DE", "fr_FR", "de_CH"):
            command = ["localedef", "-i", name, "-f", "UTF-8", cls.folder / f"{name}.UTF-8"]
            support.completed(command, capture_output=True)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder, ignore_errors=True)

    def environments(self):
        """Environment and decimal sign of every locale that the C library really knows here."""
        for name in ("de_DE.UTF-8", "fr_FR.UTF-8", "de_CH.UTF-8"):
            environment = {"LC_ALL": name, "LANG": name, "LOCPATH": str(self.folder)}
            asked = support.completed(
                ["locale", "-k", "decimal_point", "thousands_sep"], capture_output=True, text=True,
                env={"PATH": "/usr/bin:/bin", **environment},
            )  # fmt: skip
            if (self.folder / name).is_dir() and "Cannot set" not in asked.stderr:
                yield environment, asked.stdout

    def test_output_is_the_same_everywhere(self):
        file = support.home().path / "backup.yaml"
        with support.simulator("doga-bm") as url:
            saved = support.run("backup", url, "--profile", "doga-bm", "-f", file)
            self.assertEqual(saved.status, 0, saved)
            self.assertEqual(support.run("set", url, "--profile", "doga-bm", f"{TORQUE}=2.75").status, 0)
            locales = list(self.environments())
            signs = {re.search(r'decimal_point="(.*)"', about)[1] for _, about in locales}
            if "," not in signs:
                self.skipTest("no locale with another decimal sign can be had here")
            for command in COMMANDS:
                for form in ([], ["--json"], ["-o", "csv"]):
                    if form and command[:2] == ["profile", "show"]:
                        continue
                    arguments = [{"URL": url, "FILE": file}.get(word, word) for word in (*command, *form)]
                    usual = support.run(*arguments)
                    for environment, _ in locales:
                        with self.subTest(arguments, locale=environment["LC_ALL"]):
                            here = support.run(*arguments, environment=environment)
                            self.assertEqual(here.status, usual.status, here)
                            self.assertEqual(without_times(here.stdout), without_times(usual.stdout))
                            self.assertEqual(without_times(here.stderr), without_times(usual.stderr))
            for environment, _ in locales:
                here = support.run("backup", url, "--profile", "doga-bm", "-f", "-", environment=environment)
                self.assertIn("2.75", here.stdout)
                self.assertNotRegex(here.stdout, r"\d,\d")

    def test_a_comma_is_never_misread(self):
        environments = [{}] + [environment for environment, _ in self.environments()]
        with support.simulator("doga-bm") as url:
            for environment in environments:
                for command, help_words in COMMAS:
                    arguments = [url if word == "URL" else word for word in command]
                    with self.subTest(arguments, locale=environment.get("LC_ALL", "C.UTF-8")):
                        finished = support.run(*arguments, environment=environment)
                        self.assertEqual((finished.status, finished.stdout), (2, ""), finished)
                        self.assertIn(help_words, finished.said)
            values = support.run("get", url, "--profile", "doga-bm", TORQUE, "preset.1.speed", "--json")
            self.assertEqual([str(r["value"]) for r in values.records()], ["2.71", "1000"], values)

    def test_a_comma_in_a_backup_is_refused(self):
        with support.simulator("doga-bm") as url:
            file = support.home().path / "comma.yaml"
            saved = support.run("backup", url, "--profile", "doga-bm", "-f", file)
            self.assertEqual(saved.status, 0, saved)
            text = file.read_text()
            line = next(line for line in text.splitlines() if TORQUE in line)
            for wrong in ("2,71", "'2,71'"):
                file.write_text(text.replace(line, line.replace("2.71", wrong, 1)))
                finished = support.run("restore", url, file, "--yes")
                with self.subTest(wrong):
                    self.assertEqual((finished.status, finished.stdout), (3, ""), finished)
                    self.assertRegex(finished.said, r"comma.yaml:\d+:\d+: ")


if __name__ == "__main__":
    unittest.main()
