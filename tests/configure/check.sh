#!/usr/bin/env bash
# Configures jfpx as somebody may. Usage: check.sh STEP WORK; CXX is the compiler.
set -euo pipefail
step=$1 work=$2/$1
root=$(cd "$(dirname "$0")/../.." && pwd)
rm -rf "$work"
mkdir -p "$work"

fail() {
  echo "$*" >&2
  exit 1
}
configure() { # ARGS
  cmake -B "$work/build" -G Ninja -DCMAKE_CXX_COMPILER="$CXX" -DJFPX_BULLET=OFF -DJFPX_MPI=OFF "$@" >"$work/log" 2>&1
}
# Line breaks of CMake's messages do not matter.
said() { tr '\n' ' ' <"$work/log" | tr -s ' ' | grep -qF -- "$1"; }
accepts() { configure "$@" || fail "refused: $*: $(cat "$work/log")"; }
refuses() { # TEXT ARGS
  if configure "${@:2}"; then fail "accepted: ${*:2}"; fi
  said "$1" || fail "no \"$1\" in: $(cat "$work/log")"
}

case $step in
  # A checkout whose path means something to regular expressions.
  signs)
    mkdir "$work/c++"
    ln -s "$root" "$work/c++/jfpx"
    accepts -S "$work/c++/jfpx" -DJFPX_CUDA=OFF -DJFPX_VIEWER=OFF -DJFPX_TESTS=OFF
    ;;
  no_tool)
    accepts -S "$root" -DJFPX_CUDA=OFF -DJFPX_TOOL=OFF -DJFPX_TESTS=ON
    said "viewer off (JFPX_TOOL=OFF," || fail "the summary says nothing of the viewer: $(cat "$work/log")"
    refuses "JFPX_TOOL=OFF, which turns all programs off" -S "$root" -DJFPX_VIEWER=ON -DJFPX_TOOL=OFF
    refuses "JFPX_TOOL=OFF, which turns all programs off" -S "$root" -DJFPX_ASSIMP=ON -DJFPX_TOOL=OFF
    ;;
  absolute)
    for folder in BINDIR LIBDIR INCLUDEDIR; do
      refuses "CMAKE_INSTALL_$folder is \"/usr/x\"; it must be relative" \
        -S "$root" -DJFPX_CUDA=OFF -DCMAKE_INSTALL_$folder=/usr/x -DJFPX_VIEWER=OFF
      rm -r "$work/build"
    done
    ;;
  # -m32 does not change the name of the processor. Nothing is linked, because few machines have libraries of 32 bits.
  bits)
    "$CXX" -m32 -c -x c++ /dev/null -o "$work/empty.o" 2>/dev/null ||
      { echo "skipped: $CXX does not compile for 32 bits"; exit 0; }
    refuses "The compiler builds programs of 32 bits" -S "$root" -DJFPX_CUDA=OFF -DJFPX_VIEWER=OFF \
      -DCMAKE_CXX_FLAGS=-m32 -DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY
    ;;
  # An nvcc that does not know our architectures, or is none, is left out before CMake tries it.
  cuda)
    printf '#!/bin/sh\necho "Cuda compilation tools, release 11.5, V11.5.119"\n' >"$work/old"
    printf '#!/bin/sh\nexit 1\n' >"$work/broken"
    chmod +x "$work/old" "$work/broken"
    accepts -S "$root" -DCMAKE_CUDA_COMPILER="$work/old" -DJFPX_VIEWER=OFF -DJFPX_TESTS=OFF
    said "cuda off (nvcc is 11.5" || fail "the old nvcc is not named: $(cat "$work/log")"
    refuses "broken is not nvcc" -S "$root" -DCMAKE_CUDA_COMPILER="$work/broken" -DJFPX_CUDA=ON
    # What was not found is looked for again.
    for once in first second; do
      CUDACXX=$work/broken accepts -S "$root" -DJFPX_CUDA=AUTO
      said "Looking for a CUDA compiler" || fail "not the $once time: $(cat "$work/log")"
      said "cuda off ($work/broken is not nvcc)" || fail "$(cat "$work/log")"
    done
    rm -r "$work/build"
    printf '#!/bin/sh\n[ "$1" = --version ] && echo "Cuda compilation tools, release 12.8, V12.8.1"\n' >"$work/new"
    chmod +x "$work/new"
    CUDACXX=$work/new accepts -S "$root" -DJFPX_VIEWER=OFF
    log=$(sed -nE 's/.*new does not compile: see (CMakeFiles[^)]*)\)$/\1/p' "$work/log")
    [ -s "$work/build/$log" ] || fail "no such log: \"$log\"; $(cat "$work/log")"
    CUDACXX=$work/none accepts -S "$root" -DJFPX_VIEWER=OFF
    said "cuda off (nvcc was not found)" || fail "$(cat "$work/log")"
    ;;
  # What is missing is named, with its package.
  missing)
    common=(-S "$root" -DJFPX_CUDA=OFF -DJFPX_VIEWER=OFF -DJFPX_BENCH=ON)
    while read -r name packages; do
      refuses "$name" "${common[@]}" -DCMAKE_DISABLE_FIND_PACKAGE_"${name%% *}"=ON
      said "or newer was not found" && said "sudo apt install $packages, or scripts/setup" ||
        fail "the package of $name is not named: $(cat "$work/log")"
      rm -r "$work/build"
    done <<'END'
