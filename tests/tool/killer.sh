#!/bin/sh
# A jfpx whose comparisons take what waits for them down: as when memory runs out.
[ "$1" = --help ] || kill -KILL "$PPID"
