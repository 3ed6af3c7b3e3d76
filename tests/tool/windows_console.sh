#!/usr/bin/env bash
# The command on a console of Windows, which Wine draws on a terminal: it shows its progress there, names have their
# letters, and Ctrl-C ends it and leaves no files. Usage: windows_console.sh PROGRAM [ARGUMENT...], which run the command.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export LC_ALL=C.UTF-8 # Wine reads arguments and names by the locale

fail() {
  echo "windows_console: $*: $(cat -v "$work/output")" >&2
  exit 1
}
mkfifo "$work/keys"
exec 3<>"$work/keys"
start() { # COMMAND LINE
  : >"$work/output"
  script -qefc "$1" /dev/null <"$work/keys" >"$work/output" &
}
has_ended() { # STATUS
  local status=0
  wait $! || status=$?
  [ "$status" -eq "$1" ] || fail "the status is $status instead of $1"
}
printf -v command '%q ' "$@"

start "$command run missing-ä.json"
has_ended 2
grep -qF 'missing-ä.json' "$work/output" || fail "the name of the file is not shown"

mkdir "$work/results"
start "$command run pile --spheres 500 --steps 1000000 --record $(printf %q "Z:$work/results/run.rec")"
for _ in $(seq 600); do
  ! grep -q '/1000000' "$work/output" || break
  sleep 0.1
done
grep -q '/1000000' "$work/output" || fail "no progress in a minute"
printf '\003' >&3
has_ended 58 # the low byte of STATUS_CONTROL_C_EXIT
[ -z "$(ls -A "$work/results")" ] || fail "$(ls "$work/results") is left"
echo "windows_console: passed"
