"""The page of a report in a browser: it asks for nothing, shows the numbers of the records, and is well-formed.

Skipped where chromium is missing.
"""

import base64
import hashlib
import html
import os
import pathlib
import re
import shutil
import tempfile
import unittest
import xml.etree.ElementTree

import support

CHROMIUM = shutil.which("chromium")
if CHROMIUM is None:
    raise SystemExit(77)  # skipped: chromium is not installed

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--host-resolver-rules=MAP * ~NOTFOUND",
)  # fmt: skip
DASH = "\N{EN DASH}"


def make_store(path, *arguments):
    program = pathlib.Path(os.environ["SPINDLE_PEER_PROGRAMS"]) / "spindle_peer_report_store"
    support.completed([program, path, *arguments], check=True)


class Browser:
    """Opens a page in a browser of its own, without a network."""

    def __init__(self, folder):
        self._folder = folder

    def _run(self, page, *flags):
        profile = tempfile.mkdtemp(dir=self._folder)
        done = support.completed(
            [CHROMIUM, *FLAGS, f"--user-data-dir={profile}", *flags, page.as_uri()],
            deadline=5 * support.DEADLINE, capture_output=True,
        )  # fmt: skip
        if done.returncode != 0:
            raise AssertionError(f"chromium ended with {done.returncode}: {done.stderr.decode(errors='replace')}")
        return done.stdout.decode()

    def requests(self, page):
        """The addresses that the page asks for, itself not counted."""
        log = pathlib.Path(tempfile.mkdtemp(dir=self._folder)) / "net.json"
        self._run(page, f"--log-net-log={log}", "--net-log-capture-mode=Everything", "--dump-dom")
        # What the browser asks for on its own account is of no site.
        of_page = r'"site_for_cookies":"SiteForCookies: {site=file://[^"]*","url":"([^"]*)"'
        asked = set(re.findall(of_page, log.read_text(errors="replace")))
        return {url for url in asked if not url.startswith("file:")}

    def dom(self, page):
        return self._run(page, "--dump-dom")

    def picture(self, page, width):
        shot = pathlib.Path(tempfile.mkdtemp(dir=self._folder)) / "page.png"
        self._run(page, f"--screenshot={shot}", f"--window-size={width},2000", "--hide-scrollbars")
        return shot.read_bytes()


class Report(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="spindle-report-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.browser = Browser(cls.folder)
        cls.store = cls.folder / "shift.db"
        make_store(cls.store)
        cls.page = cls.folder / "shift.html"
        done = support.run("report", "--store", str(cls.store), "-f", str(cls.page))
        assert done.status == 0, done.stderr
        cls.text = cls.page.read_text()

    def records(self, *arguments):
        done = support.run("report", "--store", str(self.store), "--json", *arguments)
        self.assertEqual(done.status, 0, done.stderr)
        return [support.parse_json(line) for line in done.stdout.splitlines()]

    def test_it_asks_for_nothing(self):
        self.assertEqual(self.browser.requests(self.page), set())

    def test_a_page_that_asks_would_be_noticed(self):
        other = self.folder / "asks.html"
        other.write_text("<html><body><img src='http://spindle.invalid/x.png'/></body></html>")
        self.assertEqual(self.browser.requests(other), {"http://spindle.invalid/x.png"})

    def test_it_is_well_formed_and_has_no_script(self):
        xml.etree.ElementTree.fromstring(self.text)
        self.assertNotIn("<script", self.text)
        self.assertNotRegex(self.text.replace('xmlns="http://www.w3.org/2000/svg"', ""), "https?://")

    def test_names_from_outside_are_text(self):
        dom = self.browser.dom(self.page)
        self.assertIn("press &lt;b&gt;&amp;", dom)
        self.assertNotIn("<b>", dom)

    def test_its_tables_have_the_numbers_of_the_records(self):
        dom = html.unescape(re.sub(r"<[^>]*>", " ", self.browser.dom(self.page)))
        words = set(dom.split())
        reports = [record for record in self.records() if record["type"] == "report"]
        self.assertEqual(len(reports), 10)
        for record in reports:
            decimals = 3 if record["quantity"] == "torque" else 1
            for key, places in (("mean", decimals), ("s", decimals), ("s_within", decimals), ("pp", 2)):
                shown = DASH if record[key] is None else f"{record[key]:.{places}f}"
                self.assertIn(shown, words, (record["target"], record["quantity"], key))
            self.assertIn(str(record["n"]), words)
            if record["ppk"] is not None:
                self.assertRegex(dom, re.escape(f"{record['ppk']:.2f} ({record['ppk_low']:.2f}"))

    def test_an_interactive_page_runs_its_own_scripts_and_no_others(self):
        page = self.folder / "zoom.html"
        done = support.run("report", "--store", str(self.store), "--interactive", "-f", str(page))
        self.assertEqual(done.status, 0, done.stderr)
        text = page.read_text()
        policy = re.search(r'content="(default-src[^"]*)"', text)[1]
        scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
        self.assertEqual(len(scripts), 2)
        for script in scripts:
            digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
            self.assertIn(f"'sha256-{digest}'", policy)
        self.assertEqual(self.browser.requests(page), set())
        dom = self.browser.dom(page)
        self.assertEqual(dom.count('class="zoom zoom-on"'), 8)
        self.assertEqual(dom.count("<canvas"), 8)
        spoilt = self.folder / "spoilt.html"
        spoilt.write_text(text.replace("<body>", "<body><script>document.title = 'spoilt'</script>"))
        self.assertNotIn("<title>spoilt", self.browser.dom(spoilt))

    def test_it_is_drawn_at_every_width(self):
        for width in (390, 1280):
            self.assertGreater(len(self.browser.picture(self.page, width)), 30_000, width)

    def test_a_hundred_thousand_results_are_drawn_and_the_page_stays_small(self):
        store = self.folder / "many.db"
        make_store(store, "100000")
        page = self.folder / "many.html"
        done = support.run("report", "--store", str(store), "-f", str(page))
        self.assertEqual(done.status, 0, done.stderr)
        self.assertLess(page.stat().st_size, 300_000)
        self.assertIn("100000", self.browser.dom(page))
        self.assertGreater(len(self.browser.picture(page, 1280)), 30_000)


if __name__ == "__main__":
    unittest.main()
