#!/usr/bin/env bash
# The sample of jfpx compare in docs/command.md has the hashes and contacts that the command prints.
set -euo pipefail
jfpx=$1
cd "$(dirname "$0")/../.."

results() { sed -nE 's/^ *(native|stock Bullet|Bullet with jfpx) +([0-9a-f]{16}) +([0-9]+) .*/\1: \2, \3 contacts/p'; }
read -ra arguments < <(sed -nE 's/.*`jfpx (compare [^`]+)`.*/\1/p' docs/command.md)
diff <(results <docs/command.md) <("$jfpx" "${arguments[@]}" | results) ||
  { echo "docs/command.md (<) does not have the results of jfpx ${arguments[*]} (>)"; exit 1; }
[ "$(results <docs/command.md | wc -l)" = 3 ] || { echo "docs/command.md has no sample of three engines"; exit 1; }
