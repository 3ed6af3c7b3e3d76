#!/usr/bin/env bash
# scripts/bundle packs what the build makes, all of it, and nothing else. Usage: bundle.sh BUNDLE
set -euo pipefail
bundle=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
build="$work/a build"
folder="$work/a folder"

fail() {
  echo "$*: $(cat "$work/log")" >&2
  exit 1
}
refuses() {
  if "$bundle" "$build" "$folder" >"$work/log" 2>&1; then fail "accepted"; fi
}

mkdir -p "$build/bin" "$build/tests" "$build/install-test/bin" "$folder"
touch "$build/CMakeCache.txt"
cat >"$build/build.ninja" <<'NINJA'
rule CXX_EXECUTABLE_LINKER__any_Release
  command = false
build bin/jfpx: CXX_EXECUTABLE_LINKER__any_Release
build tests/cuda_test_f64: CXX_EXECUTABLE_LINKER__any_Release
build tests/math_test: CXX_EXECUTABLE_LINKER__any_Release
NINJA
cp "$(type -P true)" "$build/bin/jfpx"
cp "$(type -P false)" "$build/install-test/bin/jfpx"
refuses
grep -q tests/cuda_test_f64 "$work/log" || fail "does not say what is missing"
cp "$(type -P true)" "$build/tests/cuda_test_f64"
cp "$(type -P true)" "$build/tests/math_test"

touch "$folder/mine"
refuses
[ -e "$folder/mine" ] || fail "threw away a folder that was no bundle"
rm "$folder/mine"
for time in first second; do
  "$bundle" "$build" "$folder" >"$work/log" 2>&1 || fail "the $time time"
  "$folder/run" jfpx || fail "the $time time: jfpx is another program"
  [ "$(ls -m "$folder/bin")" = "cuda_test_f64, jfpx" ] || fail "the bundle has $(ls -m "$folder/bin")"
done
