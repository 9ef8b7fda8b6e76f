#!/usr/bin/env python3
"""Writes a profile of a device template: the JSON in which wb-mqtt-serial describes a Modbus device
(github.com/wirenboard/wb-mqtt-serial, README). Shows how much of public catalogues a profile can say.

usage: template_to_profile.py TEMPLATE.json [PROFILE.yaml]
What cannot be said is told on standard error, one line each; then the status is 1."""

import decimal
import json
import re
import sys
import unicodedata

TABLES = {"coil": "coil", "discrete": "discrete", "input": "input", "holding": "holding",
          "holding_single": "holding", "holding_multi": "holding"}
FORMATS = {"u16": "u16", "s16": "i16", "u32": "u32", "s32": "i32", "u64": "u64", "s64": "i64",
           "float": "f32", "double": "f64"}
LONGEST_NAME = 60


class Unsayable(Exception):
    pass


def without_comments(text):
    """JSON as people write it: with comments and commas before a closing bracket."""
    text = re.sub(r'("(?:\\.|[^"\\])*")|//[^\n]*|/\*.*?\*/', lambda m: m.group(1) or "", text, flags=re.S)
    return re.sub(r",(\s*[}\]])", r"\1", text)


def number(value):
    if isinstance(value, bool):
        raise Unsayable(f"{value} is no number")
    if isinstance(value, str):
        return int(value, 0) if re.fullmatch(r"\s*-?(0[xX][0-9a-fA-F]+|[0-9]+)\s*", value) else decimal.Decimal(value)
    return value if isinstance(value, int) else decimal.Decimal(repr(value))


def plain(value):
    """A number without an exponent."""
    return format(decimal.Decimal(value), "f")


def quoted(text):
    return json.dumps(str(text), ensure_ascii=False)


class Names:
    """Lower-case words and numbers joined by '-', each once."""

    def __init__(self):
        self.taken = set()

    def make(self, title, prefix=""):
        ascii_text = unicodedata.normalize("NFKD", str(title)).encode("ascii", "ignore").decode()
        slug = re.sub(r"[^a-z0-9]+", "-", ascii_text.lower()).strip("-")[:LONGEST_NAME].strip("-") or "value"
        base = name = prefix + slug
        count = 1
        while name in self.taken:
            count += 1
            name = f"{base}-{count}"
        self.taken.add(name)
        return name


def labels_of(entry):
    """By number; texts that could be taken for numbers, or for each other, are told apart."""
    labels = {}
    if "enum" in entry:
        titles = entry.get("enum_titles") or entry["enum"]
        for value, title in zip(entry["enum"], titles):
            labels.setdefault(int(number(value)), str(title))
    elif "on_value" in entry or "off_value" in entry:
        labels[int(number(entry.get("off_value", 0)))] = "off"
        labels[int(number(entry.get("on_value", 1)))] = "on"
    told = {}
    for value, title in labels.items():
        title = " ".join(title.split()) or f"value {value}"
        if re.fullmatch(r"[-+]?[0-9.]+|0[xX][0-9a-fA-F]+", title):
            title = f"({title})"
        if title.lower() in (known.lower() for known in told.values()):
            title = f"{title} ({value})"
        told[value] = title
    return told


def address_of(entry):
    """Register, and the first bit and how many of them, where it is a part of a register."""
    if "address" not in entry and "write_address" in entry:
        return int(number(entry["write_address"])), None
    address = entry.get("address")
    if isinstance(address, str) and ":" in address:
        parts = [int(part, 0) for part in address.split(":")]
        return parts[0], (parts[1], parts[2] if len(parts) > 2 else 1)
    if address is None:
        raise Unsayable("it has no address")
    return int(number(address)), None


def encoding_of(entry, table, slice_):
    keys = {}
    if table in ("coil", "discrete"):
        return {"encoding": "bit"}
    form = entry.get("format", "u16")
    if slice_ is not None:
        first, width = slice_
        keys["encoding"] = "bit" if form in ("u16", "u8", "s16", "s8") and first + width <= 16 else FORMATS.get(form, "u32")
        keys["bit"] = f"{first}..{first + width - 1}" if width > 1 else first
    elif form in FORMATS:
        keys["encoding"] = FORMATS[form]
    elif form in ("u8", "s8"):
        keys["encoding"] = "u8" if form == "u8" else "i8"
    elif form in ("u24", "s24"):
        keys.update(encoding="u32" if form == "u24" else "i32", bit="0..23")
    elif form in ("bcd8", "bcd16", "bcd24", "bcd32"):
        keys.update(encoding="bcd", length={"bcd8": 1, "bcd16": 2, "bcd24": 4, "bcd32": 4}[form])
    elif form == "char8":
        keys.update(encoding="text", length=1, packing="low")
    elif form in ("string", "string8"):
        keys.update(encoding="text", length=int(number(entry["string_data_size"])))
        if form == "string":
            keys["packing"] = "low"
    else:
        raise Unsayable(f"format {form}")
    for key, ours in (("word_order", "word-order"), ("byte_order", "byte-order")):
        if entry.get(key) == "little_endian":
            keys[ours] = "little"
    return keys


