"""Searches under hostile conditions: spaces of few designs, damaged files of a search's folder, odd names of files, and signals."""

import contextlib
import io
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from sensel_sweep import main as sensel_sweep

# Three designs. Four points and a guess start the search, so that some of them must be equal.
SEARCH = """
scenario = "box"
constraints = ["power_mw < 1000"]
[set]
"run.frames" = 2
"run.samples_per_pixel" = 1
"sensor.width" = 96
"sensor.height" = 72
"run.render_quantum_efficiency" = 0.5
"run.render_full_well_e" = 9000.0
[[factor]]
name = "bits"
key = "sensor.adc.bits"
values = [4, 6, 8]
[[objective]]
figure = "power_mw"
[[guess]]
name = "two\\nlines"
is = { bits = 6 }
[search]
cells = 20
batch = 2
start = 4
seeds = 1
seeds_most = 2
[final]
seeds = 2
designs = 1
"""
# Takes the place of `sensel`: accepts all cells, and runs them for ten minutes.
SLOW = """#!/bin/sh
case "$*" in
*--cells*) ;;
*"sweep run"*) echo $$ > "$0.pid"; exec sleep 600 ;;
*gather*) exit 4 ;;
esac
"""


def call(*words):
    """Exit code, stdout and stderr of `sensel-sweep`."""
    out, err = io.StringIO(), io.StringIO()
    sys.argv[1:] = [str(word) for word in words]
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            sensel_sweep()
        except SystemExit as end:
            return end.code, out.getvalue(), err.getvalue()
    raise AssertionError(words)


def refused(*words, says):
    """Calls `sensel-sweep`, which must end with 2 and one line that has these words."""
    code, _, err = call(*words)
    assert code == 2 and err.startswith("sensel-sweep: ") and err.count("\n") == 1, (words, code, err)
    assert all(word in err for word in says), (says, err)


def texts(folder):
    """Contents of the rounds by name."""
    return {path.name: path.read_bytes() for path in sorted((folder / "rounds").iterdir())}


