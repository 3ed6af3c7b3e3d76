#!/usr/bin/env bash
# Uses jfpx as those do who install it. Usage: check.sh STEP BUILD WORK; the environment says what the
# build has: KIND (static, shared), HAS_CUDA, HAS_BULLET, HAS_MPI, HAS_VIEWER (ON, OFF), CXX, LAUNCHER (of the
# compiler).
set -euo pipefail
step=$1 build=$2 work=$3
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
prefix=$work/moved # where it was not installed

fail() {
  echo "$*" >&2
  exit 1
}
configure() { # SOURCE FOLDER [ARGS]
  local source=$1 folder=$2
  shift 2
  rm -rf "$folder"
  cmake -S "$source" -B "$folder" -G Ninja --no-warn-unused-cli -DCMAKE_CXX_COMPILER="$CXX" \
    -DCMAKE_CXX_COMPILER_LAUNCHER="${LAUNCHER:-}" -DCMAKE_PREFIX_PATH="$prefix" \
    -DEXAMPLES="$root/examples" -DJFPX="$root" "$@"
}
# The programs of a stranger say what they should: FOLDER SUFFIX_OF_DOUBLE
run_programs() {
  local suffix
  for suffix in "" "$2"; do
    [ "$("$1/collider$suffix")" = "spheres 0 and 1 overlap by 0.5" ] || fail "collider$suffix"
    [ "$("$1/thesis$suffix")" = "a step of worst_first: 1 contact, 1 particle" ] || fail "thesis$suffix"
    [ "$HAS_MPI" = OFF ] || [ "$("$1/ranks$suffix")" = "rank 0 of 1" ] || fail "ranks$suffix"
    [ "$HAS_BULLET" = OFF ] || "$1/bullet_app$suffix" | grep -E '[1-9][0-9]* contacts of spheres' || fail "bullet_app$suffix"
  done
}
components() {
  echo -n "thesis;"
  [ "$HAS_BULLET" = OFF ] || echo -n "bullet;"
  [ "$HAS_MPI" = OFF ] || echo -n "mpi;"
  [ "$HAS_CUDA" = OFF ] || echo -n "cuda;"
}
libraries() { # of the installed tree that match
  find "$prefix" -name "libjfpx$1" -type f
}

