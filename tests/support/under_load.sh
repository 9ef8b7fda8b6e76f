#!/usr/bin/env bash
# Runs a command beside busy processes of low priority, as on a machine that has other things to do, and ends
# with the status of the command.
set -euo pipefail

usage() {
  cat <<'END'
usage: under_load.sh [-n PROCESSES] [-p NICENESS] COMMAND [ARGUMENT...]

  -n PROCESSES  how many busy processes (4)
  -p NICENESS   their niceness, 0 to 19 (10)
END
}

processes=4
niceness=10
while getopts n:p:h option; do
  case $option in
    n) processes=$OPTARG ;;
    p) niceness=$OPTARG ;;
    h) usage && exit 0 ;;
    *) usage >&2 && exit 2 ;;
  esac
done
shift $((OPTIND - 1))
if (($# == 0)); then
  usage >&2
  exit 2
fi

busy=()
end_load() {
  ((${#busy[@]} == 0)) || kill "${busy[@]}" 2>/dev/null || true
}
trap end_load EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP

for ((i = 0; i < processes; ++i)); do
  nice -n "$niceness" "$BASH" -c 'while kill -0 "$0" 2>/dev/null; do for ((i = 0; i < 1000000; ++i)); do :; done; done' $$ &
  busy+=($!)
done

status=0
"$@" || status=$?
exit "$status"
