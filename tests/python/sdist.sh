#!/usr/bin/env bash
# pip names the package that a build from the source package lacks. Usage: sdist.sh SDIST PYTHON WORK; the environment of
# PYTHON has pip, scikit-build-core and nanobind. Nothing is compiled.
set -euo pipefail
sdist=$1 python=$2 work=$3
rm -rf "$work"
mkdir -p "$work/bin"
work=$(cd "$work" && pwd)
path=$PATH
unset CXX CMAKE_ARGS SKBUILD_CMAKE_ARGS

fail() {
  echo "sdist.sh: $*" >&2
  exit 1
}
refuses() { # TEXT OPTIONS...
  if PATH=$path "$python" -m pip wheel --disable-pip-version-check --no-deps --no-build-isolation --wheel-dir "$work" "${@:2}" \
    --config-settings=cmake.define.JFPX_CUDA=OFF "$sdist" >"$work/log" 2>&1; then
    fail "a wheel was built with ${*:2}"
  fi
  # pip indents the messages of CMake, which breaks lines.
  tr -s ' \n' ' ' <"$work/log" | grep -qF -- "$1" || fail "no \"$1\" in: $(cat "$work/log")"
}

refuses "nlohmann_json 3.11 or newer was not found. On Debian and Ubuntu: sudo apt install nlohmann-json3-dev. Elsewhere" \
  --config-settings=cmake.define.CMAKE_DISABLE_FIND_PACKAGE_nlohmann_json=ON
refuses "Python 3.10 or newer with its headers was not found. On Debian and Ubuntu: sudo apt install python3-dev" \
  --config-settings=cmake.define.CMAKE_DISABLE_FIND_PACKAGE_Python=ON
for program in cmake ninja; do ln -s "$(command -v $program)" "$work/bin"; done
path=$work/bin
refuses "found on PATH; jfpx needs g++ 12, clang 14 or newer. On Debian and Ubuntu: sudo apt install g++."
echo "sdist.sh: passed"
