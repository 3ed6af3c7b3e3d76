#!/usr/bin/env bash
# The documentation site builds without a warning: all links and anchors lead somewhere, and Sphinx reads all comments.
# Its search has guides, C++ and Python.
set -euo pipefail
cd "$(dirname "$0")/../.."
command -v doxygen >/dev/null && [ -e build/docs/venv/installed ] ||
  { echo "skipped: Doxygen or Sphinx is missing (scripts/setup docs)"; exit 0; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() {
  echo "$*" >&2
  exit 1
}

scripts/docs --no-setup --output "$work" >/dev/null
[ -s "$work/html/index.html" ] || fail "no first page"
names=$(build/docs/venv/bin/python -m sphinx.ext.intersphinx "$work/html/objects.inv")
for name in jfpx.World.step jfpx.find_neighbors jfpx::World::step jfpx::cuda::DeviceStates jfpx::bullet::CollisionDispatcher; do
  grep -qwF "$name" <<<"$names" || fail "the search does not find $name"
done
grep -qF '"Native worlds"' "$work/html/searchindex.js" || fail "the search does not find the guide of worlds"
! grep -rlF "$PWD" "$work/html" || fail "these contain the folder of the sources"
