#!/usr/bin/env bash
# Tests scripts/fuzz with targets that fail to start, find something, or find nothing. Usage: script.sh FUZZ
set -euo pipefail
fuzz=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/bin" "$work/mine"

fail() {
  echo "$*" >&2
  exit 1
}
target() { # SHELL_COMMANDS
  printf '#!/bin/sh\n%s\n' "$1" >"$work/bin/fuzz_scene"
  chmod +x "$work/bin/fuzz_scene"
}
expect() { # STATUS ARGS
  local expected=$1 status=0
  shift
  (cd "$work" && "$fuzz" -b bin "$@" scene) >"$work/log" 2>&1 || status=$?
  [ "$status" = "$expected" ] || fail "$* ended with $status instead of $expected: $(cat "$work/log")"
}

target 'exit 1'
expect 2 -t 1 -o found
# shellcheck disable=SC2016  # the target expands it
target 'sleep 0.1; for a; do case $a in -artifact_prefix=*) echo x >"${a#*=}crash" ;; esac; done; echo "#7: cov: 1"'
expect 1 -t 1 -o found
[ -e "$work/found/findings/scene/crash" ] || fail "the finding is not in the caller's folder"
target 'echo "#7: cov: 1"'
expect 0 -t 1 -o found # findings of earlier runs do not count

touch "$work/mine/file"
expect 2 --bundle mine
[ -e "$work/mine/file" ] || fail "a folder that is not a bundle was emptied"
