"""The table of characters that take no or two cells, or are not seen, against the Unicode Character Database.

With SPINDLE_UPDATE=1 it is written anew, for the version of Unicode that this Python knows. A Python
that knows another version than the table was made of skips (77).
"""

import os
import pathlib
import re
import subprocess
import sys
import unicodedata

PATH = pathlib.Path(__file__).resolve().parents[2] / "src" / "base" / "character_table.hpp"
# Format characters that are seen, or that join what is around them: numbers' and texts' frames of
# Arabic, Syriac, Kaithi and Egyptian, and the joiners of Indic scripts and emoji.
SEEN_FORMATS = {
    *range(0x0600, 0x0606), 0x06DD, 0x070F, 0x0890, 0x0891, 0x08E2, 0x110BD, 0x110CD,
    *range(0x13430, 0x13440), 0x200C, 0x200D,
}  # fmt: skip
# Vowels and final consonants of Hangul stand in the cells of the syllable's first consonant.
JAMO = {*range(0x1160, 0x1200), *range(0xD7B0, 0xD7FC)}

HEAD = """#pragma once

#include <array>

namespace spindle {{

/// Code points from the first to the last one; those between that mean nothing yet may be in it.
struct CodePoints {{
  char32_t first;
  char32_t last;
}};

// Made of the Unicode Character Database {version} by tests/generated/character_table_test.py.
"""


def zero_width(code, category):
    joins = code in JAMO or code in (0x200C, 0x200D)
    return category in ("Mn", "Me") or joins


def two_cells(code, category):
    return unicodedata.east_asian_width(chr(code)) in "WF" and not zero_width(code, category)


def unseen(code, category):
    return category in ("Cf", "Zl", "Zp") and code not in SEEN_FORMATS


TABLES = (
    ("zero_width", "General categories Mn and Me, the joiners, and Hangul Jamo that join.", zero_width),
    ("two_cells", "East_Asian_Width (Unicode Standard Annex 11) W and F.", two_cells),
    ("unseen", "General categories Cf, Zl and Zp, without those that are seen or join.", unseen),
)


def spans(holds):
    """First and last of each run; code points that mean nothing yet end none."""
    found, inside = [], False
    for code in range(sys.maxunicode + 1):
        category = unicodedata.category(chr(code))
        if category == "Cn":
            continue
        if holds(code, category):
            if inside:
                found[-1][1] = code
            else:
                found.append([code, code])
        inside = holds(code, category)
    return found


def table():
    text = HEAD.format(version=unicodedata.unidata_version)
    for name, source, holds in TABLES:
        found = spans(holds)
        rows = ", ".join(f"{{0x{first:04X}, 0x{last:04X}}}" for first, last in found)
        head = f"inline constexpr std::array<CodePoints, {len(found)}> {name}"
        text += f"\n/// {source}\n{head} = {{{{{rows},}}}};\n"
    return text + "\n}  // namespace spindle\n"


def numbers(text):
    return re.sub(r"\s+", "", text)


def main():
    if os.environ.get("SPINDLE_UPDATE"):
        PATH.write_text(table())
        subprocess.run(["clang-format-14", "-i", PATH], check=False)
        return 0
    present = PATH.read_text()
    if f"Database {unicodedata.unidata_version} by" not in present:
        return 77
    if numbers(present) == numbers(table()):
        return 0
    print(f"{PATH} is not what SPINDLE_UPDATE=1 {__file__} writes")
    return 1


if __name__ == "__main__":
    raise SystemExit(main())
