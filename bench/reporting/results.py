"""Reading, cleaning and finding of result files."""
import json
import pathlib
import re

THESIS = "thesis_2010.json"
# Stored fields of the context of Google Benchmark, without names of hosts, users and folders.
KEPT_CONTEXT = ("date", "machine", "cpu", "cuda", "num_cpus", "load_avg", "precision", "version",
                "command", "costs", "pictures", "copied_gb_a_second", "giga_operations_a_second")
DROPPED_FIELDS = ("family_index", "per_family_instance_index", "run_name", "run_type", "repetitions",
                  "repetition_index", "threads")


class ResultError(Exception):
    """A result file can't be read or used. The message contains its name."""


# Results of version 0.1 call the backend "cpu" "x86": in keys, in names of benchmarks and in labels.
OLD_CPU = re.compile(r"(^|/)x86(?=$|[/_,])")


def with_present_names(data):
    """The data with "cpu" instead of "x86" as the name of the backend."""
    if isinstance(data, list):
        return [with_present_names(value) for value in data]
    if not isinstance(data, dict):
        return data
    return {OLD_CPU.sub(r"\1cpu", key):
            OLD_CPU.sub(r"\1cpu", value) if key in ("name", "label") and isinstance(value, str)
            else with_present_names(value) for key, value in data.items()}


def load(path):
    """The content of a result file, with the present name of the CPU backend."""
    path = pathlib.Path(path)
    try:
        data = json.loads(path.read_text())
    except OSError as error:
        raise ResultError(f"{path}: {error.strerror}") from error
    except ValueError as error:
        raise ResultError(f"{path}: invalid JSON: {error}") from error
    if not isinstance(data, dict) or not isinstance(data.get("context"), dict):
        raise ResultError(f"{path}: has no context")
    return with_present_names(data)


def machine_of(context):
    """Names of the processor and the GPU."""
    return ", ".join(str(context[key]) for key in ("cpu", "cuda") if context.get(key))


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
    """Numbers rounded to five digits, which exceeds their accuracy."""
    return {key: float(f"{value:.5g}") if isinstance(value, float) else value
            for key, value in benchmark.items()}


class Machine:
    """The results of one machine."""

    def __init__(self, name, files):
        self.name = name
        self.files = files  # by file name without .json

    def get(self, bench, precision="float"):
        """The benchmarks of a file as {name: values}; empty if the file does not exist."""
        data = self.files.get(f"{bench}_{precision}")
        if data is None:
            return {}
        return {b["name"].split("/iterations:")[0].removesuffix("/manual_time"): b
                for b in data["benchmarks"] if not b.get("error_occurred")}

    def context(self, bench, precision="float"):
        data = self.files.get(f"{bench}_{precision}")
        return data["context"] if data else {}


def machines(folder):
    """The machines in `folder`, one folder of result files each, and the published data of the thesis."""
    found = []
    for sub in sorted(p for p in pathlib.Path(folder).iterdir() if p.is_dir()):
        files = {f.stem: load(f) for f in sorted(sub.glob("*.json"))}
        files = {name: data for name, data in files.items() if "benchmarks" in data}
        if files:
            found.append(Machine(sub.name, files))
    return found, load(pathlib.Path(folder) / THESIS)