def parameter_of(entry, name, title, read_only):
    table = TABLES.get(entry.get("reg_type", "holding"))
    if table is None:
        raise Unsayable(f"register type {entry.get('reg_type')}")
    register, slice_ = address_of(entry)
    if not 0 <= register <= 0xFFFF:
        raise Unsayable(f"register {register}")
    keys = {"name": name, "table": table, "register": register}
    keys.update(encoding_of(entry, table, slice_))
    is_number = keys["encoding"] not in ("text", "bit", "bcd") or (keys["encoding"] == "bcd")
    if is_number:
        scale = decimal.Decimal(number(entry.get("scale", 1)))
        if scale not in (0, 1):
            keys["scale"] = plain(scale)
        if number(entry.get("offset", 0)) != 0:
            keys["offset"] = plain(number(entry["offset"]))
    if keys["encoding"] in ("f32", "f64") and "round_to" in entry:
        keys["decimals"] = max(0, -decimal.Decimal(number(entry["round_to"])).normalize().as_tuple().exponent)
    nulls = [plain(number(entry[key])) for key in ("error_value", "unsupported_value") if key in entry]
    if nulls and is_number:
        keys["null"] = "[" + ", ".join(nulls) + "]"
    if entry.get("write_address") is not None and "address" in entry:
        keys["write-register"] = int(number(entry["write_address"]))
    labels = labels_of(entry) if keys["encoding"] not in ("text", "f32", "f64") else {}
    if labels and table in ("holding", "input") and "scale" not in keys and "offset" not in keys:
        keys["labels"] = "{" + ", ".join(f"{value}: {quoted(text)}" for value, text in labels.items()) + "}"
    if entry.get("units"):
        keys["unit"] = quoted(str(entry["units"]).strip())
    writable = table in ("holding", "coil") and not read_only and not entry.get("readonly", False)
    keys["access"] = "rw" if writable else "r"
    keys["title"] = quoted(title)
    return keys


def entries_of(device, prefix=""):
    """(entry, title, read only) of all channels, parameters and set-up writes, those of parts, too."""
    for channel in device.get("channels", []):
        title = prefix + str(channel.get("name", channel.get("id", "channel")))
        if "consists_of" in channel:
            for index, part in enumerate(channel["consists_of"], 1):
                yield {**channel, **part}, f"{title} {index}", channel.get("readonly", False)
        elif "address" in channel or "write_address" in channel:
            yield channel, title, channel.get("readonly", False)
    parameters = device.get("parameters", [])
    if isinstance(parameters, dict):
        parameters = [dict(value, id=key) for key, value in parameters.items()]
    for parameter in parameters:
        if "address" in parameter or "write_address" in parameter:
            yield parameter, prefix + str(parameter.get("title", parameter.get("id", "parameter"))), False
    for setup in device.get("setup", []):
        if "address" in setup:
            yield setup, prefix + str(setup.get("title", "setup")), False
    for part in device.get("subdevices", []):
        yield from entries_of(part.get("device", part), prefix + str(part.get("title", part.get("name", "part"))) + " ")


def span_of(keys):
    size = {"u32": 2, "i32": 2, "f32": 2, "u64": 4, "i64": 4, "f64": 4}.get(keys["encoding"], 1)
    if keys["encoding"] in ("text", "bcd"):
        size = keys["length"] if keys.get("packing") == "low" else (keys["length"] + 1) // 2
    return range(keys["register"], keys["register"] + size)


def mark_overlaps(parameters):
    owners = {}
    for keys in parameters:
        for register in span_of(keys):
            first = owners.setdefault((keys["table"], register), keys)
            if first is not keys:
                first["overlaps"] = keys["overlaps"] = "true"


def convert(template, name):
    device = template.get("device", template)
    names, parameters, faults, seen = Names(), [], [], set()
    for entry, title, read_only in entries_of(device):
        try:
            keys = parameter_of(entry, names.make(title), title, read_only)
        except (Unsayable, KeyError, ValueError, decimal.InvalidOperation) as fault:
            faults.append(f"{title}: {fault}")
            continue
        place = tuple(str(keys.get(key)) for key in ("table", "register", "encoding", "bit"))
        if place in seen:
            continue  # a channel and a parameter that are the same register
        seen.add(place)
        parameters.append(keys)
    mark_overlaps(parameters)
    single = any(e.get("reg_type") == "holding_single" for e, _, _ in entries_of(device))
    multi = any(e.get("reg_type") == "holding_multi" for e, _, _ in entries_of(device))
    link = ["framing: rtu", "unit: 1", "transaction: echoed", "pairs: any",
            f"max-read: {max(1, min(125, int(number(device.get('max_read_registers', 16)))))}", "max-write: 16",
            f"max-gap: {int(number(device.get('max_reg_hole', 0)))}",
            f"answer: {max(1, int(number(device.get('response_timeout_ms', 500))))}ms"]
    if single != multi:
        link.append(f"write-function: {6 if single else 16}")
    lines = ["format: 1", f"id: {name}", f"title: {quoted(template.get('title') or template.get('device_type') or name)}",
             "evidence: transcribed", f"source: {quoted('template ' + str(template.get('device_type', name)))}",
             "link: {" + ", ".join(link) + "}", "parameters:" if parameters else "parameters: []"]
    for keys in parameters:
        lines.append("  - {" + ", ".join(f"{key}: {value}" for key, value in keys.items()) + "}")
    return "\n".join(lines) + "\n", faults


def main(arguments):
    if len(arguments) not in (1, 2):
        print(__doc__, file=sys.stderr)
        return 2
    with open(arguments[0], encoding="utf-8") as file:
        template = json.loads(without_comments(file.read()))
    name = "device" if len(arguments) == 1 else re.sub(r".*/|\.yaml$", "", arguments[1])
    text, faults = convert(template, name)
    for fault in faults:
        print(fault, file=sys.stderr)
    if len(arguments) == 1:
        sys.stdout.write(text)
    else:
        with open(arguments[1], "w", encoding="utf-8") as file:
            file.write(text)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
