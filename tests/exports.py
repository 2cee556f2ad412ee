"""NetCDF, Autoware's point tiles and the graph of `btms export`, read by xarray, ncdump, PCL and by their documents:
exports.py BTMS. Heights are those of `btms query`, at UTM coordinates."""
import json, math, re, shutil, struct, subprocess, sys, tempfile
from pathlib import Path

try:
    import numpy as np
    import xarray
    import netCDF4  # what xarray reads NetCDF-4 with
except ImportError as missing:
    print(missing, "(cmake/install-deps.sh --gis)")
    sys.exit(77)

btms = sys.argv[1]
CORNER = (352000, 4026000)
BOX = (352010, 4026010, 352090, 4026110)


def run(*words, **more):
    return subprocess.run([btms, *map(str, words)], check=True, capture_output=True, text=True, **more).stdout


def query(map_, places):
    text = "".join(f"{x!r} {y!r}\n" for x, y in places)
    z = [a["z"] for a in json.loads(run("query", map_, "--json", input=text))["places"]]
    return np.array([math.nan if v is None else v for v in z])


def export(map_, name, *options):
    return json.loads(run("export", map_, "-o", name, "--bbox", ",".join(map(str, BOX)), "--json", *options))


def netcdf(map_, folder):
    export(map_, folder / "part.nc", "--layers", "elevation,slope,class", "--level", 1)
    with xarray.open_dataset(folder / "part.nc") as data:
        assert data.elevation.dims == ("y", "x") and data.crs.attrs["crs_wkt"].startswith("PROJCRS")
        places = [(float(x), float(y)) for y in data.y for x in data.x]
        assert np.array_equal(data.elevation.values.ravel(), query(map_, places).astype("f4"), equal_nan=True)
        assert np.isfinite(data.elevation.values).mean() > 0.9
        assert set(np.unique(data["class"].values)) <= {1, 2, 3, 4}
    if shutil.which("ncdump"):
        head = subprocess.check_output(["ncdump", "-h", folder / "part.nc"], text=True)
        assert re.search(r"float elevation\(y, x\)", head) and 'Conventions = "CF-1.8"' in head, head


def read_pcd(path):
    with open(path, "rb") as file:
        head = {}
        while "DATA" not in head:
            words = file.readline().decode().split()
            head[words[0]] = words[1:]
        assert head["FIELDS"] == ["x", "y", "z"] and head["DATA"] == ["binary"]
        points = np.frombuffer(file.read(), "<f4").reshape(-1, 3)
    assert len(points) == int(head["POINTS"][0])
    return points


def point_tiles(map_, folder):
    cloud = folder / "pointcloud_map.pcd"
    said = export(map_, cloud, "--res", 1, "--tile-m", 40)
    assert said["origin_m"] == [300000, 4000000]
    # The text as YAML without a YAML library.
    lines = (folder / "pointcloud_map_metadata.yaml").read_text().splitlines()
    assert lines[:2] == ["x_resolution: 40", "y_resolution: 40"]
    total = 0
    for line in lines[2:]:
        name, x, y = re.fullmatch(r"(\S+\.pcd): \[(\S+), (\S+)\]", line).groups()
        points = read_pcd(cloud / name)
        x, y = float(x), float(y)
        assert ((points[:, 0] >= x) & (points[:, 0] < x + 40) & (points[:, 1] >= y) & (points[:, 1] < y + 40)).all()
        z = query(map_, [(300000 + float(p[0]), 4000000 + float(p[1])) for p in points])
        assert np.array_equal(points[:, 2], z.astype("f4"))
        total += len(points)
    assert total == said["points"] and len(lines) - 2 == said["files"] == len(list(cloud.iterdir()))
    assert total > 0.9 * 80 * 100
    if shutil.which("pcl_pcd2ply"):
        subprocess.check_output(["pcl_pcd2ply", cloud / name, folder / "pcl.ply"])
        assert f"element vertex {len(points)}" in (folder / "pcl.ply").read_bytes()[:400].decode(errors="replace")
    else:
        print("without PCL: pcl-tools is not installed")


def read_graph(path):
    """As docs/exports.md has it."""
    data = path.read_bytes()
    magic, version, r_mm, nodes, edges, revision, wkt_bytes, _, node_bytes, begin = struct.unpack_from("<8sIiQQQQQII", data)
    assert (magic, version, node_bytes) == (b"BTMSGRPH", 1, 16)
    table = np.frombuffer(data, "i1", 192, 64).reshape(4, 16, 3)
    kind = np.dtype([("col", "<i4"), ("row", "<i4"), ("z3", "<i4"), ("edges", "<u2"), ("triangle", "u1"), ("cost", "u1")])
    wkt = data[begin + nodes * node_bytes:]
    assert len(wkt) == wkt_bytes and wkt.startswith(b"PROJCRS"), wkt[:99]
    return r_mm / 1000, table, np.frombuffer(data, kind, nodes, begin), edges


def graphs(map_, folder):
    said = export(map_, folder / "part.graph")
    r, table, nodes, edges = read_graph(folder / "part.graph")
    assert (len(nodes), edges) == (said["nodes"], said["edges"]) and edges > len(nodes)
    out = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]]) * r / 3  # centroids from the centres of squares
    key = lambda n: (int(n["col"]), int(n["row"]), int(n["triangle"]))
    places = {key(n): ((n["col"] + 0.5) * r + out[n["triangle"]][0], (n["row"] + 0.5) * r + out[n["triangle"]][1], n["z3"] / 3000) for n in nodes}
    z = query(map_, [p[:2] for p in places.values()])
    assert np.abs(z - [p[2] for p in places.values()]).max() < 2e-3  # places are rounded to millimetres
    costs = {key(n): n["cost"] / 254 for n in nodes}
    weights = {}
    for n in nodes:
        for bit in range(14):
            if n["edges"] >> bit & 1:
                dc, dr, t = table[n["triangle"], bit]
                to = (int(n["col"] + dc), int(n["row"] + dr), int(t))
                a, b = places[key(n)], places[to]
                weights[frozenset([key(n), to])] = math.dist(a, b) * (1 + 4 * (costs[key(n)] + costs[to]) / 2)
    assert len(weights) == edges

    assert export(map_, folder / "part.geojson")["edges"] == edges
    features = json.loads((folder / "part.geojson").read_text())["features"]
    points = [f for f in features if f["geometry"]["type"] == "Point"]
    lines = [f for f in features if f["geometry"]["type"] == "LineString"]
    assert (len(points), len(lines)) == (len(nodes), edges)
    at = {f["id"]: f["geometry"]["coordinates"] for f in points}
    assert all(f["geometry"]["coordinates"] == [at[f["properties"]["from"]], at[f["properties"]["to"]]] for f in lines)
    assert np.allclose(sorted(f["properties"]["weight"] for f in lines), sorted(weights.values()), atol=1e-4)


with tempfile.TemporaryDirectory(prefix="btms-exports-") as name:
    folder = Path(name)
    run("synth", "--points", 150000, "--origin", "%d,%d" % CORNER, "-o", folder / "truth", "--quiet")
    run("build", folder / "truth", "-o", folder / "city.btms", "--crs", "EPSG:25832", "--tile-cells", 1, "--quiet")
    for check in netcdf, point_tiles, graphs:
        check(folder / "city.btms", folder)
