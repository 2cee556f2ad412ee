#!/usr/bin/env python3
"""How what ranks exchange grows, measured and simulated: the figures of docs/scaling.md.

  tests/scaling.py BTMS [--points N ...] [--ranks N ...]

Builds synthetic cities by forked ranks (the bytes are those of MPI), more of them than there are cores, compares with
the model, and goes on with the model alone. Fails where a measured figure is more than a quarter from it.
"""
import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

# The model (r = 2 m, preset city, ten points a square metre): bytes a metre of border between two ranks.
HALO = 3500  # strips, both ways
SHARED = 90  # components at the border; every rank gets those of all
BIN = 20e3  # a km^2: places with points, every rank gets them all
POINT = 8.02  # a point that lies with another rank
TILE_CELLS = 4  # of 32 m: small tiles, so that 64 ranks have some each


def hilbert(x, y):
    index = 0
    for bit in range(31, -1, -1):
        right, upper = x >> bit & 1, y >> bit & 1
        index = index << 2 | (3 * right ^ upper)
        if not upper:
            if right:
                x, y = ~x & 0xFFFFFFFF, ~y & 0xFFFFFFFF
            x, y = y, x
    return index


def border_m(blocks, ranks, edge_m):
    """Length of the borders between ranks that own equally many blocks along the curve."""
    west, south = min(x for x, _ in blocks), min(y for _, y in blocks)
    order = sorted(blocks, key=lambda b: hilbert(b[0] - west, b[1] - south))
    owner = {b: i * ranks // len(order) for i, b in enumerate(order)}
    return edge_m * sum(
        owner[b] != owner[n] for b in blocks for n in ((b[0] + 1, b[1]), (b[0], b[1] + 1)) if n in owner
    )


def measure(btms, city, ranks, folder):
    target = folder / "map.btms"
    said = subprocess.run(
        [btms, "build", city, "-o", target, "--executor", f"ranks:{ranks}", "--threads", "1", "--tile-cells",
         str(TILE_CELLS), "--json", "--quiet"], check=True, capture_output=True, text=True)
    report = json.loads(said.stdout)
    phases = {p["phase"]: p for p in report["phases"]}
    manifest = json.loads((target / "manifest.json").read_text())
    blocks = [tuple(shard["id"]) for shard in manifest["shards"]]
    edge_m = 2 * max(shard["bounds"][2] - shard["bounds"][0] for shard in manifest["shards"])
    subprocess.run(["rm", "-r", target], check=True)
    late = [p for name, p in phases.items() if name not in ("partition", "sort", "commit")]
    return {
        "digest": report["digest"],
        "points": report["points"],
        "border_m": border_m(blocks, ranks, edge_m),
        "point_bytes": phases["sort"]["sent_bytes"],
        "halo_bytes": sum(p["sent_bytes"] for p in late),
        "shared_bytes": sum(p["shared_bytes"] for p in late),
        "memory_bytes": report["peak_rss_bytes"],
    }


def text(n_bytes):
    for unit in ("B", "kB", "MB", "GB", "TB"):
        if n_bytes < 1000 or unit == "TB":
            return f"{n_bytes:.3g} {unit}"
        n_bytes /= 1000


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("btms")
    parser.add_argument("--points", type=int, nargs="+", default=[2_500_000, 10_000_000, 40_000_000])
    parser.add_argument("--ranks", type=int, nargs="+", default=[2, 4, 8, 16, 32, 64])
    args = parser.parse_args()
    worst = 0.0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        print("| points | ranks | border | points sent | halos sent | a metre | shared | a metre | memory of rank 0 |")
        print("|---|---|---|---|---|---|---|---|---|")
        for points in args.points:
            city = folder / f"city{points}"
            subprocess.run([args.btms, "synth", "--points", str(points), "-o", city, "--quiet"], check=True,
                           stdout=subprocess.DEVNULL)
            digests = set()
            for ranks in args.ranks:
                m = measure(args.btms, city, ranks, folder)
                digests.add(m["digest"])
                print(f"| {points / 1e6:g} M | {ranks} | {m['border_m'] / 1000:.1f} km | {text(m['point_bytes'])} | "
                      f"{text(m['halo_bytes'])} | {m['halo_bytes'] / m['border_m']:.0f} B | {text(m['shared_bytes'])} | "
                      f"{m['shared_bytes'] / m['border_m']:.0f} B | {text(m['memory_bytes'])} |", flush=True)
                # Of a part narrower than the halos of the coarse levels there is less to send than the model says.
                if points / 10 / ranks > 250**2:
                    worst = max(worst, abs(math.log(m["halo_bytes"] / m["border_m"] / HALO)))
                    worst = max(worst, abs(math.log(m["point_bytes"] / (points * (1 - 1 / ranks)) / POINT)))
            if len(digests) != 1:
                sys.exit(f"{points} points: {len(digests)} digests")
            subprocess.run(["rm", "-r", city], check=True)
    ragged = [border_m([(x, y) for x in range(side) for y in range(side)], ranks, 1) / (2 * side * (ranks**0.5 - 1))
              for side, ranks in ((90, 50), (150, 100), (250, 200))]
    factor = sum(ragged) / len(ragged)
    print(f"\nborders along the curve: {factor:.2f} times those of as many squares\n")
    print("| area | ranks | border of all | halos a rank | shared, to every rank | bins, to every rank |")
    print("|---|---|---|---|---|---|")
    for area_km2, ranks in ((100, 10), (1000, 100), (10_000, 100), (10_000, 1000), (100_000, 1000), (100_000, 10_000)):
        border = factor * 2 * math.sqrt(area_km2 * 1e6) * (math.sqrt(ranks) - 1)
        print(f"| {area_km2:,} km^2 | {ranks:,} | {border / 1000:,.0f} km | {text(HALO * border / ranks)} | "
              f"{text(SHARED * border)} | {text(BIN * area_km2)} |")
    print(f"\nmeasured halos and points: within {100 * (math.exp(worst) - 1):.0f} % of the model")
    sys.exit(worst > math.log(1.25))


main()
