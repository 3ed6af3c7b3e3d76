#!/usr/bin/env bash
# jfpx run on several ranks has the output of one process. Usage: run_test.sh WORK PRECISIONS JFPX MPIEXEC
# [FLAGS...]. PRECISIONS: those of --precision that are tested, too. The flags end with that for the number of processes.
set -euo pipefail
work=$1 precisions=$2 jfpx=$3
shift 3
mpirun=("$@")
rm -rf "$work"
mkdir -p "$work"

fail() {
  echo "$*" >&2
  exit 1
}
on_ranks() { # RANKS ARGS
  "${mpirun[@]}" "$1" "$jfpx" "${@:2}"
}
refuses() { # TEXT RANKS ARGS
  local status=0
  on_ranks "${@:2}" >"$work/log" 2>&1 || status=$?
  [ $status -eq 2 ] || fail "status $status of ${*:2}: $(cat "$work/log")"
  grep -qF -- "$1" "$work/log" || fail "no \"$1\" in: $(cat "$work/log")"
}

scene=(pile --spheres 200)
check_hash() { # RANKS ARGS
  local one several
  one=$("$jfpx" run "${scene[@]}" --steps 20 --quiet --hash "${@:2}")
  several=$(on_ranks "$1" run "${scene[@]}" --steps 20 --quiet --hash "${@:2}")
  [ "$several" = "$one" ] || fail "$1 ranks have the hash $several; one process has $one: ${*:2}"
}
for ranks in 1 2 5; do check_hash $ranks; done
for precision in $precisions; do check_hash 3 --precision "$precision"; done

# Files of rank 0, on three ranks.
outputs() { # FOLDER
  mkdir "$1"
  echo --hash --record "$1/run.rec" --snapshot "$1/run.snap" --trajectory "$1/run.xyz" --csv "$1/run.csv" --json "$1/run.json"
}
# shellcheck disable=SC2046  # words are what is wanted
"$jfpx" run "${scene[@]}" --steps 20 $(outputs "$work/one") >/dev/null
# shellcheck disable=SC2046
on_ranks 3 run "${scene[@]}" --steps 20 $(outputs "$work/three") >"$work/three.txt"
[ "$(grep -cE ', 3 ranks$|^[0-9a-f]{16}$' "$work/three.txt")" = 2 ] || fail "$(cat "$work/three.txt")"
for file in run.rec run.snap run.xyz; do cmp "$work/one/$file" "$work/three/$file"; done
for folder in one three; do
  cut -d, -f1-3,9- "$work/$folder/run.csv" >"$work/$folder/states.csv" # without times
  sed '/"ms"/,/}/d; /"ranks"/d; /"choices"/,/}/d' "$work/$folder/run.json" >"$work/$folder/states.json"
done
cmp "$work/one/states.csv" "$work/three/states.csv"
cmp "$work/one/states.json" "$work/three/states.json"

# A signal to one rank ends all after the same step, and rank 0 removes the file that is not complete.
"${mpirun[@]}" 3 "$jfpx" run "${scene[@]}" --steps 1000000000 --csv "$work/ended.csv" >"$work/log" 2>&1 &
run=$!
until [ "$(find "$work" -name ended.csv.part -size +4k)" ]; do # ranks step
  kill -0 $run || fail "$(cat "$work/log")"
  sleep 0.1
done
for process in $(pgrep -f "$work/ended.csv"); do
  [ "$(readlink "/proc/$process/exe")" != "$(realpath "$jfpx")" ] || rank=$process
done
kill -TERM "$rank"
! wait $run || fail "an interrupted run succeeds: $(cat "$work/log")"
[ -z "$(find "$work" -name 'ended*')" ] || fail "an interrupted run leaves a file: $(cat "$work/log")"

# A rank that is killed ends the others, and another number of ranks continues from the checkpoint.
small=(pile --spheres 30 --quiet --hash)
"${mpirun[@]}" 3 "$jfpx" run "${small[@]}" --steps 1000000000 --checkpoint 20 "$work/run.check" >"$work/log" 2>&1 &
run=$!
until [ -f "$work/run.check" ]; do
  kill -0 $run || fail "$(cat "$work/log")"
  sleep 0.02
done
rank=
for process in $(pgrep -f "$work/run.check"); do
  [ "$(readlink "/proc/$process/exe")" != "$(realpath "$jfpx")" ] || rank=$process
done
kill -KILL "$rank"
! wait $run || fail "a run succeeds without a rank: $(cat "$work/log")"
continued=$(on_ranks 2 run "${small[@]}" --steps 1500 --from "$work/run.check")
[ "$continued" = "$("$jfpx" run "${small[@]}" --steps 1500)" ] || fail "a checkpoint continues with the hash $continued"
refuses "it must be a snapshot of a run of the scene" 2 run pile --spheres 31 --from "$work/run.check"

refuses "jfpx devices runs as one process" 2 devices
refuses "several ranks require --engine native" 2 run pile --engine bullet
refuses "a demo runs as one process" 2 run flight
# Rank 0 fails while the others compute.
refuses "jfpx: rank 0: /nowhere/run.csv" 2 run "${scene[@]}" --steps 20 --csv /nowhere/run.csv
