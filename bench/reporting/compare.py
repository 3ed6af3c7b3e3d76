"""Comparison of two result files."""


def time_of(benchmark):
    return benchmark.get("real_time")


def by_name(data):
    return {b["name"]: b for b in data.get("benchmarks", []) if time_of(b)}


def compare(before, after, limit):
    """A report, and whether any benchmark is slower by more than `limit`."""
    a, b = by_name(before), by_name(after)
    lines, slower = [], False
    for name in a:
        if name not in b:
            lines.append(f"removed  {name}")
            continue
        if a[name].get("time_unit") != b[name].get("time_unit"):
            lines.append(f"units    {name}: {a[name].get('time_unit')}, {b[name].get('time_unit')}")
            continue
        ratio = time_of(b[name]) / time_of(a[name])
        if ratio > 1 + limit:
            slower = True
            lines.append(f"slower   {name}: {ratio:.2f} times the time")
        elif ratio < 1 / (1 + limit):
            lines.append(f"faster   {name}: {ratio:.2f} times the time")
    lines += [f"new      {name}" for name in b if name not in a]
    if before["context"].get("machine") != after["context"].get("machine"):
        lines.insert(0, "The results are of two machines: "
                     f"{before['context'].get('machine')} and {after['context'].get('machine')}")
    if not lines:
        lines.append(f"no change above {limit:.0%}")
    return "\n".join(lines), slower
