#!/usr/bin/env bash
# A short tour of spindle against a simulated tool on a loopback port and simulated motor drivers on a
# pseudo terminal: tour.sh SPINDLE [REPORT.html]
# Fails when a step does not end as it should. The report is kept where it is named.
set -euo pipefail

if (($# < 1 || $# > 2)) || [[ ! -x $1 ]]; then
  printf 'usage: tour.sh SPINDLE [REPORT.html], the program to show, and where its report is kept\n' >&2
  exit 2
fi
program=$(realpath "$1")
page=
if (($# == 2)); then
  page=$(realpath "$2")
fi

# The tour leaves no trace in the user's home and does not depend on what is configured there.
scratch=$(mktemp -d)
export XDG_STATE_HOME=$scratch/state XDG_CONFIG_HOME=$scratch/config
unset SPINDLE_TOOLS
cd "$scratch"

simulator=
drivers=
cleanup() {
  local started
  for started in $simulator $drivers; do
    stop "$started"
  done
  rm -rf "$scratch"
}
trap cleanup EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# Ends a process that this script started: politely, and after two seconds for certain.
stop() {
  local tries
  kill -TERM "$1" 2>/dev/null || return 0
  for ((tries = 0; tries < 20; ++tries)); do
    kill -0 "$1" 2>/dev/null || return 0
    sleep 0.1
  done
  kill -KILL "$1" 2>/dev/null || true
}

fail() {
  printf 'tour: %s\n' "$*" >&2
  local log
  for log in "$scratch"/{simulator,drivers}.log; do
    if [[ -s $log ]]; then
      printf 'the simulator said:\n' >&2
      cat "$log" >&2
    fi
  done
  exit 1
}

say() { printf '\n# %s\n' "$*"; }

# The command line as one would type it.
typed() {
  local word line=
  for word in "$@"; do
    case $word in
      *[\*\?\[\ ]*) line+=" '$word'" ;;
      *) line+=" $word" ;;
    esac
  done
  printf '$ spindle%s\n' "$line"
}

# Runs spindle with the arguments behind the first one, shows it, and insists on the exit status.
run() {
  local expected=$1 status=0
  shift
  typed "$@"
  "$program" "$@" </dev/null >"$scratch/output" 2>&1 || status=$?
  cat "$scratch/output"
  if ((status != 0)); then
    printf '(exit status %d)\n' "$status"
  fi
  if ((status != expected)); then
    fail "expected exit status $expected, not $status"
  fi
}

# Insists that the last command printed what a pattern of grep describes.
shown() {
  grep -Eq -- "$1" "$scratch/output" || fail "the output lacks '$1'"
}

# Waits, for at most five seconds, until a file has a line that a pattern of grep describes.
await() {
  local tries
  for ((tries = 0; tries < 50; ++tries)); do
    grep -Eq -- "$1" "$2" 2>/dev/null && return 0
    sleep 0.1
  done
  fail "waited in vain for '$1'"
}

say "a simulated DOGA BM screwdriver on a free port of this machine"
typed simulate doga-bm --listen tcp://127.0.0.1:0
mkfifo answers
"$program" simulate doga-bm --listen tcp://127.0.0.1:0 >answers 2>simulator.log &
simulator=$!
disown
exec {answers}<answers
read -r -t 5 url <&"$answers" || fail "the simulator did not say where it listens"
[[ $url =~ ^tcp://127\.0\.0\.1:[1-9][0-9]*$ ]] || fail "'$url' is not where a simulator listens"
printf '%s\n' "$url"

say "who is there?"
run 0 identify "$url"
shown doga-bm

say "what can be read and set, without any tool"
run 0 list --profile doga-bm 'preset.1.*'
shown 'preset\.1\.target-torque'

say "what is set"
run 0 get "$url" --profile doga-bm 'preset.1.*torque*'
shown 'preset\.1\.target-torque'

say "more than the tool allows is refused before anything is written"
run 2 set "$url" --profile doga-bm preset.1.target-torque=9.99
shown '9\.99'

say "what it allows is written and read back"
run 0 set "$url" --profile doga-bm preset.1.target-torque=3.10
run 0 get "$url" --profile doga-bm 'preset.1.*torque*'
shown 'preset\.1\.target-torque +3\.10'

say "the round trip: backup, change, compare, restore, nothing left"
run 0 backup "$url" --profile doga-bm -f before.yaml
run 0 set "$url" --profile doga-bm preset.1.target-torque=2.90 preset.2.speed=900
run 1 diff before.yaml "$url" --profile doga-bm
shown 'preset\.1\.target-torque .* 3\.10 +2\.90'
run 0 restore "$url" before.yaml --profile doga-bm --yes
shown '2 written'
run 0 diff before.yaml "$url" --profile doga-bm
shown '0 different'

say "the user watches, and the tool is started: under a guard that always ends in a stop"
typed watch "$url" --profile doga-bm --count 1 --duration 20s
"$program" watch "$url" --profile doga-bm --count 1 --duration 20s >watched 2>&1 &
watcher=$!
await 'connected' watched
run 0 remote-start "$url" --profile doga-bm --accept-unverified --yes
shown 'fastening-ok'
wait "$watcher" || fail "watch ended with status $?"
printf '# and what the watcher saw:\n'
cat watched
grep -q 'fastening-ok' watched || fail "the watcher saw no result"

say "is there an alarm?"
run 0 alarms "$url" --profile doga-bm
shown 'present'

say "the second system: two simulated BLV motor drivers on a serial line, here a pseudo terminal"
typed simulate orientalmotor-blv --pty line --units 1-2
mkfifo lines
"$program" simulate orientalmotor-blv --pty line --units 1-2 >lines 2>drivers.log &
drivers=$!
disown
exec {lines}<lines
read -r -t 5 url <&"$lines" || fail "the simulator did not say where it serves"
[[ $url == rtu://*/line\?unit=1 ]] || fail "'$url' is not a line with a unit"
printf '%s\n' "$url"

say "who is on the line?"
run 0 scan "${url%\?*}" --units 1-4 --timeout 50ms --profile orientalmotor-blv
shown '4 asked, 2 found'
run 0 identify "$url" --profile orientalmotor-blv
shown orientalmotor-blv

say "a speed is set, and the motor is run for a second: it always ends in a stop"
run 0 set "$url" --profile orientalmotor-blv operation.3.speed=1200
shown 'operation\.3\.speed .* 1200 .*written'
run 0 remote-start "$url" --profile orientalmotor-blv --speed 500 --for 1s --watchdog 1s --yes
shown 'started'
shown 'the motor stands still'

say "is there an alarm, or was there one?"
run 0 alarms "$url" --profile orientalmotor-blv
shown 'present'

say "what is set in the driver goes into a file"
run 0 backup "$url" --profile orientalmotor-blv -f driver.yaml
shown '1 saved'
grep 'operation\.3\.' driver.yaml || fail "the backup lacks operation data 3"
run 0 diff driver.yaml "$url" --profile orientalmotor-blv
shown '0 different'

say "a line at work: an operator drives screws, and every result is kept in a store"
kill -TERM "$simulator"
typed simulate doga-bm --rundown-every 200ms --burst 12 --ng-every 3
mkfifo works
"$program" simulate doga-bm --rundown-every 200ms --burst 12 --ng-every 3 >works 2>simulator.log &
simulator=$!
disown
exec {works}<works
read -r -t 5 url <&"$works" || fail "the simulator did not say where it listens"
run 0 record "$url" --profile doga-bm --store line.db --count 60

say "what was stored, and whether nothing is missing"
run 0 results --store line.db --count 3
shown 'fastening'
run 0 store check --store line.db
shown 'complete|no hole|0 holes'

say "how good is the process? first as a table, then as a page for the wall"
run 0 report --store line.db
shown 'torque'
run 0 report --store line.db -f report.html
grep -q '<svg' report.html || fail "the page shows no figure"
if [[ -n $page ]]; then
  cp report.html "$page"
  printf '# the page lies in %s\n' "$page"
fi

say "that was the tour; 'spindle --help' shows the rest, and so does ./check"
