#!/usr/bin/env bash
# The relative links of Markdown documents lead to existing files and folders. Usage: links.sh DOCUMENT...
# Addresses of the web and what follows "#" are left out.
set -u
status=0
links=0
for document in "$@"; do
  folder=$(dirname "$document")
  while read -r target; do
    links=$((links + 1))
    [ -e "$folder/$target" ] || { echo "$document: no such file: $target"; status=1; }
  done < <(grep -oE '\]\([^)#:]+' "$document" | sed 's/](//')
done
[ "$links" -gt 0 ] || { echo "no links were found"; status=1; }
exit $status
