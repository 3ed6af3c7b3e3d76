"""Result files: reading, cleaning, finding."""
import json
import pathlib

THESIS = "thesis_2010.json"
# Of the context that Google Benchmark writes; names of hosts, people and folders stay out.
KEPT_CONTEXT = ("date", "machine", "x86", "cuda", "num_cpus", "load_avg", "precision", "version",
                "command", "costs", "pictures", "copied_gb_a_second", "giga_operations_a_second")
DROPPED_FIELDS = ("family_index", "per_family_instance_index", "run_name", "run_type", "repetitions",
                  "repetition_index", "threads")


class ResultError(Exception):
    """A result file can't be read or used; the message names it."""


def load(path):
    path = pathlib.Path(path)
    try:
        data = json.loads(path.read_text())
    except OSError as error:
        raise ResultError(f"{path}: {error.strerror}") from error
    except ValueError as error:
        raise ResultError(f"{path}: is no JSON: {error}") from error
    if not isinstance(data, dict) or not isinstance(data.get("context"), dict):
        raise ResultError(f"{path}: has no context")
    return data


def machine_of(context):
    """Processor and GPU, as the program saw them."""
    return ", ".join(str(context[key]) for key in ("x86", "cuda") if context.get(key))


def store(raw, dest):
    data = load(raw)
    if not isinstance(data.get("benchmarks"), list):
        raise ResultError(f"{raw}: has no benchmarks")
    context = {key: data["context"][key] for key in KEPT_CONTEXT if key in data["context"]}
    context.setdefault("machine", machine_of(context))
    if "load_avg" in context:
        context["load_avg"] = context["load_avg"][0]
    benchmarks = [{key: value for key, value in b.items() if key not in DROPPED_FIELDS}
                  for b in data["benchmarks"]]
    dest = pathlib.Path(dest)
    dest.parent.mkdir(parents=True, exist_ok=True)
    lines = ",\n    ".join(json.dumps(rounded(b)) for b in benchmarks)
    head = json.dumps(context, indent=4).replace("\n}", "\n  }")
    dest.write_text(f'{{\n  "context": {head},\n  "benchmarks": [\n    {lines}\n  ]\n}}\n')


def rounded(benchmark):
    """Five digits: more than any of them is worth."""
    return {key: float(f"{value:.5g}") if isinstance(value, float) else value
            for key, value in benchmark.items()}


class Machine:
    """All results of one machine."""

    def __init__(self, name, files):
        self.name = name
        self.files = files  # by name without .json

    def get(self, bench, precision="float"):
        """Benchmarks of a file as {name: values}; empty if there is none."""
        data = self.files.get(f"{bench}_{precision}")
        if data is None:
            return {}
        return {b["name"].split("/iterations:")[0].removesuffix("/manual_time"): b
                for b in data["benchmarks"] if not b.get("error_occurred")}

    def context(self, bench, precision="float"):
        data = self.files.get(f"{bench}_{precision}")
        return data["context"] if data else {}


def machines(folder):
    """The machines under `folder`, each a folder of result files, and the thesis' own data."""
    found = []
    for sub in sorted(p for p in pathlib.Path(folder).iterdir() if p.is_dir()):
        files = {f.stem: load(f) for f in sorted(sub.glob("*.json"))}
        files = {name: data for name, data in files.items() if "benchmarks" in data}
        if files:
            found.append(Machine(sub.name, files))
    return found, load(pathlib.Path(folder) / THESIS)