case $step in
  # Installs, moves, and looks for traces of where it was built and installed.
  prefix)
    rm -rf "$work"
    mkdir -p "$work"
    cmake --install "$build" --prefix "$work/first" >/dev/null
    mv "$work/first" "$prefix"
    traces=$(grep -rlF -e "$work/first" -e "$build" "$prefix" || true)
    [ -z "$traces" ] || fail "these can't be moved: $traces"
    for header in $(cd "$prefix/include" && find . -name '*.hpp'); do
      [ "$header" = ./jfpx/config.hpp ] || cmp "$root/include/$header" "$prefix/include/$header"
    done
    ;;
  cmake)
    # The CUDA toolkit is not needed, even if jfpx was built with it.
    configure "$here/cmake" "$work/cmake" -DCOMPONENTS="$(components)" -DCMAKE_DISABLE_FIND_PACKAGE_CUDAToolkit=ON >/dev/null
    ! grep -n 'LINK_LIBRARIES = .*/cuda' "$work/cmake/build.ninja" || fail "links libraries of the toolkit"
    cmake --build "$work/cmake" >/dev/null
    run_programs "$work/cmake" _f64
    compiled="not compiled"
    [ "$HAS_CUDA" = OFF ] || compiled=compiled
    [ "$("$work/cmake/both")" = "contacts 1 1
cpu compiled
cuda $compiled
refused" ] || fail "$("$work/cmake/both")"
    # The projects that users copy.
    configure "$root/examples/native_world" "$work/native_world" >/dev/null
    cmake --build "$work/native_world" >/dev/null
    "$work/native_world/native_world" | grep -qx "the lamp has swung twice, with the same bits" || fail "examples/native_world"
    if [ "$HAS_BULLET" = ON ]; then
      configure "$root/examples/bullet_app" "$work/bullet_app" >/dev/null
      cmake --build "$work/bullet_app" >/dev/null
      "$work/bullet_app/bullet_app" | grep -q '[1-9][0-9]* contacts of spheres' || fail "examples/bullet_app"
    fi
    ;;
  pkg_config)
    folder=$(dirname "$(find "$prefix" -name jfpx.pc)")
    mkdir -p "$work/makefile"
    ln -sfn "$root/examples" "$work/makefile/examples" # make knows no path with a space in it
    ln -sfn "$here/cmake" "$work/makefile/sources"
    programs="collider collider-f64 thesis thesis-f64"
    [ "$HAS_MPI" = OFF ] || programs+=" ranks ranks-f64"
    [ "$HAS_BULLET" = OFF ] || programs+=" bullet_app bullet_app-f64"
    export LD_LIBRARY_PATH=${folder%/pkgconfig}
    PKG_CONFIG_PATH=$folder make -B -s -C "$work/makefile" -f "$here/makefile/Makefile" \
      EXAMPLES=examples SOURCES=sources PROGRAMS="$programs" CXX="${LAUNCHER:-} $CXX"
    run_programs "$work/makefile" -f64
    ;;
  # The programs with which Conan tests the package, with the Bullet adapter in float where that is there.
  conan)
    bullet=float
    [ "$HAS_BULLET" = ON ] || bullet=False
    folder=$(dirname "$(find "$prefix" -name jfpx.pc)")
    export PKG_CONFIG_PATH=$folder LD_LIBRARY_PATH=${folder%/pkgconfig}
    configure "$root/packaging/conan/test_package" "$work/conan" -DBULLET=$bullet -DCMAKE_CXX_STANDARD=20 >/dev/null
    cmake --build "$work/conan" >/dev/null
    ctest --test-dir "$work/conan" --no-tests=error --output-on-failure
    ;;
  # A CUDA program; where no device is, it says so.
  cuda)
    [ "$HAS_CUDA" = ON ] || { echo "skipped: built without CUDA"; exit 0; }
    configure "$here/cuda" "$work/cuda" -DCMAKE_CUDA_COMPILER_LAUNCHER="${LAUNCHER:-}" -DCMAKE_CUDA_ARCHITECTURES=90-real >/dev/null
    cmake --build "$work/cuda" >/dev/null
    for program in cuda_stream cuda_stream_f64; do
      "$work/cuda/$program" >"$work/cuda.txt" 2>&1 || grep -q '^cuda_stream: ' "$work/cuda.txt" || fail "$(cat "$work/cuda.txt")"
    done
    ;;
  # A component that is not there, a version that is not this one: the user is told what to do.
  messages)
    expect() { # TEXT ARGS
      local text=$1
      shift
      if configure "$here/cmake" "$work/messages" "$@" >"$work/messages.txt" 2>&1; then fail "accepted: $*"; fi
      tr '\n' ' ' <"$work/messages.txt" | tr -s ' ' | grep -qF "$text" || fail "no \"$text\" in: $(cat "$work/messages.txt")"
    }
    expect 'jfpx has no component "rockets"; it has thesis, bullet, mpi and cuda.' -DCOMPONENTS=rockets
    [ "$HAS_CUDA" = ON ] || expect "This jfpx was built without CUDA" -DCOMPONENTS=cuda
    if [ "$HAS_MPI" = OFF ]; then
      expect "This jfpx was built without MPI" -DCOMPONENTS=mpi
    else
      expect "install libopenmpi-dev" -DCOMPONENTS=mpi -DCMAKE_DISABLE_FIND_PACKAGE_MPI=ON
    fi
    if [ "$HAS_BULLET" = OFF ]; then
      expect "This jfpx was built without Bullet" -DCOMPONENTS=bullet
    else
      PKG_CONFIG_LIBDIR=$work expect "install pkg-config and libbullet-dev" -DCOMPONENTS=bullet
    fi
    version=$(find "$prefix" -name jfpx-config-version.cmake)
    for other in 0.1 1.0; do
      echo "set(PACKAGE_FIND_VERSION $other) set(PACKAGE_FIND_VERSION_MAJOR ${other%.*}) set(PACKAGE_FIND_VERSION_MINOR ${other#*.})
        include($version) if(PACKAGE_VERSION_COMPATIBLE) message(FATAL_ERROR compatible) endif()" | tr ' ' '\n' >"$work/version.cmake"
      cmake -P "$work/version.cmake" || fail "version $other is accepted"
    done
    ;;
  # A program that is compiled with other headers, or with switches that change types, does not link.
  mismatch)
    folder=$(dirname "$(find "$prefix" -name jfpx.pc)")
    export PKG_CONFIG_PATH=$folder LD_LIBRARY_PATH=${folder%/pkgconfig}
    refused() { # TEXT FLAGS
      local text=$1
      shift
      # shellcheck disable=SC2046  # words are what is wanted
      if $CXX -std=c++20 "$@" $(pkg-config --cflags jfpx) "$root/examples/collider/collider.cpp" -o "$work/mismatch" \
        $(pkg-config --libs jfpx) 2>"$work/mismatch.txt"; then fail "links: $*"; fi
      grep -q "undefined reference to .*$text" "$work/mismatch.txt" || fail "$*: $(cat "$work/mismatch.txt")"
    }
    mkdir -p "$work/newer/jfpx"
    sed -E 's/^#define JFPX_ABI v[0-9]+_[0-9]+_/#define JFPX_ABI v0_99_/' "$prefix/include/jfpx/config.hpp" >"$work/newer/jfpx/config.hpp"
    refused "jfpx::v0_99_f32::make_sphere_collider" -I"$work/newer"
    refused "LibraryUsesSameCompilerSwitches" -D_GLIBCXX_DEBUG
    ;;
  # Each link of an installed document leads to an installed file, also where nothing but the documents is.
  documents)
    rm -rf "$work/documents"
    cmake --install "$build" --component doc --prefix "$work/documents" >/dev/null
    folder=$(dirname "$(find "$work/documents" -name README.md -path '*/jfpx/README.md')")
    [ -s "$folder/docs/world.md" ] && [ -s "$folder/LICENSE" ] || fail "documents are missing in $work/documents"
    find "$folder" -path "$folder/html" -prune -o -name '*.md' -print0 | xargs -0 "$root/tests/docs/links.sh"
    ;;
  # Shared libraries export what is jfpx's, and need nothing of CUDA. Static ones become shared to see.
  symbols)
    if [ "$KIND" = static ]; then
      folder=$(dirname "$(find "$prefix" -name jfpx.pc)")
      for name in jfpx jfpx-f64 jfpx-thesis jfpx-thesis-f64; do
        # shellcheck disable=SC2046  # words are what is wanted
        $CXX -shared -o "$prefix/lib$name.so.probe" -Wl,--no-undefined "-Wl,--version-script=$root/cmake/exports.map" \
          -Wl,--whole-archive "${folder%/pkgconfig}/lib$name.a" -Wl,--no-whole-archive \
          $(PKG_CONFIG_PATH=$folder pkg-config --libs "$name")
      done
    fi
    checked=0
    while read -r library; do
      symbols=$(nm -DC --defined-only "$library" | cut -d' ' -f3-)
      grep -qE '::(World::step|thesis::enable|mpi::Communicator::gather|bullet::CollisionDispatcher::dispatchAllCollisionPairs)\(' <<<"$symbols" || fail "$library exports: $symbols"
      foreign=$(grep -vE '^((vtable|typeinfo|typeinfo name) for |(non-virtual|virtual) thunk to )?jfpx::v[0-9]+_[0-9]+_f(32|64)::' <<<"$symbols" || true)
      [ -z "$foreign" ] || fail "$library exports: $foreign"
      ! objdump -p "$library" | grep -E 'NEEDED.*(cuda|cudart)' || fail "$library needs CUDA"
      checked=$((checked + 1))
    done < <(libraries '*.so.*')
    [ "$checked" -ge 2 ] || fail "only $checked libraries were found"
    while read -r module; do
      symbols=$(nm -DC --defined-only "$module" | cut -d' ' -f3-)
      ! grep -E '^(cuda|__cuda|nvtx|std::|jfpx::)' <<<"$symbols" || fail "$module exports more than it should"
      # The dynamic linker binds a unique symbol once for all libraries of a process.
      [ -z "$(nm -D --defined-only "$module" | awk '$2 == "u"')" ] || fail "$module exports unique symbols"
    done < <(libraries '-bullet-preload.so' && libraries '-bullet-engine*.so')
    rm -f "$prefix"/*.probe
    ;;
  # jfpx inside another project, by FetchContent.
  subproject)
    # The other project may compile sources together, which is also faster.
    configure "$here/subproject" "$work/subproject" -DJFPX_CUDA=OFF -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=16 >"$work/subproject.txt"
    grep -qF "(static, not optimized: CMAKE_BUILD_TYPE is empty, " "$work/subproject.txt" || fail "$(cat "$work/subproject.txt")"
    cmake --build "$work/subproject" >/dev/null 2>&1
    "$work/subproject/careless" || fail "careless"
    unasked=$(find "$work/subproject" -name 'libjfpx-*') # double, Bullet, the module to preload
    [ -z "$unasked" ] || fail "builds what nobody links: $unasked"
    rm -rf "$work/nothing"
    cmake --install "$work/subproject" --prefix "$work/nothing" >/dev/null
    [ ! -e "$work/nothing" ] || fail "installs: $(find "$work/nothing")"
    configure "$here/subproject" "$work/subproject" -DJFPX_CUDA=OFF -DJFPX_INSTALL=ON >/dev/null
    [ ! -e "$work/subproject/CPackConfig.cmake" ] || fail "makes packages of its owner"
    ;;
  # The Debian packages, unpacked where nothing else is.
  debian)
    command -v dpkg-deb >/dev/null && command -v dpkg-shlibdeps >/dev/null || { echo "skipped: no dpkg-dev"; exit 0; }
    [ "$KIND" = shared ] || { echo "skipped: packages are made of shared builds"; exit 0; }
    rm -rf "$work/packages" "$work/root"
    cpack --config "$build/CPackConfig.cmake" -B "$work/packages" >"$work/cpack.txt" 2>&1 || fail "$(cat "$work/cpack.txt")"
    for package in "$work"/packages/*.deb; do dpkg -x "$package" "$work/root"; done
    depends() { dpkg-deb -f "$work"/packages/"$1"_*.deb "${2:-Depends}"; }
    depends libjfpx0.3 | grep -q 'libstdc++6' || fail "libjfpx0.3 depends on: $(depends libjfpx0.3)"
    depends libjfpx-dev | grep -q 'libjfpx0.3 (= ' || fail "libjfpx-dev depends on: $(depends libjfpx-dev)"
    depends jfpx-tools | grep -q 'libjfpx0.3 (= ' || fail "jfpx-tools depends on: $(depends jfpx-tools)"
    depends libjfpx-thesis0.3 | grep -q 'libjfpx0.3 (= ' || fail "libjfpx-thesis0.3 depends on: $(depends libjfpx-thesis0.3)"
    depends jfpx-tools | grep -q 'libjfpx-thesis0.3 (= ' || fail "jfpx-tools depends on: $(depends jfpx-tools)"
    if [ "$HAS_MPI" = ON ]; then
      depends libjfpx-mpi0.3 | grep -q 'libjfpx0.3 (= ' || fail "libjfpx-mpi0.3 depends on: $(depends libjfpx-mpi0.3)"
      depends jfpx-tools | grep -q 'libjfpx-mpi0.3 (= ' || fail "jfpx-tools depends on: $(depends jfpx-tools)"
      ! depends libjfpx0.3 | grep -q mpi || fail "libjfpx0.3 depends on MPI"
    fi
    if [ "$HAS_VIEWER" = ON ]; then
      depends jfpx-tools | grep -q libsdl2 || fail "jfpx-tools depends on: $(depends jfpx-tools)"
      depends jfpx-tools Recommends | grep -qx 'libegl1, libgl1, libgl1-mesa-dri' ||
        fail "jfpx-tools recommends: $(depends jfpx-tools Recommends)"
    fi
    if [ "$HAS_BULLET" = ON ]; then
      depends libjfpx-bullet0.3 | grep -q 'libbullet3' || fail "libjfpx-bullet0.3 depends on: $(depends libjfpx-bullet0.3)"
      depends libjfpx-dev | grep -q 'libbullet-dev, pkg-config' || fail "libjfpx-dev depends on: $(depends libjfpx-dev)"
      ! depends libjfpx0.3 | grep -q bullet || fail "libjfpx0.3 depends on Bullet"
    fi
    [ -s "$work/root/usr/share/doc/libjfpx0.3/copyright" ] || fail "no copyright"
    [ -s "$work/root/usr/share/doc/jfpx/docs/world.md" ] || fail "no documents"
    [ "$(depends jfpx-doc Architecture)" = all ] || fail "jfpx-doc is for $(depends jfpx-doc Architecture)"
    ! dpkg-deb -c "$work"/packages/libjfpx-dev_*.deb | grep -q README || fail "libjfpx-dev has documents"
    prefix=$work/root/usr
    "$prefix/bin/jfpx" run pile --spheres 64 --steps 10 --precision double --hash | grep -E '^[0-9a-f]{16}$' || fail "jfpx run"
    if [ "$HAS_BULLET" = ON ]; then
      "$prefix/bin/jfpx" preload --summary -- "$prefix/bin/jfpx" compare pile --spheres 64 --steps 10 >"$work/preload.txt" 2>&1 ||
        fail "$(cat "$work/preload.txt")"
      grep -q 'Bullet in float: [1-9][0-9]* dispatches' "$work/preload.txt" || fail "$(cat "$work/preload.txt")"
    fi
    configure "$here/cmake" "$work/debian" >/dev/null
    cmake --build "$work/debian" --target collider >/dev/null
    "$work/debian/collider"
    ;;
  *) fail "unknown step $step" ;;
esac
