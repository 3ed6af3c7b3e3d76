#!/usr/bin/env bash
# Every test that a document names exists: as `Suite.Name`, `Suite.Begins*` or `file_test.cpp`. And
# docs/thesis.md leaves out no row of the census (1 to 224) and no erratum (E1 to E58).
set -u
cd "$(dirname "$0")/.."
status=0
complain() {
  echo "$1"
  status=1
}

tests=$(
  find tests \( -name '*.cpp' -o -name '*.hpp' -o -name '*.cu' \) -exec cat {} + | tr '\n' ' ' |
    grep -oE 'TEST(_F|_P)?\( *\w+, *\w+ *\)' | sed -E 's/.*\( *(\w+), *(\w+).*/\1.\2/'
  sed -nE 's/^ *jfpx_add_fuzzer\((\w+).*/Fuzz.\1/p' tests/fuzz/tests.cmake
  grep -rhoE 'NAME [A-Z]\w+(\.\w+)?' tests --include='*.cmake' --include=CMakeLists.txt | cut -d' ' -f2
)
while read -r name; do
  grep -qE "^${name//\*/.*}$" <<<"$tests" || complain "no such test: $name"
done < <(grep -rhoE '`[A-Z][A-Za-z0-9]+\.[A-Z*][A-Za-z0-9_]*\*?`' docs README.md | tr -d '`' | sort -u |
  grep -vE '\.(hpp|cpp|md|txt)$')
while read -r file; do
  [ -n "$(find tests -name "$file")" ] || complain "no such file of tests: $file"
done < <(grep -rhoE '`[a-z0-9_]+_test\.cpp`' docs README.md | tr -d '`' | sort -u)

# Lists like "1, 4-7", one number a line.
expand() {
  tr ',' '\n' | tr -d ' ' | while IFS=- read -r first last; do seq "$first" "${last:-$first}"; done
}
rows=$(grep -oE '\[[0-9][0-9, -]*\]' docs/thesis.md | tr -d '[]' | expand)
for number in $(seq 224); do
  grep -qx "$number" <<<"$rows" || complain "docs/thesis.md: no census row $number"
done
errata=$(grep -oE '^\| E[0-9]+[-,E0-9 ]*' docs/thesis.md | sed -E 's/^\| //; s/ [^E]*$//; s/E//g' | expand)
for number in $(seq 58); do
  grep -qx "$number" <<<"$errata" || complain "docs/thesis.md: no erratum E$number"
done
exit $status
