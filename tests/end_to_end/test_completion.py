"""The completion scripts in real shells: what a TAB offers, offline."""

import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import support

SCRIPTS = support.ROOT / "completions"
TOOLS = """tools:
  station3: {url: "tcp://192.168.10.23", profile: doga-bmt}
groups:
  line1: [station3]
"""

# What is typed, and candidates that must be offered; "only" if there must be no others.
CASES = (
    ("spindle remote-", "only", ["remote-start", "remote-stop"]),
    ("spindle get stat", "only", ["station3"]),
    ("spindle get @", "only", ["@line1"]),
    ("spindle get sim:", "some", ["sim:doga-bm", "sim:doga-bmt"]),
    ("spindle get station3 preset.1.tar", "only", ["preset.1.target-torque", "preset.1.target-angle"]),
    ("spindle get station3 preset.", "some", ["preset.1.", "preset.15."]),
    ("spindle set station3 preset.1.mo", "only", ["preset.1.mode="]),
    ("spindle set station3 preset.1.mode=", "only", ["preset.1.mode=TC/AM", "preset.1.mode=AC/TM"]),
    ("spindle set station3 preset.1.mode=A", "only", ["preset.1.mode=AC/TM"]),
    ("spindle do station3 dir", "only", ["direction="]),
    ("spindle do station3 direction=", "only", ["direction=forward", "direction=loosening"]),
    ("spindle get station3 --ou", "only", ["--output"]),
    ("spindle get station3 --output ", "only", ["table", "json", "csv"]),
    ("spindle -o j", "only", ["json"]),
    ("spindle list --profile doga-bm", "some", ["doga-bm", "doga-bmt"]),
    ("spindle list --profile doga-bm event.num", "only", ["event.number"]),
    ("spindle profile ch", "only", ["check"]),
    ("spindle profile check my", "some", ["my-tool.yaml"]),
    ("spindle frobnicate ", "some", []),
)


def tearDownModule():
    support.remove_home()


class CompletionTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="spindle-completion-")
        pathlib.Path(cls.folder, "spindle.yaml").write_text(TOOLS)
        pathlib.Path(cls.folder, "my-tool.yaml").write_text("format: 1\n")
        programs = os.path.join(cls.folder, "programs")
        os.mkdir(programs)
        os.symlink(support.binary(), os.path.join(programs, "spindle"))
        cls.environment = support.home().environment()
        cls.environment["PATH"] = f"{programs}:{cls.environment['PATH']}"

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def run_shell(self, *arguments):
        return subprocess.run(
            arguments,
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=support.DEADLINE,
            check=True,
        ).stdout.splitlines()

    def check(self, offered, whole=lambda _, candidate: candidate):
        """`whole` gives the word that a candidate in the form of the shell stands for."""
        for typed, kind, expected in CASES:
            with self.subTest(typed):
                words = [whole(typed, candidate) for candidate in offered(typed)]
                if kind == "only":
                    self.assertEqual(sorted(words), sorted(expected))
                else:
                    self.assertEqual([word for word in expected if word not in words], [], words)

    def test_bash(self):
        script = f"""
            source '{SCRIPTS}/spindle.bash'
            compopt() {{ :; }}  # only a completion under way may have options
            COMP_LINE=$1 COMP_POINT=${{#1}}
            _spindle spindle "$2" ''
            printf '%s\\n' "${{COMPREPLY[@]}}"
        """

        def offered(typed):
            # What bash takes for the word: behind the last of the characters that split words.
            word = typed.rsplit(" ", 1)[1]
            for mark in "=:":
                word = word.rsplit(mark, 1)[-1]
            return self.run_shell("bash", "--norc", "-c", script, "bash", typed, word)

        def whole(typed, candidate):
            word = typed.rsplit(" ", 1)[1]
            head = word[: max(word.rfind("="), word.rfind(":")) + 1]
            return head + candidate.replace("\\", "")

        self.check(offered, whole)

    @unittest.skipUnless(shutil.which("fish"), "fish is not installed")
    def test_fish(self):
        def offered(typed):
            source = f"source '{SCRIPTS}/spindle.fish'; complete -C '{typed}'"
            lines = self.run_shell("fish", "--no-config", "-c", source)
            return [line.split("\t")[0] for line in lines]

        self.check(offered)

    @unittest.skipUnless(shutil.which("zsh"), "zsh is not installed")
    def test_zsh(self):
        """zsh completes only for people: its line editor runs in a terminal of its own, and what is
        added as a candidate is written down."""
        script = f"""
            zmodload zsh/zpty
            zpty terminal zsh -f -i
            zpty -w terminal "PROMPT=; autoload -Uz compinit; compinit -u -D"
            zpty -w terminal "source '{SCRIPTS}/_spindle'"
            zpty -w terminal 'compadd() {{ local -a found; builtin compadd -O found "$@"; print -rl -- $found >>shown; builtin compadd "$@" }}'
            zpty -w terminal 'bindkey "^I" complete-word; print -r ready >ready'
            repeat 300 {{ [[ -e ready ]] && break; sleep 0.05 }}
            zpty -w -n terminal "$1"$'\\t'
            zpty -w terminal $'\\C-u'"print -r done >done"
            repeat 300 {{ [[ -e done ]] && break; sleep 0.05 }}
            zpty -d terminal
            sort -u shown
            rm -f shown ready done
        """

        def offered(typed):
            return self.run_shell("zsh", "-f", "-c", f": >shown\n{script}", "zsh", typed)

        self.check(offered)


if __name__ == "__main__":
    unittest.main()
