"""Gates of the extractor and its neighbours by Yosys, over the parameters of rtl_models/verilog.

    python3 tests/judges/gates.py                      # writes src/run/gates.csv
    python3 tests/judges/gates.py core KEY=VALUE ...   # one setting of extractor_core: cells, flip-flops, memory bits

Memories stay memories; modules are mapped one by one and summed with their instances.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "src/run/gates.csv"

FRONT = {"MAX_WIDTH": 640, "PIX_BITS": 8, "OCTAVES": 1, "HARRIS": 0}
BACK = FRONT | {"CELL_LOG2": 4, "PER_CELL": 1, "RING_LOG2": 6, "ENGINES": 1, "FIFO_DEPTH": 16, "DESC_BITS": 256,
                "SYMMETRIC": 0, "SUBPIXEL": 1}
BASE = {
    "fx_engine": {"PIX_BITS": 8, "DESC_BITS": 256, "SYMMETRIC": 0},
    "fx_fifo": {"DEPTH": 16, "WIDTH": 111, "RANK_BITS": 8},
    "fx_cells": {"MAX_WIDTH": 640, "OCTAVES": 1, "CELL_LOG2": 4, "PER_CELL": 1, "RANK_BITS": 8, "BODY_BITS": 80},
    "sensor_core": {"MAX_LANES": 16},
    "csi2_packetiser": {},
    "fx_front": FRONT,
    "fx_back": BACK,
    "extractor_core": BACK,
}
# Block and parameters that differ from its base.
POINTS = [
    ("fx_engine", {}), ("fx_engine", {"PIX_BITS": 16}), ("fx_engine", {"DESC_BITS": 64}), ("fx_engine", {"SYMMETRIC": 1}),
    ("fx_engine", {"PIX_BITS": 16, "SYMMETRIC": 1}), ("sensor_core", {"COLUMNS": 16}), ("sensor_core", {"COLUMNS": 64}),
    ("csi2_packetiser", {}), ("fx_front", {}), ("fx_front", {"PIX_BITS": 12}), ("fx_front", {"PIX_BITS": 16}),
    ("fx_front", {"OCTAVES": 2}), ("fx_front", {"OCTAVES": 3}), ("fx_front", {"OCTAVES": 4}), ("fx_front", {"HARRIS": 1}),
    ("fx_front", {"PIX_BITS": 16, "HARRIS": 1}), ("fx_front", {"MAX_WIDTH": 160}), ("fx_front", {"MAX_WIDTH": 2560}),
    ("fx_back", {}), ("fx_back", {"PIX_BITS": 16}), ("fx_back", {"SUBPIXEL": 0}),
    ("fx_back", {"PIX_BITS": 16, "SUBPIXEL": 0}), ("fx_back", {"DESC_BITS": 64}), ("fx_back", {"OCTAVES": 2}),
    ("fx_back", {"OCTAVES": 3}), ("fx_back", {"OCTAVES": 4}), ("fx_back", {"HARRIS": 1}), ("fx_back", {"CELL_LOG2": 5}),
    ("fx_back", {"CELL_LOG2": 6, "RING_LOG2": 7}), ("fx_back", {"MAX_WIDTH": 160}), ("fx_back", {"MAX_WIDTH": 2560}),
    ("fx_fifo", {}), ("fx_fifo", {"DEPTH": 1}), ("fx_fifo", {"DEPTH": 64}), ("fx_cells", {}), ("fx_cells", {"PER_CELL": 2}),
    ("fx_cells", {"PER_CELL": 4}), ("fx_cells", {"OCTAVES": 4}), ("fx_cells", {"OCTAVES": 4, "PER_CELL": 4}),
]


def modules(stat: str, dump: str) -> dict[str, dict]:
    """Cells by type and memory bits of each module."""
    found: dict[str, dict] = {}
    current = None
    for line in stat.splitlines():
        if name := re.match(r"=== (\S+) ===", line):
            current = name[1]
            found.setdefault(current, {"cells": {}, "bits": 0})
        elif line.startswith("==="):
            current = None
        elif current and (count := re.match(r"\s+(\S+)\s+(\d+)$", line)):
            found[current]["cells"][count[1]] = int(count[2])
    by_name = {name.lstrip("\\"): name for name in found}
    # A design of one module is dumped without its name.
    current, words = next(iter(found)), 0
    for line in map(str.strip, dump.splitlines()):
        if line.startswith("module "):
            current = by_name.get(line[7:].lstrip("\\"), next(iter(found)))
        elif line.startswith("parameter \\SIZE "):
            words = int(line.split()[-1])
        elif line.startswith("parameter \\WIDTH ") and words:
            found[current]["bits"] += words * int(line.split()[-1])
            words = 0
    return found


def total(found: dict[str, dict], name: str) -> list[int]:
    """Cells, flip-flops and memory bits of a module with all that it consists of."""
    sums = [0, 0, found[name]["bits"]]
    for cell, count in found[name]["cells"].items():
        if cell in found:
            sums = [own + count * part for own, part in zip(sums, total(found, cell))]
        elif re.match(r"\$_\w+_$", cell):
            sums[0] += count
            sums[1] += count if "DFF" in cell else 0
    return sums


def netlist(top: str, parameters: dict[str, int]) -> list[int]:
    files = " ".join(str(path) for path in sorted((ROOT / "rtl_models/verilog").glob("*.sv")))
    settings = " ".join(f"-chparam {key} {value}" for key, value in (BASE[top] | parameters).items())
    # Engines are counted by themselves.
    without = "blackbox *fx_engine*; " if top == "fx_back" else ""
    with tempfile.TemporaryDirectory() as folder:
        script = (
            f"read_verilog -sv {files}; hierarchy -check -top {top} {settings}; {without}proc; synth -run begin:fine; "
            "opt -fast -full; opt -full; techmap; opt -fast; abc -fast; opt -fast; opt_clean; "
            f"tee -o {folder}/stat stat; tee -o {folder}/dump dump t:$mem_v2"
        )
        subprocess.run(["yosys", "-q", "-p", script], check=True, stdout=subprocess.DEVNULL)
        found = modules(Path(f"{folder}/stat").read_text(), Path(f"{folder}/dump").read_text())
    inside = {cell for module in found.values() for cell in module["cells"]}
    (name,) = [name for name in found if name not in inside]
    return total(found, name)


def main() -> None:
    if len(sys.argv) > 1:
        top = {"core": "extractor_core"}.get(sys.argv[1], sys.argv[1])
        pairs = (argument.split("=") for argument in sys.argv[2:])
        print(*netlist(top, {key: int(value) for key, value in pairs}))
        return
    lines = ["block,parameters,cells,flip_flops,memory_bits"]
    for top, parameters in POINTS:
        words = " ".join(f"{key}={value}" for key, value in parameters.items())
        lines.append(",".join([top, words, *map(str, netlist(top, parameters))]))
        print(lines[-1], flush=True)
    TABLE.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
