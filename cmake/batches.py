#!/usr/bin/env python3
"""Combines source files into batches, so that the headers that they share are read once for all of them.

usage: batches.py --output DIR --include DIR … (--wrapped | --proven) FILE …

Prints what is to be compiled instead of the files, separated by semicolons: batches, and files that stay alone. A
batch includes all headers of its files and then the files, as they are: the compiler names them and their lines.
No file may come to mean something else beside others:

--wrapped  Each file of a batch has a namespace of its own: for files that export nothing, such as tests. A file
           that opens a namespace, specialises a template or uses the preprocessor stays alone.
--proven   Files share a batch only if none of them contains a name that is private to another one, nor calls a
           function of which only another one sees an overload. A file with a line that is not understood stays
           alone. This trusts the formatting: what a namespace declares begins in column 1, and its members do not.
"""
import argparse
import functools
import itertools
import os
import pathlib
import re
import sys

SIZE = 8
INCLUDE = re.compile(r'^#include (?:"(?P<own>[^"]+)"|(?P<other><[^>]+>))', re.MULTILINE)
# What reaches beyond a namespace that is put around a whole file.
REACHES_OUT = re.compile(r"^(?:namespace \w|inline namespace|template <>|extern\b|#(?!include\b))", re.MULTILINE)

# Numbers are matched so that their separators begin no character.
TEXT = re.compile(r'R"(?P<mark>\w*)\(.*?\)(?P=mark)"|"(?:\\.|[^"\\\n])*"|\b\d[\w\'.]*|\'(?:\\.|[^\'\\\n])+\''
                  r"|//(?! namespace$)[^\n]*|/\*.*?\*/", re.DOTALL | re.MULTILINE)
MEMBER = re.compile(r"(?:\.|->)\s*[A-Za-z_]\w*")
QUALIFIED = re.compile(r"\b(\w+)::(\w+)")
NAME = re.compile(r"[A-Za-z_]\w*")
CALL = re.compile(r"\b([A-Za-z_]\w*)(?:<[\w:, ]*>)?[({]")
TEMPLATE = re.compile(r"\btemplate <|\bauto&* \w+[,)]")
# Lines in column 1 that declare no name of the namespace that they stand in.
SILENT = re.compile(r"#include |static_assert\(|template <[^>]|requires |using namespace std::\w*literals;")
NOT_UNDERSTOOD = re.compile(r"#|template <>|extern\b|enum (?!class)|inline namespace|.*\boperator\b(?!=\()|using (?:enum|namespace)")
IMPORT = re.compile(r"using ([\w:]+::(\w+));")
NAMED = [re.compile(r"(?:__extension__ )?(?:using|namespace) (\w+) ="), re.compile(r"(?:struct|class|enum class) (?:\[\[\w+\]\] )?(\w+)")]
DECLARED = re.compile(r"(?P<name>[\w:~]+)\s*(?P<next>[({\[=;])")
NAMESPACE = re.compile(r"namespace ([\w:]+) \{")
# Found by standard and fmt templates for the types of a namespace, whatever file they are in.
FOUND_BY_TEMPLATES = {"begin", "end", "size", "data", "swap", "iter_swap", "iter_move", "format_as", "to_string", "hash_value"}


@functools.cache
def includes(source, folders):
    """What a file includes: ours as resolved paths, the others as they are written."""
    found = []
    for include in INCLUDE.finditer(source.read_text()):
        candidates = [folder / include["own"] for folder in (source.parent, *folders)] if include["own"] else []
        ours = next((path for path in candidates if path.is_file()), None)
        found.append(pathlib.Path(os.path.normpath(ours)) if ours else include["other"] or f'"{include["own"]}"')
    return found


def declared(line):
    """The name that a line in column 1 declares and whether it is a function's; a ValueError for a line that is not
    understood."""
    if SILENT.match(line):
        return "", False
    if NOT_UNDERSTOOD.match(line):
        raise ValueError(line)
    for named in NAMED:
        if match := named.match(line):
            return match[1], False
    without_arguments = line
    while (shorter := re.sub(r"<[^<>]*>", "", without_arguments)) != without_arguments:
        without_arguments = shorter
    if not (match := DECLARED.search(without_arguments)):
        raise ValueError(line)
    # A member that is defined outside its class has no name of its own here.
    return "" if "::" in match["name"] else match["name"], match["next"] == "("


class Code:
    """What one file declares and mentions."""

    def __init__(self, path):
        self.path = path
        text = TEXT.sub(lambda match: '""' if match[0][0] in "R\"'" else "0" if match[0][0].isdigit() else "",
                        path.read_text())
        self.hidden, self.imports, self.functions, self.others, self.understood = set(), {}, set(), {}, True
        self.namespace, is_hidden = "", False
        for line in text.splitlines():
            if line.startswith("namespace {"):
                is_hidden = True
            elif line == "}  // namespace":
                is_hidden = False
            elif match := NAMESPACE.match(line):
                self.namespace = match[1]
            elif match := IMPORT.match(line):
                self.imports[match[2]] = match[1]
            elif line[:1].isalpha() or line[:1] in ("_", "#", "~"):
                self.declare(line, is_hidden)
        self.own = self.functions | self.others.keys()
        self.shown = self.own | self.imports.keys()
        # What stands behind the name of another namespace is looked for in that one.
        own = self.namespace.split("::")
        alone = QUALIFIED.sub(lambda match: match[0] if match[1] in own else match[1], MEMBER.sub("", text))
        self.mentioned = set(NAME.findall(alone))
        self.called_by_templates = set(CALL.findall(alone)) if TEMPLATE.search(text) else set()

    def declare(self, line, is_hidden):
        try:
            name, is_function = declared(line)
        except ValueError:
            self.understood = False
            return
        if name and is_hidden:
            self.hidden.add(name)
        elif name and is_function:
            self.functions.add(name)
        elif name:
            self.others[name] = f"{self.namespace}::{name}"

    @functools.cache
    def entities(self):
        """What its names stand for, other than functions."""
        return {*self.others.values(), *self.imports.values()}


