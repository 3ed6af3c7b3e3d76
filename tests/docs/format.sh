#!/usr/bin/env bash
# Checks that all sources are formatted. Another major version of clang-format formats differently,
# so only 14 judges; its --dry-run reports namespace comments that it would not change, so the
# outputs are compared.
set -u
cd "$(dirname "$0")/../.."
clang_format=$(command -v clang-format-14 || command -v clang-format || true)
if [ -z "$clang_format" ] || ! "$clang_format" --version | grep -q 'version 14\.'; then
  echo "skipped: clang-format 14 is not installed"
  exit 0
fi
mapfile -t files < <(find include src python examples tests bench -name '*.hpp' -o -name '*.cpp' -o -name '*.cu' -o -name '*.cuh' -o -name '*.inl')
# One process for all files takes half the time of one for each; these say which file it is.
"$clang_format" "${files[@]}" | cmp -s - <(cat "${files[@]}") && exit 0
for file in "${files[@]}"; do
  "$clang_format" "$file" | cmp -s - "$file" || echo "not formatted: $file"
done
exit 1