nlohmann_json nlohmann-json3-dev
CLI11 libcli11-dev
fmt libfmt-dev
GTest libgtest-dev libgmock-dev
benchmark libbenchmark-dev
END
    refuses "JFPX_MPI=ON, but MPI 3.0 or newer was not found" "${common[@]}" -DJFPX_MPI=ON -DCMAKE_DISABLE_FIND_PACKAGE_MPI=ON
    said "sudo apt install libopenmpi-dev openmpi-bin, or scripts/setup" || fail "$(cat "$work/log")"
    rm -r "$work/build"
    printf '#!/bin/sh\nexec g++ -w -U__GNUC__ -D__GNUC__=11 "$@"\n' >"$work/g++-11"
    chmod +x "$work/g++-11"
    CXX=$work/g++-11 refuses "is GNU 11" "${common[@]}"
    said "jfpx needs g++ 12, clang 14 or newer. On Debian and Ubuntu: sudo apt install g++-12" || fail "$(cat "$work/log")"
    rm -r "$work/build"
    mkdir "$work/bin"
    ln -s "$(command -v cmake)" "$(command -v ninja)" "$work/bin"
    unset CXX
    if PATH=$work/bin cmake -B "$work/build" -G Ninja "${common[@]}" >"$work/log" 2>&1; then
      fail "accepted: no compiler"
    fi
    said "No C++ compiler was found on PATH" && said "sudo apt install g++." || fail "$(cat "$work/log")"
    if CXX="no-such-g++ -m64" cmake -B "$work/build" -G Ninja "${common[@]}" >"$work/log" 2>&1; then
      fail "accepted: a compiler that is missing"
    fi
    said 'The C++ compiler "no-such-g++ -m64", which CXX names, was not found on PATH' && said "sudo apt install g++." ||
      fail "$(cat "$work/log")"
    ;;
  # pip compiles for the GPUs of the machine, where nvcc supports them.
  gpu)
    command -v nvcc >/dev/null || { echo "skipped: there is no nvcc"; exit 0; }
    unset CUDAARCHS # which scripts/test sets
    while read -r expected capabilities; do
      printf '#!/bin/sh\nprintf "%s"\n' "$capabilities" >"$work/nvidia-smi"
      chmod +x "$work/nvidia-smi"
      PATH=$work:$PATH accepts -S "$root" -DSKBUILD=2 -DJFPX_CUDA=ON -DJFPX_VIEWER=OFF -DJFPX_TESTS=OFF
      said "architectures $(tr _ ' ' <<<"$expected"), minutes less" || fail "no $expected in: $(cat "$work/log")"
      rm -r "$work/build"
    done <<'END'
89-real 8.9\n
75-real,_90-real 7.5\n9.0\n9.0\n
75-virtual,_90 7.0\n
75-virtual,_90 9.0\n99.9\n
75-virtual,_90 no device
END
    ;;
  # One precision compiles nothing of the other.
  precisions)
    list() { ninja -C "$work/build" -t commands all | grep -oE ' -o [^ ]+[.]dir/[^ ]+[.]o ' >"$work/objects"; }
    accepts -S "$root" -DJFPX_CUDA=OFF -DJFPX_VIEWER=OFF -DJFPX_PRECISIONS=float
    list
    grep -q 'jfpx.dir' "$work/objects" || fail "float compiles nothing"
    ! grep '_f64.dir' "$work/objects" || fail "float compiles double"
    accepts -S "$root" -DJFPX_CUDA=OFF -DJFPX_VIEWER=OFF -DJFPX_PRECISIONS=double
    list
    grep -q 'jfpx_f64.dir' "$work/objects" || fail "double compiles nothing"
    ! grep -E '(jfpx|_tool|_test|_scenes)[.]dir' "$work/objects" || fail "double compiles float"
    refuses "it takes float, double or both" -S "$root" -DJFPX_PRECISIONS=half
    ;;
  # What a build folder was once configured with does not decide what a preset builds there.
  presets)
    presets=$(sed -n '/"name": "base", "hidden": true, "generator"/,/}},/p' "$root/CMakePresets.json")
    switches=$(sed -nE 's/^(option\(|set\()(JFPX_[A-Z]+) ("|(AUTO|OFF|both) CACHE).*/\2/p' "$root/cmake/JfpxOptions.cmake" | grep -v SUMMARY)
    [ "$(wc -w <<<"$switches")" -ge 11 ] || fail "only $switches were found"
    for switch in $switches; do
      grep -qF "\"$switch\": " <<<"$presets" || fail "the preset base does not set $switch"
    done
    ;;
  *) fail "unknown step $step" ;;
esac
