"""Tests of bench/report.py: storing, computing, comparing and checking of results."""
import contextlib
import io
import json
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "bench"))
import report  # noqa: E402
from reporting import compare, results, tables  # noqa: E402

CONTEXT = {"date": "2026-01-02T03:04:05+00:00", "machine": "a processor", "command": "x_bench"}


def result(**times):
    return {"context": dict(CONTEXT),
            "benchmarks": [{"name": n, "real_time": t, "time_unit": "ms"} for n, t in times.items()]}


class Folder(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def write(self, name, content):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        return path

    def report(self, *arguments):
        """Exit status, stdout, stderr."""
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = report.main([str(a) for a in arguments])
        return status, out.getvalue(), err.getvalue()


class Store(Folder):
    def test_drops_hosts_and_folders_and_keeps_the_rest(self):
        raw = result(a=1.23456789)
        raw["context"].update(host_name="host", executable="/home/me/x_bench", caches=[1], num_cpus=2)
        raw["context"].pop("machine")
        raw["context"].update(cpu="EPYC", cuda="H200")
        raw["benchmarks"][0]["iterations"] = 7
        dest = self.folder / "new/folder/x_float.json"
        self.assertEqual(self.report("store", self.write("raw.json", raw), dest)[0], 0)
        self.assertNotIn("/home", dest.read_text())
        self.assertNotIn("host", dest.read_text())
        stored = results.load(dest)
        self.assertEqual(stored["context"]["machine"], "EPYC, H200")
        self.assertEqual(stored["benchmarks"][0]["real_time"], 1.2346)
        self.assertEqual(stored["benchmarks"][0]["iterations"], 7)

    def test_an_invalid_result_is_rejected_by_name(self):
        for content in ("", "{", "[]", "{}", '{"context": {}}', '{"context": 3, "benchmarks": []}'):
            path = self.write("raw.json", content)
            status, _, err = self.report("store", path, self.folder / "dest.json")
            self.assertEqual(status, 2, content)
            self.assertIn(str(path), err)
        self.assertFalse((self.folder / "dest.json").exists())
        self.assertEqual(self.report("store", self.folder / "none.json", "x")[0], 2)


class Compare(Folder):
    def changes(self, before, after, limit=0.1):
        return compare.compare(before, after, limit)

    def test_lists_changes_of_more_than_a_tenth_only(self):
        before = result(a=100, b=100, c=100, d=100)
        text, slower = self.changes(before, result(a=109, b=111, c=92, d=90))
        self.assertEqual(text, "slower   b: 1.11 times the time\nfaster   d: 0.90 times the time")
        self.assertTrue(slower)
        self.assertEqual(self.changes(before, result(a=109, b=109, c=92, d=95)),
                         ("no change above 10%", False))

    def test_lists_added_and_removed_benchmarks(self):
        text, slower = self.changes(result(a=1, b=1), result(b=1, c=1))
        self.assertEqual(text, "removed  a\nnew      c")
        self.assertFalse(slower)

    def test_does_not_compare_milliseconds_with_microseconds(self):
        other = result(a=1)
        other["benchmarks"][0]["time_unit"] = "us"
        self.assertIn("units", self.changes(result(a=1), other)[0])

    def test_reports_different_machines(self):
        other = result(a=1)
        other["context"]["machine"] = "another"
        self.assertIn("two machines", self.changes(result(a=1), other)[0])

    def test_exit_status_is_one_if_a_benchmark_is_slower(self):
        a, b = self.write("a.json", result(x=1)), self.write("b.json", result(x=2))
        self.assertEqual(self.report("compare", a, b)[0], 1)
        self.assertEqual(self.report("compare", b, a)[0], 0)
        self.assertEqual(self.report("compare", a, b, "--limit", "1.5")[0], 0)
        self.assertEqual(self.report("compare", a, self.write("c.json", "{"))[0], 2)


class Numbers(unittest.TestCase):
    def test_crossover_uses_log_log_interpolation(self):
        # n^2 / 1000 against 10: equal at n = 100.
        rows = [(n, n * n / 1000, 10) for n in (8, 64, 512)]
        self.assertAlmostEqual(tables.crossover(rows), 100, places=6)
        self.assertAlmostEqual(tables.crossover(rows[::-1]), 100, places=6)
        self.assertIsNone(tables.crossover([(1, 1, 2), (2, 1, 2)]))

    def test_crossover_of_the_published_data(self):
        published = results.load(ROOT / "bench/results" / results.THESIS)
        rows = [(r["spheres"], r["cpu_mean_ms"], r["cuda_mean_ms"]) for r in published["rendering_off"]]
        # 54 by log-log interpolation of the published data.
        self.assertEqual(round(tables.crossover(rows)), 54)
        on = [(r["spheres"], r["cpu_mean_ms"], r["cuda_mean_ms"]) for r in published["rendering_on"]]
        self.assertEqual(round(tables.crossover(on)), 60)

    def test_exponent_of_a_square_is_two(self):
        self.assertAlmostEqual(tables.exponent([(n, 3 * n * n) for n in (2, 8, 100)]), 2)
        self.assertIsNone(tables.exponent([(5, 1)]))

    def test_numbers_have_three_digits(self):
        self.assertEqual([tables.number(x) for x in (0, 0.001234, 1.234, 123.4, 12345)],
                         ["0", "0.00123", "1.23", "123", "12345"])


class Page(Folder):
    def machine_folder(self):
        automatic = result()
        automatic["benchmarks"] = [
            {"name": "automatic/gas/448/iterations:1/manual_time", "real_time": 33, "time_unit": "us",
             "contacts": 1300, "ratio": 1.10, "x86_all_pairs_us": 30, "x86_sorted_tiles_us": 45,
             "automatic_us": 33, "label": "x86, all pairs"}]
        self.write("results/box/automatic_float.json", automatic)
        thesis = result()
        thesis["benchmarks"] = [
            {"name": f"thesis/{backend}/{n}/iterations:1000/manual_time", "real_time": t, "time_unit": "ms",
             "iterations": 1000, "first_ms": 1, "median_ms": t, "contacts": 5}
            for backend, n, t in (("x86", 32, 0.5), ("x86", 448, 4), ("cuda", 32, 1), ("cuda", 448, 2))]
        self.write("results/box/thesis_float.json", thesis)
        rendering = result()
        rendering["context"].update(pictures="800 x 600 by a card", version="0.1.0")
        rendering["benchmarks"] = [
            {"name": f"rendering/{mode}/cpu/32/iterations:1000/manual_time", "real_time": t, "time_unit": "ms",
             "iterations": 1000, "first_ms": 2, "median_ms": t, "picture_ms": 7}
            for mode, t in (("off", 0.5), ("on", 0.6))]
        self.write("results/box/rendering_float.json", rendering)
        stages = result()
        stages["context"].update(copied_gb_a_second="2.0", giga_operations_a_second="4.0")
        stages["benchmarks"] = [
            {"name": f"stages/gas/x86/{n}/iterations:9/manual_time", "real_time": 1, "time_unit": "ms",
             "contacts": 5, "allocations": 0, "label": "x86",
             **{f"{stage}_{what}": value for stage in ("integrate", "detect", "resolve")
                for what, value in (("ms", n / 1e3), ("bytes", 2000), ("operations", 40000))}}
            for n in (100, 1000)]
        self.write("results/box/stages_float.json", stages)
        self.write(f"results/{results.THESIS}", (ROOT / "bench/results" / results.THESIS).read_text())
        return self.folder / "results"

    def test_contains_the_numbers_of_the_files_with_the_present_name_of_the_cpu(self):
        out = self.folder / "page.md"
        status, _, err = self.report("tables", "--results", self.machine_folder(), "--out", out)
        self.assertEqual((status, err), (0, ""))
        page = out.read_text()
        self.assertIn("| gas | 448 | 1300 | 1.00 | 1.50 | cpu all pairs | cpu, all pairs | 1.10 |", page)
        self.assertIn("0.220 (1)", page, "the doubtful point is marked")
        self.assertIn("`x_bench`, 2026-01-02", page)
        self.assertIn(", jfpx 0.1.0; data: ", page)
        # 0.5 against 1 at 32, 4 against 2 at 448: ratios 1/2 and 2, so the geometric mean, 120.
        self.assertIn("from N = 120 here", page)
        self.assertIn("800 x 600 by a card", page)
        # Published at 32: 0.2199 (the file of 16) and 0.4747.
        self.assertIn("| cpu | 32 | 0.500 | 0.500 | 2.00 | 0.600 | 0.600 | 2.00 | 1.20 | 7.00 | 0.220 (1) | 0.475 "
                      "| 2.16 (1) |", page)
        self.assertIn("| gas | cpu | 1.00 | 1.00 | 1.00 |", page, "time is proportional to N")
        # 2 kB at 2 GB/s take 1 us, 40 thousand operations at 4 billion per second 10 us, the stage 100 us.
        self.assertIn("| gas | cpu | 100 |" + " 2.00 | 40.0 | 10.0 |" * 3, page)

    def test_plots_are_drawn_and_reproducible(self):
        try:
            import matplotlib  # noqa: F401
        except ImportError:
            self.skipTest("matplotlib is not installed")
        folder = self.machine_folder()
        for name in ("a", "b"):
            self.assertEqual(self.report("plots", "--results", folder, "--out", self.folder / name)[0], 0)
        files = sorted((self.folder / "a").glob("*.svg"))
        self.assertEqual(len(files), 3)
        for path in files:
            self.assertEqual(path.read_bytes(), (self.folder / "b" / path.name).read_bytes())


class Check(Folder):
    def setUp(self):
        super().setUp()
        self.write("bench/results/box/x_float.json", result(a=1))
        self.write("README.md", "see bench/results/box/x_float.json")
        self.write("docs/page.md", "no citation")

    def problems(self):
        status, out, _ = self.report("check", "--root", self.folder)
        return out if status else ""

    def test_finds_no_problem_in_valid_results(self):
        self.assertEqual(self.problems(), "")

    def test_finds_a_citation_without_a_file(self):
        self.write("docs/page.md", "fast: bench/results/gone.md")
        self.assertIn("page.md names bench/results/gone.md", self.problems())

    def test_finds_a_broken_file(self):
        self.write("bench/results/box/y.json", "{")
        self.assertIn("invalid JSON", self.problems())

    def test_finds_a_file_without_its_origin(self):
        for key in ("machine", "date", "command"):
            bad = result(a=1)
            del bad["context"][key]
            self.write("bench/results/box/y.json", bad)
            self.assertIn(f"no {key}", self.problems())

    def test_finds_a_file_without_measurements(self):
        self.write("bench/results/box/y.json", result())
        self.assertIn("no measurements", self.problems())

    def test_finds_a_file_that_no_page_explains(self):
        self.write("bench/results/alone.json", result(a=1))
        self.assertIn("no page", self.problems())
        self.write("bench/results/page.md", "alone.json")
        self.assertEqual(self.problems(), "")


if __name__ == "__main__":
    unittest.main()
