import os
import subprocess
import threading

import numpy as np
import pytest

import btms

PROGRAM = os.environ["BTMS_PROGRAM"]


def run(*words):
    return subprocess.run([PROGRAM, *map(str, words)], check=True, capture_output=True, text=True).stdout


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("city")
    run("synth", "--points", 1000000, "-o", folder / "truth")
    return folder


@pytest.fixture(scope="session")
def city(folder):
    phases = []

    def progress(phase, done, total):
        phases.append((phase, done, total))

    built = btms.build(folder / "truth", folder / "city.btms", progress=progress, threads=2)
    assert built["points"] > 900000 and built["warnings"] == []
    assert built["nodes"]["observed"] > 0
    city = btms.open(folder / "city.btms")
    assert city.digest == built["digest"]
    return city


def places(city, n=2000):
    x0, y0, x1, y1 = city.bounds
    random = np.random.default_rng(1)
    return np.column_stack([random.uniform(x0 - 20, x1 + 20, n), random.uniform(y0 - 20, y1 + 20, n)])


def test_build_is_what_the_program_builds(folder, city):
    run("build", folder / "truth", "-o", folder / "other.btms")
    assert btms.open(folder / "other.btms").digest == city.digest
    changed = btms.build([folder / "truth"], folder / "fine.btms", threads=1, terrain_distance_m=0.2)
    assert changed["points"] == city.points


def test_progress_can_stop_and_raise(folder):
    def stop(phase, done, total):
        return False

    with pytest.raises(btms.Error) as error:
        btms.build(folder / "truth", folder / "stopped.btms", progress=stop)
    assert error.value.code == "cancelled"
    assert not (folder / "stopped.btms").exists()

    def fail(phase, done, total):
        raise ValueError("enough")

    with pytest.raises(ValueError, match="enough"):
        btms.build(folder / "truth", folder / "stopped.btms", progress=fail)


def test_heights_are_those_of_query(city, folder):
    xy = places(city, 300)
    text = "".join(f"{x:.17g} {y:.17g}\n" for x, y in xy)
    said = subprocess.run([PROGRAM, "query", folder / "city.btms", "--json"], input=text, capture_output=True, text=True, check=True)
    import json

    expected = [np.nan if p["z"] is None else p["z"] for p in json.loads(said.stdout)["places"]]
    np.testing.assert_allclose(city.heights(xy), expected, atol=1e-6)
    full = city.query(xy)
    np.testing.assert_array_equal(full["z"], city.heights(xy))
    known = ~np.isnan(full["z"])
    np.testing.assert_allclose(np.linalg.norm(full["normal"][known], axis=1), 1)
    assert set(full["state"][known]) <= {1, 2, 3, 4}


def test_any_array_of_places_will_do(city):
    xy = places(city, 50)
    expected = city.heights(xy)
    np.testing.assert_array_equal(city.heights(xy.tolist()), expected)
    np.testing.assert_array_equal(city.heights(np.asfortranarray(xy)), expected)
    np.testing.assert_array_equal(city.heights(np.column_stack([xy, xy])[:, :2]), expected)
    assert city.heights(np.empty((0, 2))).shape == (0,)
    for wrong in ([1, 2], np.zeros((3, 1)), [["a", "b"]], None):
        with pytest.raises((btms.Error, ValueError)):
            city.heights(wrong)


def test_bounds_are_those_of_info(city, folder):
    import json

    assert city.bounds == json.loads(run("info", folder / "city.btms", "--json"))["bounds_m"]


def test_layers(city):
    whole = city.layers(["elevation", "class"])
    rows, cols = whole["elevation"].shape
    assert (len(whole["y"]), len(whole["x"])) == (rows, cols)
    assert whole["elevation"].dtype == np.float32
    grid = np.column_stack([np.tile(whole["x"], rows), np.repeat(whole["y"], cols)])
    np.testing.assert_array_equal(whole["elevation"].ravel(), city.heights(grid).astype(np.float32))
    part = city.layers(["slope"], bbox=(10, 20, 30, 60), resolution=0.5)
    assert part["slope"].shape == (80, 40)
    with pytest.raises(btms.Error, match="gold"):
        city.layers(["gold"])
    with pytest.raises(btms.Error):
        city.layers(bbox=(0, 0, -1, 1))


