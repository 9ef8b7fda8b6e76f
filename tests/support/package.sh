#!/usr/bin/env bash
# Makes the Debian packages of a build, and uses them where nothing else is: unpacked, and installed, upgraded and
# removed by dpkg in a root of their own.
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
shopt -s nullglob
packages=("$work"/package/*.deb)
tool=("$work"/package/spindle_*.deb)
gateway=("$work"/package/spindle-gateway_*.deb)
[[ ${#packages[@]} -eq 2 && ${#tool[@]} -eq 1 && ${#gateway[@]} -eq 1 ]] ||
  fail "not the two packages: ${packages[*]}"

# What the packages say of themselves.
architecture=$(dpkg --print-architecture)
for package in "${packages[@]}"; do
  control=$(dpkg-deb --field "$package")
  for field in 'Priority: optional$' 'Maintainer: .+<.+@.+>$' 'Version: [0-9.]+-1$' \
    'Depends: .*libc6 \(>= ' "Architecture: $architecture\$"; do
    expect control "^$field" "$control"
  done
done
version=$(dpkg-deb --field "${tool[0]}" Version)
control=$(dpkg-deb --field "${gateway[0]}")
expect control '^Section: net$' "$control"
expect control "^Depends: .*spindle \(= $version\)" "$control"
for library in libmosquitto1 libpq5; do expect control "^Depends: .*$library" "$control"; done
control=$(dpkg-deb --field "${tool[0]}")
expect control '^Section: utils$' "$control"
if grep -Eq '^Depends: .*(mosquitto|libpq|httplib)' <<<"$control"; then
  fail "the tool itself needs what only its gateway should: $control"
fi
if command -v apt-get >/dev/null; then
  simulated=$(apt-get install --simulate --no-install-recommends "${packages[@]}" 2>&1) ||
    fail "their dependencies cannot be satisfied: $simulated"
  expect apt-get '^Inst spindle ' "$simulated"
  expect apt-get '^Inst spindle-gateway ' "$simulated"
fi
if command -v lintian >/dev/null; then
  found=$(lintian --fail-on error,warning "${packages[@]}" 2>/dev/null) || fail "lintian: $found"
fi

# ---- what is in them, and where ----

dpkg-deb --extract "${tool[0]}" "$root"
share=$root/usr/share
for file in spindle/spindle-1.schema.json spindle/profiles/doga-bm.yaml \
  bash-completion/completions/spindle zsh/vendor-completions/_spindle \
  fish/vendor_completions.d/spindle.fish doc/spindle/copyright doc/spindle/changelog.gz \
  doc/spindle/changelog.Debian.gz doc/spindle/examples/tools.yaml doc/spindle/examples/line1.yaml \
  doc/spindle/promises.md man/man1/spindle.1.gz \
  man/man5/spindle-profile.5.gz man/man5/spindle-tools.5.gz man/man5/spindle-backup.5.gz \
  man/man7/spindle-json.7.gz man/man7/spindle-tutorial.7.gz; do
  [[ -s $share/$file ]] || fail "$file is missing"
done
[[ -s $root/usr/lib/systemd/system/spindle-record.service ]] || fail "its unit is missing"
[[ ! -e $root/etc ]] || fail "a configuration is shipped: $(find "$root/etc")"

# The program finds its profiles, and says what it needs for the rest.
identity=$(run_there "$program" identify sim:doga-bm) || fail "identify: status $?"
expect identify '^sim:doga-bm +3204 +1021100042 +2103 +doga-bm ' "$identity"
profiles=$(run_there "$program" profile list -o csv) || fail "profile list: status $?"
expect 'profile list' ",$root/usr/(bin/\.\./)?share/spindle/profiles/doga-bm\.yaml" "$profiles"
if absent=$(run_there "$program" forward plant 2>&1); then fail "it forwards without its gateway"; fi
expect forward 'install the package spindle-gateway' "$absent"

dpkg-deb --extract "${gateway[0]}" "$root"
for file in libexec/spindle/spindle-forward libexec/spindle/spindle-serve \
  lib/systemd/system/spindle-forward@.service lib/systemd/system/spindle-serve.service \
  share/doc/spindle-gateway/copyright; do
  [[ -s $root/usr/$file ]] || fail "$file is missing"
done
if present=$(run_there "$program" forward no-such-sink 2>&1); then fail "it forwards to nowhere"; fi
if grep -q 'install the package' <<<"$present"; then fail "it does not find its gateway: $present"; fi

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

# The units are right, and give away little. Their programs are where they will be.
if command -v systemd-analyze >/dev/null; then
  mkdir "$work/units"
  for unit in "$root"/usr/lib/systemd/system/spindle-*.service; do
    name=$(basename "$unit")
    sed "s|^ExecStart=/usr/bin/spindle|ExecStart=$program|" "$unit" >"$work/units/$name"
    # It also says what is wrong with units of this machine.
    told=$(systemd-analyze verify --man=no "$work/units/$name" 2>&1 | grep -F "${name%.service}") || true
    [[ -z $told ]] || fail "$name: $told"
    exposed=$(systemd-analyze security --offline=true --threshold=20 "$unit" 2>&1) ||
      fail "$name is exposed: $(tail -n 1 <<<"$exposed")"
  done
fi

# ---- installed, upgraded and removed ----

clean=$work/clean
mkdir -p "$clean"/var/lib/dpkg/{info,updates,triggers} "$clean/etc"
: >"$clean/var/lib/dpkg/status"

# Maintainer scripts run on this machine, and change nothing but that root. What the packages depend on is not there.
dpkg_there() {
  dpkg --root="$clean" --force-not-root --force-script-chrootless --force-depends --log=/dev/null "$@" \
    >"$work/dpkg.log" 2>&1 || fail "dpkg $*: $(cat "$work/dpkg.log")"
}

state_of() { dpkg-query --admindir="$clean/var/lib/dpkg" -W -f='${Status} ${Version}' "$1" 2>/dev/null || true; }

# What is there beside dpkg's own records.
rest() {
  (cd "$clean" && find . -mindepth 1 -path ./var/lib/dpkg -prune -o ! -type d -print | sort)
}

wanted=$clean/etc/systemd/system/multi-user.target.wants/spindle-record.service
dpkg_there --install "${packages[@]}"
for name in spindle spindle-gateway; do
  [[ $(state_of "$name") == "install ok installed $version" ]] || fail "$name: $(state_of "$name")"
done
[[ -x $clean/usr/bin/spindle && -x $clean/usr/libexec/spindle/spindle-forward ]] || fail 'no programs'
[[ ! -e $clean/etc/systemd/system/multi-user.target.wants ]] || fail 'a unit was enabled by its package'

# An administrator enables the recorder, which stays so over an upgrade. Results are state.
if command -v systemctl >/dev/null; then
  systemctl --root="$clean" enable spindle-record.service >/dev/null 2>&1 || fail 'it cannot be enabled'
  [[ -L $wanted ]] || fail 'it was not enabled'
fi
mkdir -p "$clean/var/lib/private/spindle"
echo results >"$clean/var/lib/private/spindle/events.db"

mkdir "$work/newer"
for package in "${packages[@]}"; do
  dpkg-deb --raw-extract "$package" "$work/again"
  sed -i "s/^Version: .*/Version: $version+1/; s/(= $version)/(= $version+1)/" "$work/again/DEBIAN/control"
  dpkg-deb --root-owner-group --build "$work/again" "$work/newer/$(basename "$package")" >/dev/null
  rm -r "$work/again"
done
dpkg_there --install "$work"/newer/*.deb
[[ $(state_of spindle) == "install ok installed $version+1" ]] || fail "upgrade: $(state_of spindle)"
if command -v systemctl >/dev/null; then [[ -L $wanted ]] || fail 'an upgrade disabled the recorder'; fi

# The gateway does not stay without the program, nor beside another version of it.
if dpkg --root="$clean" --force-not-root --force-script-chrootless --log=/dev/null --remove spindle >/dev/null 2>&1; then
  fail 'the program can be removed below its gateway'
fi
dpkg_there --remove spindle-gateway spindle
[[ $(state_of spindle) == "deinstall ok config-files "* ]] || fail "remove: $(state_of spindle)"
[[ ! -e $clean/usr/bin/spindle && ! -e $clean/usr/libexec ]] || fail "what was removed is there: $(rest)"
dpkg_there --purge spindle-gateway spindle
[[ -z $(state_of spindle)$(state_of spindle-gateway) ]] || fail "purge: $(state_of spindle)"
left=$(rest)
[[ $left == ./var/lib/private/spindle/events.db ]] || fail "what was purged left: $left"

# What runs is run anew behind an upgrade, and stopped before it is removed, where systemd is there.
stubs=$work/stubs
mkdir "$stubs"
for stub in systemctl deb-systemd-invoke deb-systemd-helper; do
  # shellcheck disable=SC2016
  printf '#!/bin/sh\necho "%s $*" >>"$CALLS"\n' "$stub" >"$stubs/$stub"
  chmod +x "$stubs/$stub"
done
for package in "${packages[@]}"; do dpkg-deb --control "$package" "$work/control-$(dpkg-deb --field "$package" Package)"; done
# calls PACKAGE SCRIPT ARGUMENTS…
calls() {
  : >"$work/calls"
  # shellcheck disable=SC2016
  CALLS=$work/calls PATH=$stubs:$PATH unshare --mount --map-root-user sh -c '
    mount -t tmpfs tmpfs /run && mkdir -p /run/systemd/system && exec "$@"' sh \
    sh "$work/control-$1/$2" "${@:3}" || fail "$1: $2 ${*:3}"
  cat "$work/calls"
}
if unshare --mount --map-root-user true 2>/dev/null; then
  expect upgrade '^deb-systemd-invoke try-restart spindle-record\.service$' "$(calls spindle postinst configure 0.0.1-1)"
  expect upgrade '^systemctl --system daemon-reload$' "$(calls spindle postinst configure 0.0.1-1)"
  if grep -Eq 'invoke|helper .*enable .*[^-]enable' <<<"$(calls spindle postinst configure)"; then
    fail 'a first installation starts something'
  fi
  expect upgrade '^deb-systemd-invoke try-restart spindle-serve\.service spindle-forward@\*\.service$' \
    "$(calls spindle-gateway postinst configure 0.0.1-1)"
  expect remove '^deb-systemd-invoke stop spindle-record\.service$' "$(calls spindle prerm remove)"
  if grep -q stop <<<"$(calls spindle prerm upgrade 9)"; then fail 'an upgrade stops the recorder for its whole length'; fi
  expect purge '^deb-systemd-helper purge spindle-record\.service$' "$(calls spindle postrm purge)"
fi
