"""A strict reader of the text format of Prometheus, version 0.0.4, written from its documentation
(https://prometheus.io/docs/instrumenting/exposition_formats/), and not from our writer.
"""

import dataclasses
import math
import re

METRIC_NAME = r"[a-zA-Z_:][a-zA-Z0-9_:]*"
LABEL_NAME = r"[a-zA-Z_][a-zA-Z0-9_]*"
TYPES = ("counter", "gauge", "histogram", "summary", "untyped")


@dataclasses.dataclass
class Family:
    name: str
    help: str | None = None
    type: str | None = None
    samples: list = dataclasses.field(default_factory=list)  # (name, labels, value)

    def value(self, **labels):
        found = [value for name, own, value in self.samples if name == self.name and own == labels]
        if len(found) != 1:
            raise ValueError(f"{len(found)} samples of {self.name} have {labels}")
        return found[0]

    def count(self):
        return next(value for name, _, value in self.samples if name == f"{self.name}_count")


def parse(text):
    """Families by name. Anything that the documentation does not allow is a ValueError."""
    if not text.endswith("\n"):
        raise ValueError("the last line must end with a line feed")
    families = {}
    last = None
    for line in text[:-1].split("\n"):
        if not line.strip():
            continue
        last = _comment(line, families, last) if line.startswith("#") else _sample(line, families, last)
    for family in families.values():
        _judge(family)
    return families


def _comment(line, families, last):
    match = re.fullmatch(rf"# (HELP|TYPE) ({METRIC_NAME})(?: (.*))?", line)
    if not match:
        return last  # only a comment
    what, name, rest = match[1], match[2], match[3] or ""
    family = families.setdefault(name, Family(name))
    if family.samples:
        raise ValueError(f"{what} behind samples: {line}")
    if what == "HELP":
        if family.help is not None:
            raise ValueError(f"a second HELP: {line}")
        family.help = _unescaped(rest, {"\\": "\\", "n": "\n"})
    else:
        if family.type is not None or rest not in TYPES:
            raise ValueError(f"a wrong or second TYPE: {line}")
        family.type = rest
    return name


def _sample(line, families, last):
    name = re.match(METRIC_NAME, line)
    if not name:
        raise ValueError(f"no metric name: {line}")
    rest, labels = line[name.end():], {}
    if rest.startswith("{"):
        labels, rest = _labels(rest[1:])
    fields = rest.split()
    if not rest.startswith((" ", "\t")) or len(fields) not in (1, 2):
        raise ValueError(f"no value: {line}")
    if len(fields) == 2 and not re.fullmatch(r"-?\d+", fields[1]):
        raise ValueError(f"no time in milliseconds: {line}")
    base = _family_of(name[0], families)
    family = families.setdefault(base, Family(base))
    if family.samples and last != base:
        raise ValueError(f"lines of one metric stand together: {line}")
    if any(own == labels and other == name[0] for other, own, _ in family.samples):
        raise ValueError(f"the same labels twice: {line}")
    family.samples.append((name[0], labels, _number(fields[0])))
    return base


def _labels(text):
    labels = {}
    while not text.startswith("}"):
        match = re.match(rf'({LABEL_NAME})="((?:[^"\\]|\\.)*)"(,|(?=\}}))', text)
        if not match:
            raise ValueError(f"no label: {text}")
        if match[1] in labels or match[1].startswith("__"):
            raise ValueError(f"a label that is there, or reserved: {text}")
        labels[match[1]] = _unescaped(match[2], {"\\": "\\", "n": "\n", '"': '"'})
        text = text[match.end():]
    return labels, text[1:]


def _unescaped(text, escapes):
    def one(match):
        if match[1] not in escapes:
            raise ValueError(f"an unknown escape: {match[0]}")
        return escapes[match[1]]

    return re.sub(r"\\(.)", one, text)


def _number(text):
    special = {"NaN": math.nan, "+Inf": math.inf, "-Inf": -math.inf}
    if text in special:
        return special[text]
    if not re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", text):
        raise ValueError(f"no number: {text}")
    return float(text)


def _family_of(name, families):
    for suffix in ("_bucket", "_sum", "_count"):
        base = name.removesuffix(suffix)
        if base != name and base in families and families[base].type in ("histogram", "summary"):
            return base
    return name


def _judge(family):
    if not family.samples:
        raise ValueError(f"{family.name} has no sample")
    if family.help is None or family.type is None:
        raise ValueError(f"{family.name} says neither what it is nor its type")
    if family.type == "counter" and any(value < 0 or not math.isfinite(value) for _, _, value in family.samples):
        raise ValueError(f"{family.name} counts and is negative")
    if family.type == "histogram":
        _judge_histogram(family)


def _judge_histogram(family):
    buckets = [(_number(labels["le"]), value) for name, labels, value in family.samples if name.endswith("_bucket")]
    if buckets != sorted(buckets) or [count for _, count in buckets] != sorted(count for _, count in buckets):
        raise ValueError(f"the buckets of {family.name} do not grow")
    if not buckets or buckets[-1][0] != math.inf or buckets[-1][1] != family.count():
        raise ValueError(f"the last bucket of {family.name} is not its count")
    if not any(name == f"{family.name}_sum" for name, _, _ in family.samples):
        raise ValueError(f"{family.name} has no sum")
