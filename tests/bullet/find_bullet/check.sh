#!/usr/bin/env bash
# One precision of Bullet is enough for a build in that precision. Bullet is imitated by pkg-config files.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

module() { # FOLDER NAME VERSION FLAGS
  mkdir -p "$work/$1"
  printf 'Name: %s\nDescription: imitation\nVersion: %s\nCflags: %s\n' "$2" "$3" "$4" >"$work/$1/$2.pc"
}
double=-DBT_USE_DOUBLE_PRECISION
module float bullet 3.24 ""
module double bullet-float64 3.25 $double
module double_alone bullet 3.25 $double
module both bullet 3.24 ""
module both bullet-float64 3.24 $double
module old bullet 3.08 ""
expect() { # FOLDER PRECISIONS RESULT
  rm -rf "$work/build"
  local output
  output=$(PKG_CONFIG_LIBDIR=$work/$1 PKG_CONFIG_PATH='' cmake -S "$here" -B "$work/build" -DPRECISIONS="$2" 2>&1)
  grep -qF -- "-- found: $3" <<<"$output" || {
    echo "find_bullet: $1 for $2: no \"$3\" in: $output" >&2
    exit 1
  }
}
expect float float "ON 3.24"
expect double double "ON 3.25"
expect double_alone double "ON 3.25"
expect both both "ON 3.24"
expect float both "OFF"
expect float double "OFF"
expect double_alone float "OFF"
expect old float "OFF  pkg-config does not find Bullet >= 3.24 (precision: float): install pkg-config and libbullet-dev. It finds 3.08"