def test_xarray(city):
    xarray = pytest.importorskip("xarray")
    dataset = city.to_xarray(["elevation", "slope"])
    assert isinstance(dataset, xarray.Dataset)
    at = dataset.elevation.sel(x=101, y=51, method="nearest")
    assert np.isclose(float(at), city.heights([[float(at.x), float(at.y)]])[0], atol=1e-4)


def test_ways(city):
    profile = city.profile([[50, 50], [60, 50]], 1)
    assert profile.shape == (11, 2) and profile[-1, 0] == 10
    found = None
    xy = places(city, 400)
    for a, b in zip(xy[::2], xy[1::2]):
        route = city.route(a, b)
        if route["status"] == "found" and route["length_m"] > 20:
            found = route
            break
    assert found is not None
    check = city.check(found["points"][:, :2])
    assert check["is_safe"], check
    tall = city.check(found["points"][:, :2], footprint=[[-1, -9], [1, -9], [1, 9], [-1, 9]])
    assert not tall["is_safe"] and tall["reason"]
    with pytest.raises(btms.Error):
        city.check([[0, 0]], limits={"speed": 3})


def test_segment():
    random = np.random.default_rng(2)
    floor = np.column_stack([random.uniform(-20, 20, (40000, 2)), np.full(40000, -1.7)])
    wall = np.column_stack([np.full(4000, 10.0), random.uniform(-5, 5, 4000), random.uniform(-1, 1, 4000)])
    points = np.vstack([floor, wall]).astype(np.float32)
    labels = btms.segment(points)
    assert labels.dtype == np.uint8 and labels.shape == (44000,)
    assert (labels[:40000] == btms.TERRAIN).mean() > 0.98
    assert (labels[40000:] == btms.OBSTACLE).mean() > 0.95
    # The same points, however they lie in memory.
    np.testing.assert_array_equal(btms.segment(points.astype(np.float64)), labels)
    np.testing.assert_array_equal(btms.segment(np.asfortranarray(points)), labels)
    np.testing.assert_array_equal(btms.segment(np.column_stack([points, points[:, :1]])), labels)
    np.testing.assert_array_equal(btms.segment(points[::-1])[::-1], labels)
    odd = points.copy()
    odd[5] = np.nan
    assert btms.segment(odd)[5] == btms.DROPPED
    keeps = btms.Segmenter("paper-single-scan", resolution_m=1)
    np.testing.assert_array_equal(keeps.segment(points), keeps.segment(points))
    assert btms.segment(np.empty((0, 3), np.float32)).shape == (0,)
    with pytest.raises(btms.Error, match="resolution_m"):
        btms.Segmenter("single-scan", resolution_m=-1)
    with pytest.raises(btms.Error):
        btms.segment(np.zeros((5, 2)))


def test_errors_have_codes(tmp_path):
    with pytest.raises(btms.Error) as error:
        btms.open(tmp_path / "nothing.btms")
    assert error.value.code in ("usage", "bad_input", "failed")
    with pytest.raises(btms.Error) as error:
        btms.build(tmp_path / "nothing.las", tmp_path / "x.btms")
    assert error.value.code == "usage"
    with pytest.raises(btms.Error, match="preset"):
        btms.parameters("castle")
    assert btms.parameters("city")["resolution_m"] == 2
    assert "city" in btms.presets()


def test_threads_share_a_map(city):
    xy = places(city)
    expected = city.heights(xy)
    wrong = []

    def ask():
        for _ in range(20):
            if not np.array_equal(city.heights(xy), expected, equal_nan=True):
                wrong.append(1)

    threads = [threading.Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong
