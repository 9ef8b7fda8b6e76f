#!/usr/bin/env python3
"""What the programs of a build are made of, as SPDX 2.3 (JSON) on standard output: sbom.py BUILD

Read from the build itself: which shared libraries the programs load (ldd), which archives and headers went into them
(ninja), which Debian packages these belong to (dpkg), and what is kept in third_party/. Needs Debian.
Of a program for another architecture, the packages are those that packaging/static has unpacked.
"""

import datetime
import functools
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import tarfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
PROGRAMS = ("spindle", "spindle-forward", "spindle-serve")
# Licences of what becomes part of the programs, by the names in packaging/copyright; SPDX has other words for some.
SPDX_NAMES = {"Expat": "MIT", "BSD-3-clause": "BSD-3-Clause", "public-domain": "blessing", "CC0-1.0": "CC0-1.0"}


def said_by(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def sha256(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def version():
    return re.search(r"project\(spindle VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())[1]


def shared_libraries(program):
    """Paths of what is loaded with it; nothing for a static program."""
    done = subprocess.run(["ldd", program], capture_output=True, text=True, check=False)
    return [pathlib.Path(path) for path in re.findall(r"^\t(?:\S+ => )?(/\S+) \(", done.stdout, re.MULTILINE)]


class Build:
    def __init__(self, folder):
        self.folder = folder
        told = re.search(r"--sysroot=(\S+)", self._ninja("commands", "-s", "spindle"))
        self.sysroot = pathlib.Path(told[1]) if told else None
        self._system = ("/usr/", f"{self.sysroot}/usr/")
        self._headers = self._headers_by_object()

    def _ninja(self, *words):
        return said_by("ninja", "-C", str(self.folder), "-t", *words)

    def _headers_by_object(self):
        found = {}
        for line in self._ninja("deps").splitlines():
            if line and not line.startswith(" "):
                headers = found.setdefault(line.partition(":")[0], set())
            elif line.strip().startswith(self._system):
                headers.add(line.strip())
        return found

    def headers(self, program):
        """Headers of the system that were compiled into it."""
        objects = self._ninja("inputs", program).splitlines()
        return {pathlib.Path(header) for each in objects for header in self._headers.get(each, ())}

    def archives(self, program):
        """Archives of the system that were linked into it."""
        link = self._ninja("commands", "-s", program)
        found = {pathlib.Path(word) for word in link.split() if word.endswith(".a") and word.startswith(self._system)}
        flags = link.split()
        compiler = [re.search(r"(\S*\+\+\S*) ", link)[1],
                    *(flag for flag in flags if flag.startswith(("--sysroot=", "-B")))]
        names = [name for flag, name in (("-static-libstdc++", "libstdc++.a"), ("-static-libgcc", "libgcc.a"),
                                         ("-static", "libstdc++.a"), ("-static", "libgcc.a"), ("-static", "libc.a"))
                 if flag in flags]
        return found | {pathlib.Path(said_by(*compiler, f"-print-file-name={name}").strip()).resolve() for name in names}


class Packages:
    """Debian packages, by their files."""

    def __init__(self, sysroot):
        self._owners = {}
        for package in sorted((sysroot / "packages").glob("*.deb")) if sysroot else ():
            with subprocess.Popen(["dpkg-deb", "--fsys-tarfile", package], stdout=subprocess.PIPE) as unpacking, \
                    tarfile.open(fileobj=unpacking.stdout, mode="r|") as files:
                self._owners.update({sysroot / pathlib.PurePath(file.name): str(package) for file in files})

    def learn(self, paths):
        """Asks for all of them at once: every question reads all that dpkg knows."""
        asked = [path for path in paths if path not in self._owners]
        for path in asked:
            self._owners[path] = None
        # /lib and /usr/lib are one folder; dpkg knows a file by the name that its package has.
        names = {str(name): path for path in asked for name in (path, path.resolve(), *self._other_names(path))}
        for start in range(0, len(names), 2000):
            done = subprocess.run(["dpkg-query", "-S", *list(names)[start:start + 2000]], capture_output=True, text=True,
                                  check=False)
            for line in done.stdout.splitlines():
                owner, _, name = line.partition(": ")
                if name in names and not owner.startswith("diversion"):
                    self._owners[names[name]] = owner.split(",")[0]
        for path in asked:
            if self._owners[path] is None:
                sys.exit(f"sbom: {path} belongs to no package")

    def owners(self, paths):
        return {self._owners[path] for path in paths}

    @staticmethod
    def _other_names(path):
        for name in {str(path), str(path.resolve())}:
            yield name.removeprefix("/usr") if name.startswith("/usr/lib") else "/usr" + name

    @staticmethod
    @functools.cache
    def describe(owner):
        fields = ("binary:Package", "Version", "Architecture", "source:Package", "source:Version")
        ask = ("dpkg-deb", "--show") if owner.endswith(".deb") else ("dpkg-query", "--show")
        told = said_by(*ask, "--showformat", "\t".join("${%s}" % field for field in fields), owner).split("\t")
        return dict(zip(("name", "version", "architecture", "source", "source_version"), told))


def licences():
    """Of the libraries in packaging/copyright, by their names there."""
    text = (ROOT / "packaging" / "copyright").read_text()
    return {name.lower(): SPDX_NAMES.get(licence, "NOASSERTION") for name, licence in re.findall(
        r"^Files: (?:libraries|third_party)/([^/\s]+)\S*\n(?:.*\n)*?License: (\S+)", text, re.MULTILINE)}


class Document:
    def __init__(self, programs):
        digest = hashlib.sha256("".join(sha256(path) for path in programs).encode()).hexdigest()
        epoch = int(os.environ.get("SOURCE_DATE_EPOCH", 0)) or max(int(path.stat().st_mtime) for path in programs)
        self._packages, self._relations = {}, []
        self._licences = licences()
        self.head = {
            "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT",
            "name": f"spindle-{version()}", "documentNamespace": f"https://spindle.invalid/spdx/{version()}/{digest}",
            "creationInfo": {"created": datetime.datetime.fromtimestamp(epoch, datetime.timezone.utc)
                             .strftime("%Y-%m-%dT%H:%M:%SZ"), "creators": ["Tool: packaging/sbom.py"]}}

    def add(self, name, version_info, **more):
        spdx_id = "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]+", "-", f"{name}-{version_info}")
        self._packages.setdefault(spdx_id, {
            "SPDXID": spdx_id, "name": name, "versionInfo": version_info, "downloadLocation": "NOASSERTION",
            "filesAnalyzed": False, "licenseConcluded": "NOASSERTION", "licenseDeclared": "NOASSERTION",
            "copyrightText": "NOASSERTION", **more})
        return spdx_id

    def add_debian(self, owner):
        told = Packages.describe(owner)
        name = told["name"].partition(":")[0]
        distribution = f"arch={told['architecture']}&distro=debian-12"
        known = next((licence for library, licence in self._licences.items()
                      if name.startswith((f"lib{library.removeprefix('lib')}", library))), "NOASSERTION")
        return self.add(name, told["version"], supplier="Organization: Debian", licenseDeclared=known,
                        sourceInfo=f"Debian source package {told['source']} {told['source_version']}",
                        primaryPackagePurpose="LIBRARY", externalRefs=[{
                            "referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                            "referenceLocator": f"pkg:deb/debian/{name}@{told['version']}?{distribution}"
                            .replace("+", "%2B").replace(":", "%3A").replace("pkg%3A", "pkg:")}])

    def relate(self, one, kind, other):
        relation = {"spdxElementId": one, "relationshipType": kind, "relatedSpdxElement": other}
        if relation not in self._relations:
            self._relations.append(relation)

    def text(self):
        packages = [self._packages[key] for key in sorted(self._packages)]
        return json.dumps({**self.head, "packages": packages, "relationships": self._relations}, indent=1) + "\n"


def vendored(document, program):
    for folder in sorted((ROOT / "third_party").iterdir()):
        told = re.search(rf"^Files: third_party/{folder.name}/\*\n(?:.*\n)*?Comment: (\S+) (\S+),",
                         (ROOT / "packaging" / "copyright").read_text(), re.MULTILINE)
        files = [{"algorithm": "SHA256", "checksumValue": line.split()[0]}
                 for line in (folder / "SHA256SUMS").read_text().splitlines() if line.endswith(".js")]
        part = document.add(told[1], told[2], primaryPackagePurpose="LIBRARY", checksums=files,
                            licenseDeclared=licences()[folder.name.lower()], supplier="NOASSERTION")
        document.relate(program, "CONTAINS", part)


def describe(folder):
    build = Build(folder)
    packages = Packages(build.sysroot)
    programs = [folder / name for name in PROGRAMS if (folder / name).is_file()]
    document = Document(programs)
    shared, archives, headers = ({path: read(path) for path in programs} for read in (
        lambda path: set(shared_libraries(path)), lambda path: build.archives(path.name),
        lambda path: build.headers(path.name)))
    packages.learn(set().union(*shared.values(), *archives.values(), *headers.values()))
    for path in programs:
        program = document.add(path.name, version(), licenseDeclared="MIT", primaryPackagePurpose="APPLICATION",
                               supplier="NOASSERTION", checksums=[{"algorithm": "SHA256", "checksumValue": sha256(path)}])
        document.relate("SPDXRef-DOCUMENT", "DESCRIBES", program)
        dynamic = packages.owners(shared[path])
        for owner in sorted(dynamic):
            document.relate(program, "DYNAMIC_LINK", document.add_debian(owner))
        sources = {Packages.describe(owner)["source"] for owner in dynamic}
        static = packages.owners(archives[path])
        for owner in sorted(static | packages.owners(headers[path])):
            package = document.add_debian(owner)
            # Code of a library that is also loaded, or of the kernel's interface, is in its headers only.
            told = Packages.describe(owner)
            loaded = told["source"] in sources or told["name"].startswith("linux-libc-dev")
            if owner in static or not loaded:
                document.relate(program, "STATIC_LINK", package)
            else:
                document.relate(package, "BUILD_DEPENDENCY_OF", program)
        vendored(document, program)
    return document.text()


def main():
    if len(sys.argv) != 2 or not (pathlib.Path(sys.argv[1]) / "spindle").is_file():
        sys.exit("usage: sbom.py BUILD, such as build/release")
    sys.stdout.write(describe(pathlib.Path(sys.argv[1]).resolve()))


if __name__ == "__main__":
    main()
