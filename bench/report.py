#!/usr/bin/env python3
"""Generates tables and plots from benchmark results; compares and checks results.

    report.py store RAW.json DEST.json   store a result without names of users, hosts and folders
    report.py tables [--out FILE]        generate build/benchmarks.md from all machines in bench/results
    report.py plots [--out FOLDER]       draw the figures of the thesis; requires matplotlib
    report.py compare A.json B.json      list changes of more than 10 %; status 1 if any is slower
    report.py check [DOCUMENT...]        check all results, and that each result cited in a document exists

Exit status: 0 success, 1 a check failed, 2 invalid usage or input.
"""
import argparse
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from reporting import check, compare, results, tables  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent


def parse(arguments):
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    store = commands.add_parser("store")
    store.add_argument("raw", type=pathlib.Path)
    store.add_argument("dest", type=pathlib.Path)
    for name, out in (("tables", "build/benchmarks.md"), ("plots", "docs/images")):
        command = commands.add_parser(name)
        command.add_argument("--results", type=pathlib.Path, default=ROOT / "bench/results")
        command.add_argument("--out", type=pathlib.Path, default=ROOT / out)
    comparison = commands.add_parser("compare")
    comparison.add_argument("before", type=pathlib.Path)
    comparison.add_argument("after", type=pathlib.Path)
    comparison.add_argument("--limit", type=float, default=0.1, help="smallest relative change to report [0.1]")
    checker = commands.add_parser("check")
    checker.add_argument("documents", type=pathlib.Path, nargs="*")
    checker.add_argument("--root", type=pathlib.Path, default=ROOT)
    return parser.parse_args(arguments)


def run(options):
    if options.command == "store":
        results.store(options.raw, options.dest)
    elif options.command == "tables":
        options.out.write_text(tables.document(results.machines(options.results)))
    elif options.command == "plots":
        from reporting import plots  # the only part that requires matplotlib
        plots.draw(results.machines(options.results), options.out)
    elif options.command == "compare":
        text, slower = compare.compare(results.load(options.before), results.load(options.after),
                                       options.limit)
        print(text)
        return 1 if slower else 0
    elif options.command == "check":
        problems = check.problems(options.root, options.documents)
        print("\n".join(problems) if problems else "all results are valid")
        return 1 if problems else 0
    return 0


def main(arguments=None):
    options = parse(arguments)
    try:
        return run(options)
    except results.ResultError as error:
        print(f"report.py: {error}", file=sys.stderr)
    except ImportError as error:
        print(f"report.py: {error}; on Debian: apt-get install python3-matplotlib", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
