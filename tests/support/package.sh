#!/usr/bin/env bash
# Makes the Debian package of a build, unpacks it where nothing else is, and uses it from there.
set -euo pipefail

if (($# != 2)); then
  printf 'usage: package.sh BUILD-FOLDER CPACK\n' >&2
  exit 2
fi
build=$1
cpack=$2
export LC_ALL=C.UTF-8

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
root=$work/root
program=$root/usr/bin/spindle

fail() {
  printf 'package: %s\n' "$*" >&2
  exit 1
}

# As a user's shell that knows nothing: no HOME, no variables of ours.
run_there() { (cd "$work" && env -i "$@"); }

# expect WHAT PATTERN TEXT
expect() {
  grep -Eq -- "$2" <<<"$3" || fail "$1: '$2' is not in: $3"
}

"$cpack" --config "$build/CPackConfig.cmake" -G DEB -B "$work/package" >"$work/cpack.log" 2>&1 ||
  fail "cpack: $(cat "$work/cpack.log")"
packages=("$work"/package/*.deb)
package=${packages[0]}
[[ ${#packages[@]} -eq 1 && -f $package ]] || fail "not one package: ${packages[*]}"

# What the package says of itself.
control=$(dpkg-deb --field "$package")
for field in 'Package: spindle$' 'Section: utils$' 'Priority: optional$' 'Maintainer: .+<.+@.+>$' \
  'Version: [0-9.]+-1$' 'Depends: .*libc6 \(>= ' "Architecture: $(dpkg --print-architecture)\$"; do
  expect control "^$field" "$control"
done
if command -v apt-get >/dev/null; then
  simulated=$(apt-get install --simulate --no-install-recommends "$package" 2>&1) ||
    fail "its dependencies cannot be satisfied: $simulated"
  expect apt-get '^Inst spindle ' "$simulated"
fi
if command -v lintian >/dev/null; then
  found=$(lintian --fail-on error,warning "$package" 2>/dev/null) || fail "lintian: $found"
fi

# What is in it, and where.
dpkg-deb --extract "$package" "$root"
share=$root/usr/share
for file in spindle/spindle-1.schema.json spindle/profiles/doga-bm.yaml \
  bash-completion/completions/spindle zsh/vendor-completions/_spindle \
  fish/vendor_completions.d/spindle.fish doc/spindle/copyright doc/spindle/changelog.gz \
  doc/spindle/changelog.Debian.gz man/man1/spindle.1.gz man/man5/spindle-profile.5.gz \
  man/man5/spindle-tools.5.gz man/man5/spindle-backup.5.gz man/man7/spindle-json.7.gz; do
  [[ -s $share/$file ]] || fail "$file is missing"
done

# The program finds its profiles.
identity=$(run_there "$program" identify sim:doga-bm) || fail "identify: status $?"
expect identify '^sim:doga-bm +3204 +1021100042 +2103 +doga-bm ' "$identity"
profiles=$(run_there "$program" profile list -o csv) || fail "profile list: status $?"
expect 'profile list' ",$root/usr/(bin/\.\./)?share/spindle/profiles/doga-bm\.yaml" "$profiles"

# Completion, by the script that bash would load.
# shellcheck disable=SC2016
completed=$(run_there PATH="$root/usr/bin:/usr/bin:/bin" bash --norc -c '
  compopt() { :; }
  source "$1"
  COMP_LINE="spindle get sim:doga-bm preset.1.tar"
  COMP_POINT=${#COMP_LINE}
  _spindle spindle preset.1.tar ""
  printf "%s\n" "${COMPREPLY[@]}"' bash "$share/bash-completion/completions/spindle")
expect completion '^preset\.1\.target-torque ?$' "$completed"

# The manual renders.
for page in "$share"/man/man*/*.gz; do
  name=$(basename "$page" .gz)
  if command -v man >/dev/null; then
    text=$(MANWIDTH=80 man --local-file --warnings "$page" 2>"$work/warnings" | col -b)
    [[ ! -s $work/warnings ]] || fail "man $name: $(cat "$work/warnings")"
  elif command -v mandoc >/dev/null; then
    text=$(mandoc -T utf8 "$page" | col -b)
  else
    break
  fi
  expect "$name" '^NAME$' "$text"
  expect "$name" "^ +${name%.*} " "$text"
done
