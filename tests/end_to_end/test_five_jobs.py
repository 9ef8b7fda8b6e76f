"""The five jobs of spindle-tutorial(7) and of README.md, in a real terminal of 80 columns.

What is typed is read from the page, so that each command of it is run; what has to be seen then is here. The only
thing that differs from the page is where the simulated tools are: at loopback addresses and paths of this test.
"""

import contextlib
import os
import pathlib
import re
import shutil
import tempfile
import unittest

import support
from terminal import Terminal

PAGE = support.ROOT / "man" / "spindle-tutorial.7.in"
README = support.ROOT / "README.md"
EXAMPLES = support.ROOT / "man" / "examples"
SIMULATORS, WORK = "sim$ ", "$ "
PLAIN = {"\\e": "\\", "\\-": "-", "\\(aq": "'", "\\(dq": '"'}


def unescaped(text):
    for escape, plain in PLAIN.items():
        text = text.replace(escape, plain)
    return text


def commands_of(lines):
    """(prompt, command) for each command of a block; what follows indented belongs to it."""
    found = []
    for line in lines:
        prompt = next((prompt for prompt in (SIMULATORS, WORK) if line.startswith(prompt)), None)
        if prompt:
            found.append([prompt, line.removeprefix(prompt)])
        elif found and line.startswith("    "):
            found[-1][1] = found[-1][1].removesuffix("\\").rstrip() + " " + line.strip()
    return [tuple(command) for command in found]


def jobs_of_page():
    """The commands of each section of the page, by its heading."""
    jobs, heading, block = {}, "", None
    for line in unescaped(PAGE.read_text()).splitlines():
        if line.startswith(".Sh "):
            heading = line.removeprefix(".Sh ")
        elif line.startswith(".Bd -literal"):
            block = []
        elif line == ".Ed":
            jobs.setdefault(heading, []).extend(commands_of(block))
            block = None
        elif block is not None:
            block.append(line)
    return jobs


class Place:
    """A folder of this test and loopback addresses of its own, in place of those of the page."""

    def __init__(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="spindle-jobs-"))
        number = os.getpid() + int.from_bytes(os.urandom(2), "little")
        self._network = f"127.{1 + number % 99}.{1 + number // 99 % 99}."
        (self.folder / "bin").mkdir()
        (self.folder / "bin" / "spindle").symlink_to(support.binary())
        self.examples = self.folder / "examples"
        self.examples.mkdir()
        text = (EXAMPLES / "line1.yaml").read_text()
        (self.examples / "line1.yaml").write_text(self.here(text))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        shutil.rmtree(self.folder, ignore_errors=True)

    def here(self, text):
        """The text with the addresses and paths of this test."""
        return (text.replace("127.0.0.", self._network)
                .replace("/tmp/conveyor", str(self.folder / "line"))
                .replace("/usr/share/doc/spindle/examples", str(self.folder / "examples")))

    def there(self, text):
        """The text as it would be with those of the page."""
        return text.replace(self._network, "127.0.0.").replace(str(self.folder / "line"), "/tmp/conveyor")

    def environment(self):
        return {**support.home().environment(), "HOME": str(self.folder), "XDG_RUNTIME_DIR": str(self.folder),
                "PATH": f"{self.folder / 'bin'}:/usr/bin:/bin"}


YES = ((r"\[y/N\]", "y"),)
FREE = r"tcp://127\.\d+\.\d+\.{}:5000"

