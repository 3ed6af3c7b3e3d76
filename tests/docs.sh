#!/usr/bin/env bash
# Every test that a document names (as `Suite.Name`) exists.
set -u
cd "$(dirname "$0")/.."
status=0
while IFS=. read -r suite name; do
  grep -rqE "TEST(_F|_P)?\($suite, *$name\)|NAME $suite\.$name" tests --include='*.cpp' --include='*.cu' --include='*.cmake' --include='CMakeLists.txt' -z ||
    { echo "no such test: $suite.$name"; status=1; }
done < <(grep -rhoE '`[A-Z][A-Za-z0-9]+\.[A-Z][A-Za-z0-9_]+`' docs README.md | tr -d '`' | sort -u | grep -vE '\.(hpp|cpp|md|txt)$')
exit $status
