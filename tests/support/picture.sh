#!/usr/bin/env bash
# Makes the picture of a report that README.md shows: picture.sh BUILD, a build folder with tests.
# Needs Debian's chromium.
set -euo pipefail
if (($# != 1)) || [[ ! -x $1/spindle ]]; then
  printf 'usage: picture.sh BUILD, such as build/release\n' >&2
  exit 2
fi
build=$(realpath "$1")
picture=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../../share")/report.png
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cd "$scratch"
"$build/tests/spindle_peer_report_store" shift.db
"$build/spindle" report --store shift.db --tool station3 -f report.html
chromium --headless --no-sandbox --disable-gpu --disable-quic --no-first-run \
  --disable-background-networking --disable-component-update --disable-sync --hide-scrollbars \
  --user-data-dir="$scratch/profile" --window-size=1280,1060 --screenshot="$picture" \
  "file://$scratch/report.html"