# What is seen on the screen behind each command of the page, in their order: the beginning of the command, the
# status, patterns of lines, and what is answered.
SEEN = {
    "DESCRIPTION": (
        ("cp ", 0, (), ()),
        ("spindle tools --check", 0, (r"no faults",), ()),
    ),
    "1. THE FIRST DAY": (
        ("spindle identify station1", 0, (r"3204 +1021100041 +2103 +doga-bm",), ()),
        ("spindle get station1 'preset.1.*torque*'", 0, (r"target-torque +2\.71 +N\.m +0\.00 +6\.00",), ()),
        ("spindle set station1 preset.1.target-torque=9.99", 2, (r"9\.99 is above 6\.00, the maximum", ), ()),
        ("spindle set station1 preset.1.target-torque=3.10 --dry-run", 0, (r"2\.71 +3\.10", r"nothing was written"), ()),
        ("spindle set station1 preset.1.target-torque=3.10", 0, (r"2\.71 +3\.10 +N\.m +written", r"1 written"), ()),
        ("spindle watch station1", 0, (r"\bOK\b", r"\bNG\b", r"E\d\d\d ", r"3 events"), ()),
        ("spindle alarms station1", 0, (r"no alarm",), ()),
        ("spindle do station1", 0, (r"alarm-reset", r"select-preset"), ()),
        ("spindle get station1 preset.1.target-torqe", 2, (r"try: spindle get station1 preset\.1\.target-torque$",), ()),
        ("spindle set station1 preset.1.target-torque=2.71", 0, (r"3\.10 +2\.71 +N\.m +written",), ()),
    ),
    "2. BACK UP FIVE TOOLS": (
        ("spindle identify @line1", 0, tuple(f"station{n} .*102110004{n}" for n in range(1, 6)), ()),
        ("spindle set station3 preset.1.target-torque=2.80", 0, (r"2\.71 +2\.80 +N\.m +written",), ()),
        ("spindle backup @line1", 0, (r"station5 +backups/station5\.yaml +720", r"5 saved, 0 failed"), ()),
        ("spindle set station5 preset.2.speed=900", 0, (r"preset\.2\.speed +800 +900 +rpm +written",), ()),
        ("spindle diff @line1", 1, (r"station5 +preset\.2\.speed.* 900 +800", r"1 different"), ()),
        ("spindle restore station5", 0, (r"preset\.2\.speed +900 +800 +rpm +written",), YES),
        ("spindle diff station5", 0, (r"0 different",), ()),
    ),
    "3. CLONE A REPLACED TOOL": (
        ("spindle identify station3", 0, (r"1021100099",), ()),
        ("spindle restore station3 backups/station3.yaml --dry-run", 0,
         (r"2\.71 +2\.80", r"serial 1021100043, and this tool is serial\s+1021100099", r"nothing was written"), ()),
        ("spindle restore station3 backups/station3.yaml", 0, (r"2\.71 +2\.80 +N\.m +written", r"present state"), YES),
        ("spindle diff station3", 0, (r"0 different, 720 the same",), ()),
    ),
    "4. WATCH INTO A DATABASE": (
        ("spindle record @line1", 0, (r"\d+ OK, 0 NG",), ()),
        ("spindle store check", 0, (r"station5 .*complete", r"0 holes, the store is whole"), ()),
        ("spindle results --store line.db --count 5", 0, (r"station\d .*fastening-ok", r"5 events, 5 OK"), ()),
        ("spindle results --store line.db -o csv", 0, (), ()),
        ("sqlite3 plant.db '.import", 0, (), ()),
        ("sqlite3 plant.db 'SELECT", 0, tuple(rf"station{n}\|[1-9]\d*\|2\.\d+" for n in range(1, 6)), ()),
        ("spindle report --store line.db", 0, (r"station5 +serial 1021100045 +preset 1", r"yield 100\.00 %"), ()),
        ("spindle report --store line.db -f report.html", 0, (r"report\.html",), ()),
    ),
    "5. THE FIRST RUN OF A BLV": (
        ("spindle scan rtu:", 0, (r"^ +1 +data", r"^ +2 +data", r"4 asked, 2 found"), ()),
        ("spindle identify conveyor1", 0, (r"orientalmotor-blv", r"motor stands still, no alarm"), ()),
        ("spindle get conveyor1 'operation.2.*'", 0, (r"operation\.2\.speed +1000 +rpm",), ()),
        ("spindle set conveyor1 operation.2.speed=500", 0, (r"1000 +500 +rpm +written",), ()),
        ("spindle remote-start conveyor1", 0, (r"started", r"at-speed +\d+", r"the motor stands still"), YES),
        ("spindle alarms conveyor1", 0, (r"no alarm",), ()),
        ("spindle remote-stop conveyor1", 0, (r"conveyor1 .*confirmed",), ()),
        ("spindle backup conveyor1", 0, (r"1 saved, 0 failed",), ()),
    ),
}

