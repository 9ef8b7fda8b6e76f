"""A headless Chromium that is led through its DevTools protocol over two pipes, with the standard library alone."""

import base64
import contextlib
import fcntl
import json
import os
import pathlib
import queue
import shutil
import subprocess
import tempfile
import threading

import support

CHROMIUM = shutil.which("chromium")

FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--hide-scrollbars", "--remote-debugging-pipe",
    "--disable-dev-shm-usage", "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
)  # fmt: skip
PATIENCE = 5 * support.DEADLINE
# What the browser says of a question that named a node or a context of a document that another one has followed.
REPLACED = ("Could not find node", "No node with given id", "Cannot find context", "context was destroyed",
            "navigated or closed")


class Replaced(AssertionError):
    """The document was replaced between two questions: ask again."""


class Tab:
    """A page in a browser, with every address that it asked for."""

    def __init__(self, browser, session):
        self._browser, self._session = browser, session
        self.asked = []

    def call(self, method, **parameters):
        return self._browser.call(method, self._session, **parameters)

    def open(self, url):
        self.call("Page.navigate", url=url)
        self.until("document.readyState === 'complete'", f"{url} is loaded")

    def run(self, expression):
        """The value of an expression of JavaScript."""
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise AssertionError(f"{expression[:80]}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def until(self, expression, what):
        return self._wait(lambda: self.run(f"!!({expression})"), what)

    def html_with(self, part):
        """The document as it stands, once that part is in it. Works where scripts do not run."""

        def html():
            root = self.call("DOM.getDocument", depth=-1)["root"]["nodeId"]
            text = self.call("DOM.getOuterHTML", nodeId=root)["outerHTML"]
            return part in text and text

        return self._wait(html, f"{part} is in the page")

    @staticmethod
    def _wait(condition, what):
        def in_one_document():
            with contextlib.suppress(Replaced):
                return condition()

        return support.wait_until(in_one_document, what, PATIENCE)

    def text(self, selector="body"):
        return self.run(f"document.querySelector({json.dumps(selector)}).innerText")

    def press(self, key, code=0, modifiers=0):
        for kind in ("rawKeyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code, modifiers=modifiers)

    def set_width(self, width, height=900):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def picture(self):
        return base64.b64decode(self.call("Page.captureScreenshot", format="png", captureBeyondViewport=False)["data"])


class Browser:
    """As long as the with statement lasts."""

    def __init__(self):
        self._folder = pathlib.Path(tempfile.mkdtemp(prefix="spindle-browser-"))
        to_browser, self._out = os.pipe()
        self._in, from_browser = os.pipe()
        # It reads from descriptor 3 and writes to 4, which may be taken here.
        to_browser, from_browser = self._move(to_browser), self._move(from_browser)
        self._process = subprocess.Popen(
            ["bash", "-c", f'exec "$@" 3<&{to_browser} 4>&{from_browser}',
             "bash", CHROMIUM, *FLAGS, f"--user-data-dir={self._folder}"],
            pass_fds=(to_browser, from_browser), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, env={**os.environ, "HOME": str(self._folder)},
        )  # fmt: skip
        os.close(to_browser)
        os.close(from_browser)
        self._answers, self._tabs, self._number, self._lock = {}, {}, 0, threading.Lock()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @staticmethod
    def _move(descriptor):
        moved = fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, 10)
        os.close(descriptor)
        return moved

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with contextlib.suppress(OSError, AssertionError):
            self.call("Browser.close")
        try:
            support.wait_for_end(self._process)
        except subprocess.TimeoutExpired:
            self._process.kill()
            support.wait_for_end(self._process)
        self._reader.join(support.DEADLINE)
        os.close(self._out)
        os.close(self._in)
        shutil.rmtree(self._folder, ignore_errors=True)

    def _read(self):
        unread = b""
        while True:
            chunk = os.read(self._in, 1 << 16)
            if not chunk:
                return
            *messages, unread = (unread + chunk).split(b"\0")
            for message in messages:
                self._take(json.loads(message))

    def _take(self, message):
        if "id" in message:
            self._answers[message["id"]].put(message)
        elif message["method"] == "Network.requestWillBeSent":
            tab = self._tabs.get(message.get("sessionId"))
            if tab:
                tab.asked.append(message["params"]["request"]["url"])

    def call(self, method, session=None, **parameters):
        with self._lock:
            self._number += 1
            message = {"id": self._number, "method": method, "params": parameters}
            if session:
                message["sessionId"] = session
            answers = self._answers[self._number] = queue.Queue()
            os.write(self._out, json.dumps(message).encode() + b"\0")

        def answered():
            with contextlib.suppress(queue.Empty):
                return answers.get(timeout=support.POLL)

        answer = support.wait_until(answered, f"the browser answers {method}", PATIENCE)
        if "error" in answer:
            is_replaced = any(words in answer["error"]["message"] for words in REPLACED)
            raise (Replaced if is_replaced else AssertionError)(f"{method}: {answer['error']}")
        return answer["result"]

    def tab(self):
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        tab = self._tabs[session] = Tab(self, session)
        for domain in ("Page", "Network", "Runtime"):
            tab.call(f"{domain}.enable")
        return tab
