#!/usr/bin/env bash
# What documents say of the rest of the project is so. Every test that they name exists: as
# `Suite.Name`, `Suite.Begins*`, `file_test.cpp` or, in Python, `test_name`. Every link leads somewhere. Every C++ snippet, and
# every line that a diff adds, is in the examples, which are compiled and run. docs/reference has every public name. docs/scenes.md has every
# field of a scene. docs/thesis.md leaves out no row of the census (1 to 224) and no erratum (E1 to E58).
set -u
cd "$(dirname "$0")/../.."
status=0
complain() {
  echo "$1"
  status=1
}

tests=$(
  find tests \( -name '*.cpp' -o -name '*.hpp' -o -name '*.cu' \) -exec cat {} + | tr '\n' ' ' |
    grep -oE 'TEST(_F|_P)?\( *\w+, *\w+ *\)' | sed -E 's/.*\( *(\w+), *(\w+).*/\1.\2/'
  sed -nE 's/^jfpx_add_(install|configure)_test\(\w+ (\w+\.\w+)\)/\2/p' tests/{install,configure}/tests.cmake
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

while read -r name; do
  grep -rqE "^def $name\(" tests/python || complain "no such test: $name"
done < <(grep -rhoE '`test_[a-z0-9_]+`' docs README.md | tr -d '`' | sort -u)

tests/docs/links.sh README.md CHANGELOG.md packaging/README.md docs/*.md docs/reference/*.md bench/results/*.md || status=1

# The reference has every public header and every name of the Python package, once.
diff <(cd include && find jfpx -name '*.hpp' | sort) <(cat docs/reference/cpp_*.md | sed -n 's/^## \(jfpx.*\)/\1/p' | sort) ||
  complain "docs/reference/cpp_*.md (>) do not have the headers of include (<)"
diff <(sed -n '/^__all__/,$p' python/jfpx/__init__.py | grep -oE '"[A-Za-z_]+"' | tr -d '"' | cat - <(sed -nE \
  's/^__all__ = \["(\w+)"\]$/mpi.\1/p' python/jfpx/mpi.py) | sort) \
  <(cat docs/reference/python_*.md | sed -n 's/^\.\. auto[a-z]*:: jfpx\.//p' | sort) ||
  complain "docs/reference/python_*.md (>) do not have the names of the Python package (<)"

# Words with one space between them, so that indentation and line breaks do not matter.
flatten() { tr -s ' \n\t' ' '; }
examples=$(find examples \( -name '*.cpp' -o -name '*.cu' \) -exec cat {} + | flatten)
snippets=0
check_snippet() { # DOCUMENT TEXT
  snippets=$((snippets + 1))
  [[ "$examples" == *"$2"* ]] || complain "$1: not in the examples: $2"
}
for document in README.md docs/*.md docs/reference/*.md; do
  kind=
  snippet=
  while IFS= read -r line; do
    case "$kind$line" in
      '```cpp' | '```diff') kind=${line#\`\`\`} snippet= ;;
      'cpp```') kind= && check_snippet "$document" "$(flatten <<<"$snippet" | sed 's/^ //; s/ $//')" ;;
      'diff```') kind= ;;
      cpp*) snippet+=$line$'\n' ;;
      diff+*) check_snippet "$document" "$(flatten <<<"${line#+}" | sed 's/ $//')" ;;
    esac
  done <"$document"
done
[ "$snippets" -gt 5 ] || complain "only $snippets snippets were found"

# Fields of a scene.
fields=0
while read -r field; do
  fields=$((fields + 1))
  grep -qE "\`([a-z_]+\.)?$field\`" docs/scenes.md || complain "docs/scenes.md: no field $field"
done < <(sed '/RecordingHeader recording_header_from_json/,$d' src/scene/{scene,shape}_fields.hpp src/scene/scene_json.cpp |
  grep -oE '(field|find|required|at)\("[a-z_]+"' | cut -d'"' -f2 | sort -u)
[ "$fields" -gt 45 ] || complain "only $fields fields of scenes were found"

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