class File(Code):
    """A source file, and what its headers show it."""

    def __init__(self, path, headers):
        super().__init__(path)
        self.headers = headers
        seen = set().union(*(header.shown for header in headers))
        self.seen_entities = set().union(*(header.entities() for header in headers))
        self.private = self.hidden | (self.own - seen)
        self.may_change = self.mentioned & seen
        self.near = set().union(*(header.shown for header in headers if self.is_inside(header.namespace)))
        for_templates = FOUND_BY_TEMPLATES.union(*(header.called_by_templates for header in headers))
        self.alone = not self.understood or bool(self.private & for_templates)

    def is_safe_beside(self, other):
        """Whether this file means the same where it is compiled together with the other one."""
        imported = {name for name, meaning in other.imports.items() if self.imports.get(name) != meaning}
        return (other.private | imported).isdisjoint(self.mentioned) and not any(
            self.is_changed_by(header) for header in other.headers - self.headers)

    def is_inside(self, namespace):
        return f"{self.namespace}::".startswith(f"{namespace}::")

    def is_changed_by(self, header):
        """Whether a header brings an overload of a function that this file calls, or something nearer than what it
        means by a name."""
        if not header.functions.isdisjoint(self.may_change):
            return True
        brought = header.entities() - self.seen_entities if self.is_inside(header.namespace) else ()
        return any(entity.split("::")[-1] in self.may_change & self.near for entity in brought)


def closure(source, folders, seen):
    """All headers of ours that a file sees."""
    for header in includes(source, folders):
        if isinstance(header, pathlib.Path) and header not in seen:
            seen.add(header)
            closure(header, folders, seen)
    return seen


def wrapped_batches(sources):
    """Batches of about the same number of files, in their order."""
    alone = [source for source in sources if REACHES_OUT.search(source.read_text())]
    others = [source for source in sources if source not in alone]
    count = -(-len(others) // SIZE)
    batches = [others[len(others) * i // count:len(others) * (i + 1) // count] for i in range(count)]
    return batches + [[source] for source in alone]


def proven_batches(sources, folders):
    """Each file joins the first batch that has room and leaves every meaning as it is."""
    code = functools.cache(Code)
    files = [File(source, {code(header) for header in closure(source, folders, set())}) for source in sources]
    batches = []
    for file in files:
        for batch in [] if file.alone else batches:
            if len(batch) < SIZE and all(
                    not mate.alone and mate.is_safe_beside(file) and file.is_safe_beside(mate) for mate in batch):
                batch.append(file)
                break
        else:
            batches.append([file])
    return [[file.path for file in batch] for batch in batches]


def batch_text(batch, folders, wrapped):
    """All headers first, so that what the files include themselves adds nothing between or inside them."""
    headers = dict.fromkeys(itertools.chain(*(includes(source, folders) for source in batch)))
    lines = [f'#include "{header}"' if isinstance(header, pathlib.Path) else f"#include {header}" for header in headers]
    for source in batch:
        inclusion = [f'#include "{source}"']
        lines += [f"namespace {re.sub(r'[^A-Za-z0-9]', '_', source.stem)} {{", *inclusion, "}"] if wrapped else inclusion
    return "\n".join(lines) + "\n"


def write(path, text):
    """Leaves a file that is right already as old as it is: nothing is to be built again."""
    if not path.is_file() or path.read_text() != text:
        path.write_text(text)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--output", type=pathlib.Path, required=True)
    parser.add_argument("--include", type=pathlib.Path, nargs="+", default=[])
    way = parser.add_mutually_exclusive_group(required=True)
    way.add_argument("--wrapped", type=pathlib.Path, nargs="+")
    way.add_argument("--proven", type=pathlib.Path, nargs="+")
    arguments = parser.parse_args()

    folders = tuple(arguments.include)
    if arguments.wrapped:
        batches = wrapped_batches(arguments.wrapped)
    else:
        batches = proven_batches(arguments.proven, folders)
    arguments.output.mkdir(parents=True, exist_ok=True)
    compiled = []
    for number, batch in enumerate(batches):
        if len(batch) == 1:
            compiled += batch
            continue
        compiled.append(arguments.output / f"batch_{number}.cpp")
        write(compiled[-1], batch_text(batch, folders, bool(arguments.wrapped)))
    print(";".join(str(path) for path in compiled), end="")


if __name__ == "__main__":
    sys.exit(main())