class Trials:
    """Checks that share a folder, a program and one small search."""

    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        folder.mkdir()
        self.file, self.out = folder / "odd\nname.toml", folder / "out"
        self.file.write_text(SEARCH, encoding="utf-8")

    def search(self, file=None, out=None, part="search", more=()):
        return [part, file or self.file, "--out", out or self.out, "--program", self.program, *more]

    def a_space_of_few_designs_is_searched_to_its_end(self):
        # Results in a folder that has the scenario's name do not hide it.
        (self.folder / "box").mkdir()
        (self.folder / "box" / "report.html").write_text("", encoding="utf-8")
        code, said, err = call(*self.search())
        assert code == 0, err
        report = json.loads((self.out / "report.json").read_text(encoding="utf-8"))
        designs = {one["is"]["bits"]: one for one in report["designs"]}
        assert sorted(designs) == [4, 6, 8] and len(report["designs"]) == 3 and designs[6]["guess"] == "two\nlines", report
        # Nothing new can be proposed, so what is left goes to more seeds of each, as far as the file allows.
        assert [one["runs"] for one in report["designs"]] == [2, 2, 2] and report["cells"] == 6 and report["is_finished"], report
        head = (self.out / "rounds" / "000.toml").read_text(encoding="utf-8").splitlines()
        assert head[:2] == ["# Round 0 of odd\\nname.toml", 'scenario = "box"'], head
        before = texts(self.out)
        assert call(*self.search())[:2] == (0, said) and texts(self.out) == before, "a finished search stays as it is"

    def a_batch_that_is_refused_as_a_whole_has_no_plan(self):
        # Levels that differ only in a key which [set] has anyway.
        levels = ('"sensor.adc.bits" = 8, "run.frames" = 2', '"sensor.adc.bits" = 8')
        text = SEARCH.replace('key = "sensor.adc.bits"\nvalues = [4, 6, 8]', "")
        tables = "".join(f'[[factor.level]]\nname = "{at}"\nset = {{ {keys} }}\n' for at, keys in zip("ab", levels))
        text = text.replace("[[objective]]", tables + "[[objective]]")
        file, out = self.folder / "whole.toml", self.folder / "whole"
        file.write_text(text.replace("bits = 6", 'bits = "a"'), encoding="utf-8")
        refused(*self.search(file, out), says=[str(file), "not all of them together", "have the same configuration"])
        assert not (out / "rounds").exists()
        # Nothing ran, so that the file may be corrected and searched in the same folder.
        file.write_text(SEARCH, encoding="utf-8")
        code, _, err = call(*self.search(file, out))
        assert code == 0, err
        file.write_text(SEARCH.replace("batch = 2", "batch = 3"), encoding="utf-8")
        refused(*self.search(file, out), says=[str(file), "has changed since", "--out"])

    def damaged_tables_are_gathered_again(self):
        before = texts(self.out)
        for name in (name for name in before if name.endswith(".csv")):
            path, whole = self.out / "rounds" / name, before[name]
            # Nothing, half, all but the end of the last number, no UTF-8.
            for text in (b"", whole[: len(whole) // 2], whole[:-3], b"\xff" + whole):
                path.write_bytes(text)
                code, _, err = call(*self.search(part="report"))
                assert code == 0 and texts(self.out) == before, (name, text, err)

    def damaged_plans_are_named_and_can_be_deleted(self):
        before = texts(self.out)
        for name in (name for name in before if name.endswith(".json")):
            path = self.out / "rounds" / name
            # Nothing, a part, other types, a value that is no choice, runs of a design that is not there.
            other_value, other_run = before[name].replace(b'"bits": ', b'"bits": 1'), before[name].replace(b"\n   1,", b"\n   99,")
            for text in (b"", before[name][:40], b"[]", b"{}", other_value, other_run):
                path.write_bytes(text)
                if text != before[name]:
                    refused(*self.search(), says=[name, "is damaged", "delete it"])
            path.unlink()
            assert call(*self.search())[0] == 0 and texts(self.out) == before, name

    def a_damaged_search_json_can_be_written_again(self):
        path = self.out / "search.json"
        for text in ("", path.read_text(encoding="utf-8")[:20], "[]", "{}"):
            path.write_text(text, encoding="utf-8")
            refused(*self.search(), says=[str(path), "is damaged"])
        advice = call(*self.search())[2]
        path.write_text(advice[advice.index("{") : advice.index("}") + 1], encoding="utf-8")
        assert call(*self.search())[0] == 0

    def a_damaged_report_of_another_search_is_refused(self):
        other = self.folder / "other"
        other.mkdir()
        whole = (self.out / "report.json").read_text(encoding="utf-8")
        beside = self.search(part="report", more=["--beside", other])
        other_means, other_mean = whole.replace('"means": {', '"means": [], "was": {'), whole.replace('"mean": ', '"mean": "a", "was": ')
        for text in ("", whole[:300], "[]", "{}", other_means, other_mean):
            (other / "report.json").write_text(text, encoding="utf-8")
            refused(*beside, says=[f"--beside {other}", "report.json", "finished search"])
        (other / "report.json").write_text(whole, encoding="utf-8")
        assert call(*beside)[0] == 0

    def odd_files_and_programs_are_told_in_words(self):
        marked = self.folder / "marked.toml"
        marked.write_text("\ufeff" + SEARCH.replace("cells = 20", "cells = 2"), encoding="utf-8")
        refused(*self.search(marked), says=["marked.toml", "search.cells = 2"])
        folder = Path(os.fsdecode(os.fsencode(self.folder) + b"/no\xffutf8"))
        (folder / "room").mkdir(parents=True)
        (folder / "room" / "scene.toml").write_text("", encoding="utf-8")
        named = folder / "named.toml"
        named.write_text(SEARCH.replace('"box"', '"room"'), encoding="utf-8")
        refused(*self.search(named, self.folder / "elsewhere"), says=["scenario = room", "no UTF-8"])
        for words in ([*self.search()[:3], self.folder / "new"], ["submit", self.file, "--out", self.folder / "new"]):
            refused(*words, "--program", self.folder / "none", says=["--program", "No such file", "name the program sensel"])

    def signals_stop_the_program_too(self):
        program = self.folder / "slow"
        program.write_text(SLOW, encoding="utf-8")
        program.chmod(0o755)
        stopped_by(signal.SIGTERM, program, self.file, self.folder)
        stopped_by(signal.SIGHUP, program, self.file, self.folder)
        # As by nohup: it goes on, and SIGTERM stops it.
        stopped_by(signal.SIGTERM, program, self.file, self.folder, ignored=signal.SIGHUP)


def stopped_by(number, program, file, folder, ignored=None):
    """Sends a signal to a search only, not to the program that it runs, and looks for what is left."""
    shutil.rmtree(folder / "slow_out", ignore_errors=True)
    pid_file = Path(f"{program}.pid")
    pid_file.unlink(missing_ok=True)
    words = [sys.executable, "-c", "from sensel_sweep import main; main()", "search", file]
    words += ["--out", folder / "slow_out", "--program", program]

    def prepare():
        for usual in (signal.SIGTERM, signal.SIGHUP):
            signal.signal(usual, signal.SIG_IGN if usual == ignored else signal.SIG_DFL)

    printed = folder / "slow.txt"
    with printed.open("w") as stderr, subprocess.Popen(words, stdin=subprocess.DEVNULL, stderr=stderr, preexec_fn=prepare) as search:
        wait_for(lambda: pid_file.exists() and pid_file.read_text(encoding="utf-8").strip())
        child = int(pid_file.read_text(encoding="utf-8"))
        if ignored:
            search.send_signal(ignored)
            time.sleep(0.5)
            assert search.poll() is None and is_running(child), "an ignored signal stays ignored"
        search.send_signal(number)
        search.wait(timeout=60)
    is_left = is_running(child)
    if is_left:
        os.kill(child, signal.SIGKILL)
    assert not is_left, f"{number} leaves the program {child} behind"
    said = printed.read_text(encoding="utf-8")
    assert search.returncode == 130 and "stopped; finished cells are kept" in said, (number, search.returncode, said)


def is_running(process):
    """Whether there is a process of this number."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def wait_for(is_true, seconds=60.0):
    end = time.monotonic() + seconds
    while not is_true():
        assert time.monotonic() < end, "the program did not start"
        time.sleep(0.05)


def main():
    trials = Trials(sys.argv[1], Path(sys.argv[2]))
    checks = [trials.a_space_of_few_designs_is_searched_to_its_end, trials.a_batch_that_is_refused_as_a_whole_has_no_plan]
    checks += [trials.damaged_tables_are_gathered_again, trials.damaged_plans_are_named_and_can_be_deleted]
    checks += [trials.a_damaged_search_json_can_be_written_again, trials.a_damaged_report_of_another_search_is_refused]
    checks += [trials.odd_files_and_programs_are_told_in_words, trials.signals_stop_the_program_too]
    for check in checks:
        check()
    print(json.dumps({"checks": len(checks)}))


if __name__ == "__main__":
    main()
