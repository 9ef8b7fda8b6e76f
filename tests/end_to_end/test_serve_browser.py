"""The page of `spindle serve` in a browser: it changes without being loaded again, says when it cannot, asks for
nothing elsewhere, and can be read by those who see little, use a keyboard or a phone.

Skipped where chromium is missing.
"""

import contextlib
import os
import pathlib
import shutil
import signal
import socket
import sqlite3
import tempfile
import threading
import time
import unittest

import support
from browser import CHROMIUM, PATIENCE, Browser
from served_page import Page, make_store

if CHROMIUM is None:
    raise SystemExit(77)  # skipped: chromium is not installed

# Of each piece of text, the contrast of its colour with the first background behind it (WCAG 2.1, 1.4.3).
CONTRASTS = """(() => {
  const parts = color => color.match(/[\\d.]+/g).map(Number);
  const light = color => {
    const [r, g, b] = parts(color).map(c => c / 255).map(c => c <= .03928 ? c / 12.92 : ((c + .055) / 1.055) ** 2.4);
    return .2126 * r + .7152 * g + .0722 * b;
  };
  const behind = element => {
    for (; element; element = element.parentElement) {
      const color = getComputedStyle(element).backgroundColor, [, , , alpha = 1] = parts(color);
      if (alpha === 1) return color;
      if (alpha !== 0) return 'rgb(128, 128, 128)';
    }
    return 'rgb(255, 255, 255)';
  };
  const found = [];
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const element = walk.currentNode.parentElement;
    if (!walk.currentNode.data.trim() || element.closest('svg,script,noscript') || !element.checkVisibility()) continue;
    const a = light(getComputedStyle(element).color), b = light(behind(element));
    found.push([(Math.max(a, b) + .05) / (Math.min(a, b) + .05), walk.currentNode.data.trim()]);
  }
  return found;
})()"""


class Cable:
    """A port that leads to another, and can be pulled out and put in again."""

    def __init__(self, port):
        self._to, self._lock, self._pairs, self._is_in = port, threading.Lock(), [], True
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=64)
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                client, _ = self._listener.accept()
                with self._lock:
                    if not self._is_in:
                        client.close()
                        continue
                    server = socket.create_connection(("127.0.0.1", self._to))
                    self._pairs += [client, server]
                for here, there in ((client, server), (server, client)):
                    threading.Thread(target=self._carry, args=(here, there), daemon=True).start()

    @staticmethod
    def _carry(here, there):
        with contextlib.suppress(OSError):
            while chunk := here.recv(1 << 16):
                there.sendall(chunk)
        with contextlib.suppress(OSError):
            there.shutdown(socket.SHUT_WR)

    def pull_out(self):
        with self._lock:
            self._is_in = False
            for end in self._pairs:
                with contextlib.suppress(OSError):
                    end.shutdown(socket.SHUT_RDWR)
                end.close()
            self._pairs.clear()

    def put_in(self):
        with self._lock:
            self._is_in = True

    def close(self):
        self.pull_out()
        self._listener.close()


