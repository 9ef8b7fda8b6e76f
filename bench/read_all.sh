#!/usr/bin/env bash
# Counts the requests for parameters 1-725 with their limits against a simulated tool: read_all.sh SPINDLE
set -euo pipefail

if (($# != 1)) || [[ ! -x $1 ]]; then
  printf 'usage: read_all.sh SPINDLE, the program to measure\n' >&2
  exit 2
fi
program=$1

coproc simulator { exec "$program" simulate doga-bm --quiet; }
# shellcheck disable=SC2154  # coproc sets it
trap 'kill "$simulator_PID"' EXIT
read -r url <&"${simulator[0]}"

# Requests of one reading of the named parameters; the identity is one of them.
requests() {
  # Status 9 says that some parameters do not exist.
  { "$program" get "$url" --profile doga-bm --limits --verbose "$@" 2>&1 >/dev/null || (($? == 9)); } |
    grep -c ' request: '
}

mapfile -t existing < <(seq -f 'p%g' 1 563; seq -f 'p%g' 569 725)
plain=$(requests "${existing[@]}")
holes=$(requests 'p[0-9]*')
printf 'identity and all that exist: %d requests\n' "$plain"
printf 'five holes in each of the three areas: %d more\n' "$((holes - plain))"
