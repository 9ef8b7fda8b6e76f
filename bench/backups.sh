#!/usr/bin/env bash
# Times the backup of one simulated tool and of forty, behind links with 5 ms a round trip:
# backups.sh SPINDLE
set -euo pipefail

if (($# != 1)) || [[ ! -x $1 ]]; then
  printf 'usage: backups.sh SPINDLE, the program to measure\n' >&2
  exit 2
fi
program=$(realpath "$1")
tools=40
rounds=11

scratch=$(mktemp -d)
simulators=()
cleanup() {
  local simulator
  for simulator in "${simulators[@]}"; do
    kill "$simulator" 2>/dev/null || true
  done
  wait
  rm -rf "$scratch"
}
trap cleanup EXIT
cd "$scratch"

{
  printf 'tools:\n'
  for ((tool = 1; tool <= tools; ++tool)); do
    mkfifo "port$tool"
    "$program" simulate doga-bm --fault latency=5ms --quiet >"port$tool" 2>/dev/null &
    simulators+=($!)
    read -r url <"port$tool"
    printf '  tool%d: {url: "%s", profile: doga-bm}\n' "$tool" "$url"
  done
  printf 'groups:\n  line: [%s]\n' "$(seq -s ', ' -f 'tool%g' 1 $tools)"
} >tools.yaml

# Milliseconds of one run.
run() {
  local began ended
  began=$(date +%s%N)
  "$program" backup "$@" --tools tools.yaml --dir out --force --quiet >/dev/null
  ended=$(date +%s%N)
  printf '%d\n' $(((ended - began) / 1000000))
}

median() { sort -n | sed -n "$((rounds / 2 + 1))p"; }

run tool1 >/dev/null
# One and all in turn, so that both meet the same machine.
for ((round = 0; round < rounds; ++round)); do
  run tool1 >>one
  run @line >>all
done
requests=$("$program" backup tool1 --tools tools.yaml -f - --verbose 2>&1 >/dev/null | grep -c ' request: ')
one=$(median <one)
all=$(median <all)
printf 'one tool: %d requests, %d ms: %d %% of requests x 5 ms\n' \
  "$requests" "$one" $((100 * one / (5 * requests)))
printf '%d tools: %d ms: %d %% of one\n' "$tools" "$all" $((100 * all / one))