# What the terminal of the simulated tools shows, and so when the work may begin.
SIMULATED = {
    "1. THE FIRST DAY": ((FREE.format(1),),),
    "2. BACK UP FIVE TOOLS": (tuple(FREE.format(n) for n in range(1, 6)),),
    "3. CLONE A REPLACED TOOL": ((r"^\[3\]",), (FREE.format(3),)),
    "5. THE FIRST RUN OF A BLV": ((r"rtu://.*\?unit=1",),),
}


@unittest.skipUnless(shutil.which("tmux"), "tmux is not installed")
class FiveJobsTest(unittest.TestCase):
    maxDiff = None

    def test_the_five_jobs_of_the_tutorial(self):
        jobs = jobs_of_page()
        self.assertEqual(list(jobs), list(SEEN))
        with Place() as place, contextlib.ExitStack() as stack:
            enter = stack.enter_context
            work, tools = (enter(Terminal(place.folder, place.environment())) for _ in range(2))
            for job, commands in jobs.items():
                with self.subTest(job):
                    self.do_job(place, work, tools, commands, SEEN[job], SIMULATED.get(job, ()))

    def do_job(self, place, work, tools, commands, seen, simulated):
        simulated, seen = list(simulated), list(seen)
        for prompt, command in commands:
            if prompt == SIMULATORS:
                self.simulate(place, tools, command, simulated.pop(0))
            else:
                self.see(place, work, command, *seen.pop(0))
        self.assertEqual((simulated, seen), ([], []), "the page lacks commands")

    def simulate(self, place, tools, command, patterns):
        tools.key("C-c")  # what runs in the foreground there, if anything
        tools.type("")
        tools.wait_for_prompt()
        tools.clear()
        tools.type(place.here(command))
        for pattern in patterns:
            tools.wait_for_text(pattern)

    def see(self, place, work, command, begin, status, patterns, answers):
        self.assertTrue(command.startswith(begin), f"the page says '{command}', the test expects '{begin}'")
        ended, shown = work.run(place.here(command), answers)
        shown = place.there(shown)
        self.assertEqual(ended, status, f"$ {command}\n{shown}")
        for pattern in patterns:
            self.assertRegex(shown, "(?m)" + pattern, f"$ {command}\n{shown}")


def blocks_of_readme():
    """The headings of the jobs, each with the simulator's lines and the commands behind them."""
    jobs, kind = {}, None
    for line in README.read_text().splitlines():
        if line.startswith("#"):
            job = jobs.setdefault(line.strip("# "), {"sh": [], "console": []})
        elif line.startswith("```"):
            kind = line.strip("`") if kind is None else None
        elif kind in ("sh", "console"):
            job[kind].append(line)
    return {heading: job for heading, job in jobs.items() if re.match(r"\d\. ", heading)}


class ReadmeTest(unittest.TestCase):
    """The README's commands are transcripts; here its simulators are real, and stand where it says."""

    def test_its_tools_file_is_the_example(self):
        self.assertIn("```yaml\n" + (EXAMPLES / "line1.yaml").read_text() + "```\n", README.read_text())

    def test_it_is_short(self):
        self.assertLessEqual(len(README.read_text().splitlines()), 150)

    def test_what_it_shows_is_done_in_the_terminal(self):
        """Its shell lines are commands of the tutorial, and the commands of its transcripts are at most given another
        preset or option there."""
        page = [re.sub(r"\s+", " ", command) for commands in jobs_of_page().values() for _, command in commands]
        begins = {" ".join(command.split()[:3]) for command in page}
        jobs = blocks_of_readme()
        self.assertEqual(len(jobs), 5)
        for heading, job in jobs.items():
            self.assertTrue(job["sh"], heading)
            for line in job["sh"]:
                for command in line.split(" #")[0].strip().split("; spindle simulate"):
                    self.assertIn(command.removesuffix(" &"), " ".join(page), heading)
            for line in job["console"]:
                if line.startswith("$ spindle "):
                    self.assertIn(" ".join(line.removeprefix("$ ").split()[:3]), begins, heading)


if __name__ == "__main__":
    unittest.main()