class Seen(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="spindle-page-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.browser = cls.enterClassContext(Browser())

    def setUp(self):
        self.store = pathlib.Path(tempfile.mkdtemp(dir=self.folder)) / "events.db"

    def serve(self, *flags):
        return self.enterContext(Page(self.store, *flags))

    def recorded(self, *flags):
        """A recorder of a simulated tool. Its results are seen as they come."""
        url = self.enterContext(support.simulator("doga-bm", *(flags or ("--rundown-every", "500ms", "--ng-every", "4"))))
        return self.enterContext(support.Running("record", url, "--profile", "doga-bm", "--store", self.store))

    def recorded_with_a_gap(self, page):
        """A recorder that was away for some results."""
        url = self.enterContext(support.simulator("doga-bm", "--rundown-every", "200ms"))
        command = ("record", url, "--profile", "doga-bm", "--store", self.store)
        with support.Running(*command) as first:
            support.wait_until(lambda: any(tool["ok"] for tool in page.state()["tools"]), "results come", PATIENCE)
            first.send_signal(signal.SIGTERM)
            first.finish()
        threading.Event().wait(6)  # a screw takes a second, and the last one is fetched
        self.enterContext(support.Running(*command))

    def open(self, page, width=1280, port=None):
        tab = self.browser.tab()
        tab.set_width(width)
        tab.open(f"http://127.0.0.1:{port or page.port}/")
        return tab

    def picture(self, tab, name):
        """For people, where they ask for it."""
        folder = os.environ.get("SPINDLE_PICTURES")
        if folder:
            (pathlib.Path(folder) / name).write_bytes(tab.picture())

    def check_contrast(self, tab):
        contrasts = tab.run(CONTRASTS)
        self.assertGreater(len(contrasts), 8)
        self.assertEqual([each for each in contrasts if each[0] < 4.5], [])

    def check_width(self, tab, width):
        tab.set_width(width)
        self.assertEqual(tab.run("innerWidth"), width)
        self.assertLessEqual(tab.run("document.documentElement.scrollWidth"), width)
        wide = "[...document.querySelectorAll('body *')].filter(e => e.checkVisibility() && !e.closest('.unseen,.skip') && "
        wide += f"e.getBoundingClientRect().right > {width} + .5).map(e => e.outerHTML.slice(0, 80))"
        self.assertEqual(tab.run(wide), [])


class LiveTest(Seen):
    def test_it_changes_by_itself_and_a_cut_is_shown_and_healed(self):
        page = self.serve()
        cable = Cable(page.port)
        self.addCleanup(cable.close)
        tab = self.open(page, port=cable.port)
        self.assertIn("There is no store yet", tab.text())
        tab.run("window.stays = 1")
        self.recorded()
        tab.until("document.querySelector('.card .n-ng.some')", "results come")
        tab.until("document.querySelector('.card .run svg')", "a chart comes")
        tab.until("document.querySelector('#say').textContent.includes('NG')", "an NG is said")
        self.assertIn("Connected", tab.text(".card .link"))
        self.check_contrast(tab)
        for width in (360, 800, 1920):
            self.check_width(tab, width)
            self.assertGreaterEqual(tab.run("parseFloat(getComputedStyle(document.querySelector('.torque')).fontSize)"), 40)
            self.picture(tab, f"live-{width}.png")
        count = "Number(document.querySelector('.card .n-ok dd').innerText)"
        before = tab.run(count)
        tab.until(f"{count} > {before}", "the count goes up")

        cable.pull_out()
        tab.until("document.body.matches('.lost')", "the cut is seen")
        self.assertRegex(tab.text("#connection"), r"Connection lost, showing what was known at \d\d:\d\d:\d\d\.")
        self.assertFalse(tab.run("document.querySelector('#live').checkVisibility()"))
        self.check_contrast(tab)
        self.picture(tab, "lost-1920.png")
        before = tab.run(count)
        cable.put_in()
        tab.until("!document.body.matches('.lost')", "the cut is healed")
        self.assertEqual(tab.text("#connection"), "")
        tab.until(f"{count} > {before}", "what was missed is counted")
        self.assertEqual(tab.run("window.stays"), 1)
        origin = f"http://127.0.0.1:{cable.port}/"
        self.assertEqual([url for url in tab.asked if not url.startswith(origin)], [])
        self.assertTrue(any("/events" in url for url in tab.asked))

    def test_what_is_open_and_where_the_focus_is_stay(self):
        page = self.serve("--shift", "00:00")
        self.recorded_with_a_gap(page)
        tab = self.open(page)
        tab.until("document.querySelector('details')", "results are missed")
        tab.run("document.querySelector('summary').focus()")
        tab.press("Enter", 13)
        tab.run("document.querySelector('details').open = true")
        text = "document.querySelector('details').closest('.card').querySelector('.n-ok dd').innerText"
        before = tab.run(text)
        tab.until(f"{text} !== '{before}'", "the card changes")
        self.assertTrue(tab.run("document.querySelector('details').open"))
        self.assertEqual(tab.run("document.activeElement.nodeName"), "SUMMARY")


class ReadTest(Seen):
    def test_without_scripts_it_shows_what_was_known(self):
        page = self.serve()
        self.recorded()
        support.wait_until(lambda: any(tool["ng"] for tool in page.state()["tools"]), "results come", PATIENCE)
        tab = self.browser.tab()
        tab.call("Emulation.setScriptExecutionDisabled", value=True)
        tab.set_width(800)
        tab.call("Page.navigate", url=page.url + "/")
        html = tab.html_with("</footer>")
        self.assertRegex(html, r"Without JavaScript this page shows what was known at \d\d:\d\d:\d\d")
        self.assertRegex(html, r'<dt>NG</dt><dd>[1-9]')
        self.assertNotIn("/events", " ".join(tab.asked))
        self.picture(tab, "no-script-800.png")

    def test_a_keyboard_reaches_everything_and_sees_where_it_is(self):
        page = self.serve()
        self.recorded_with_a_gap(page)
        tab = self.open(page)
        tab.until("document.querySelector('details')", "results are missed")
        reached = []
        wanted = tab.run("document.querySelectorAll('a,summary,button,input').length")
        for _ in range(wanted):
            tab.press("Tab", 9)
            reached.append(tab.run("document.activeElement.textContent"))
            self.assertEqual(tab.run("getComputedStyle(document.activeElement).outlineStyle"), "solid", reached)
            self.assertGreaterEqual(tab.run("parseFloat(getComputedStyle(document.activeElement).outlineWidth)"), 3)
            visible = "(r => r.width > 0 && r.left >= 0 && r.top < innerHeight)(document.activeElement.getBoundingClientRect())"
            self.assertTrue(tab.run(visible), reached)
        self.assertEqual(len(set(reached)), wanted)
        self.assertEqual(reached[0], "To the tools")
        self.assertEqual(tab.run("document.querySelectorAll('header.top,main,footer').length"), 3)
        self.assertEqual(tab.run("document.querySelectorAll('h1').length"), 1)
        self.assertEqual(tab.run("document.querySelector('#say').getAttribute('aria-live')"), "polite")
        self.assertTrue(tab.run("[...document.querySelectorAll('svg')].every(s => s.ariaHidden === 'true' || s.ariaLabel)"))
        unnamed = "[...document.querySelectorAll('article')].filter(a => !document.getElementById(a.getAttribute('aria-labelledby'))).length"
        self.assertEqual(tab.run(unnamed), 0)

    def test_those_who_want_no_motion_get_none(self):
        make_store(self.store)
        tab = self.open(self.serve())
        tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-reduced-motion", "value": "reduce"}])
        moving = "[...document.querySelectorAll('*')].filter(e => getComputedStyle(e).transitionDuration !== '0s' || "
        moving += "getComputedStyle(e).animationName !== 'none').length"
        self.assertEqual(tab.run(moving), 0)

    def test_hostile_names_and_barcodes_are_texts(self):
        make_store(self.store, 1, 5)
        evil = '<img src=x onerror="window.hacked=1"><script>window.hacked=2</script>&quot;\'"'
        with contextlib.closing(sqlite3.connect(self.store)) as store, store:
            now = int(time.time() * 1000)
            store.execute("UPDATE place SET name = ?, torque_unit = ?, since = ?, seen = ?", (evil, evil, now, now))
            store.execute("UPDATE event SET barcode = ?, at = ?", (evil, now))
        tab = self.open(self.serve())
        tab.until("document.body.innerText.includes('live, ')", "the page is live")
        self.assertEqual(tab.text(".card h2"), evil)
        self.assertEqual(tab.text(".card .code"), evil)
        self.assertEqual(tab.run("[typeof window.hacked, document.images.length]"), ["undefined", 0])
        self.check_width(tab, 360)


if __name__ == "__main__":
    unittest.main()
