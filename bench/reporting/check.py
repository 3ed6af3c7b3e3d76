"""Checks that the result files which documents cite exist, are valid and state their origin."""
import re

from . import results

NAMED = re.compile(r"bench/results/[\w./-]+\.(?:json|md)")
ORIGIN = ("machine", "date", "command")


def problems(root, documents=()):
    found = []
    folder = root / "bench/results"
    for path in sorted(folder.rglob("*.json")):
        name = path.relative_to(root)
        try:
            data = results.load(path)
        except results.ResultError as error:
            found.append(str(error))
            continue
        context = dict(data["context"])
        if path.parent == folder and path.name != results.THESIS:
            # A page in the same folder documents the origin of these files.
            pages = "".join(p.read_text() for p in folder.glob("*.md") if path.name in p.read_text())
            if not pages:
                found.append(f"{name}: no page in bench/results names it")
            continue
        found += [f"{name}: its context has no {key}" for key in ORIGIN if not context.get(key)]
        if not any(isinstance(value, list) and value for value in data.values()):
            found.append(f"{name}: holds no measurements")
    documents = documents or [root / "README.md", *sorted((root / "docs").glob("*.md"))]
    for document in documents:
        for mention in sorted(set(NAMED.findall(document.read_text()))):
            if not (root / mention).is_file():
                found.append(f"{document.name} names {mention}, which does not exist")
    return found
