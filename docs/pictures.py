#!/usr/bin/env python3
"""Makes the pictures of README.md: pictures.py BUILD, a build folder with tests, such as build/release.

session.svg is tests/transcripts/session.transcript, whose test says that it is what the program prints. report.svg is
part of the page that `spindle report` makes of a stored shift, which is the same on every computer. The test
end_to_end.pictures says when they are no longer current.
"""

import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from xml.sax.saxutils import escape

DOCS = pathlib.Path(__file__).resolve().parent
TRANSCRIPT = DOCS.parent / "tests" / "transcripts" / "session.transcript"
SVG = "http://www.w3.org/2000/svg"
MONO = "ui-monospace,SFMono-Regular,Menlo,Consolas,'DejaVu Sans Mono',monospace"
SANS = "system-ui,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif"

# ---- a terminal ----

COLUMNS, CELL, LINE, MARGIN = 100, 8.0, 18, 16
INK, PAPER, GOOD, BAD, STRONG = "#d5dbe1", "#1f2933", "#7bc96f", "#ff8080", "#ffffff"


def shown_lines(transcript):
    """What a user types and sees: without directives, files, comments and statuses."""
    in_file = False
    for line in transcript.splitlines():
        if line.startswith("%"):
            in_file = line.startswith("%file")
        elif not in_file and not line.startswith("#") and not re.fullmatch(r"\[\d+\]", line):
            yield line


def wrapped(line):
    """As a terminal of so many columns wraps it."""
    return [line[at:at + COLUMNS] for at in range(0, max(len(line), 1), COLUMNS)]


def coloured(line, is_error):
    if line.startswith("$ "):
        return f'<tspan fill="{STRONG}" font-weight="bold">{escape(line)}</tspan>'
    if is_error:
        return f'<tspan fill="{BAD}">{escape(line)}</tspan>'
    text = re.sub(r"\bfastening-ng|\bNG\b(?=  )", rf'<tspan fill="{BAD}">\g<0></tspan>', escape(line))
    return re.sub(r"\bfastening-ok|\bOK\b(?=  )|\bwritten\b", rf'<tspan fill="{GOOD}">\g<0></tspan>', text)


def session_picture():
    rows = []
    for line in shown_lines(TRANSCRIPT.read_text("utf-8")):
        is_error = line.startswith("! spindle: ")
        rows += [coloured(part, is_error) for part in wrapped(line.removeprefix("! "))]
    width, height = COLUMNS * CELL + 2 * MARGIN, len(rows) * LINE + 2 * MARGIN
    texts = "\n".join(f'<text x="{MARGIN}" y="{MARGIN + (number + 1) * LINE - 5}" xml:space="preserve">{row}</text>'
                      for number, row in enumerate(rows))
    return (f'<svg xmlns="{SVG}" viewBox="0 0 {width:g} {height:g}" width="{width:g}" height="{height:g}" '
            f'role="img">\n<title>A session with spindle on a simulated tool</title>\n'
            f'<rect width="100%" height="100%" rx="8" fill="{PAPER}"/>\n'
            f'<g font-family="{MONO}" font-size="13.2" fill="{INK}">\n{texts}\n</g>\n</svg>\n')


# ---- a report ----

WIDTH, EDGE = 900, 24
# Heading of the report's summary, heading here, and where the column begins.
SHOWN = (("Tool", "Tool, preset, target", 0), ("Results", "Results", 250), ("NG", "NG", 330),
         ("Yield", "Yield % (95 %)", 390), ("Torque(95 %)", "Torque, Ppk (95 %)", 560), ("Torquestable", "Stable", 790))


def words(cell):
    """The text of a cell; what stands below in it follows behind a space."""
    return re.sub(r"\s+", " ", " ".join(part.strip() for part in cell.itertext())).strip()


def report_page(build):
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([build / "tests" / "spindle_peer_report_store", "shift.db"], cwd=folder, check=True)
        subprocess.run([build / "spindle", "report", "--store", "shift.db", "--tool", "station3", "-f", "report.html"],
                       cwd=folder, check=True, stderr=subprocess.DEVNULL)
        return (pathlib.Path(folder) / "report.html").read_text("utf-8")


def report_picture(page):
    body = ElementTree.fromstring(page.partition("\n")[2]).find("body")
    summary = body.find(".//table")
    heads = ["".join(cell.itertext()) for cell in summary.find("thead/tr")]
    columns = [(heading, x, next(i for i, head in enumerate(heads) if head.startswith(key))) for key, heading, x in SHOWN]
    texts = [(EDGE, 40, 26, 600, body.find("h1").text), (EDGE, 64, 15, 400, body.find("p").text)]
    texts += [(EDGE + x, 100, 13, 600, heading) for heading, x, _ in columns]
    y = 100
    for row in summary.iterfind("tbody/tr"):
        y += 24
        cells = list(row)
        # Of a cell with two indices the first one is shown.
        texts += [(EDGE + x, y, 13, 400, words(cells[index]).partition(" Cpk")[0].removeprefix("Ppk "))
                  for _, x, index in columns]
    chart = next(svg for svg in body.iter() if svg.tag.endswith("svg") and "chart-wide" in svg.get("class"))
    for element in chart.iter():  # a picture in a picture has neither a name nor ids of its own
        element.tag = element.tag.rpartition("}")[2]
    for child in [child for child in chart if child.tag in ("title", "desc")]:
        chart.remove(child)
    for name in ("class", "role", "aria-labelledby", "aria-label"):
        chart.attrib.pop(name, None)
    chart.attrib |= {"x": str(EDGE), "y": str(y + 20), "width": str(WIDTH), "height": chart.get("viewBox").split()[3]}
    height = y + 20 + float(chart.get("height")) + EDGE / 2
    lines = "\n".join(f'<text x="{x}" y="{at}" font-size="{size}" font-weight="{weight}">{escape(text)}</text>'
                      for x, at, size, weight, text in texts)
    return (f'<svg xmlns="{SVG}" viewBox="0 0 {WIDTH + 2 * EDGE} {height:g}" width="{WIDTH + 2 * EDGE}" '
            f'height="{height:g}" role="img">\n<title>Part of a report of spindle</title>\n'
            f'<rect width="100%" height="100%" fill="#ffffff"/>\n'
            f'<g font-family="{SANS}" fill="#1f2933">\n{lines}\n'
            f'{ElementTree.tostring(chart, "unicode").strip()}\n</g>\n</svg>\n')


def pictures(build):
    return {"session.svg": session_picture(), "report.svg": report_picture(report_page(build))}


def main():
    if len(sys.argv) != 2 or not (pathlib.Path(sys.argv[1]) / "spindle").is_file():
        sys.exit("usage: pictures.py BUILD, such as build/release")
    for name, text in pictures(pathlib.Path(sys.argv[1]).resolve()).items():
        (DOCS / name).write_text(text, "utf-8")


if __name__ == "__main__":
    main()
