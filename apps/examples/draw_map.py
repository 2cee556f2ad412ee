"""A city's map in a picture: its terrain, what crossing costs, and the way a car takes.

    PYTHONPATH=build/release/python python3 apps/examples/draw_map.py MAP PICTURE.png [X1 Y1 X2 Y2]
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LightSource

import btms


def main(folder, picture, ends):
    city = btms.open(folder)
    layers = city.layers(["elevation", "cost", "class"])
    x, y, z = layers["x"], layers["y"], layers["elevation"]
    seen = ~np.isnan(z) & (layers["class"] < 4)  # not what is only guessed
    rows, cols = np.where(seen.any(axis=1))[0], np.where(seen.any(axis=0))[0]
    window = np.s_[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]
    extent = (x[cols[0]], x[cols[-1]], y[rows[-1]], y[rows[0]])

    z, cost = (np.where(seen, v, np.nan)[window] for v in (z, layers["cost"]))
    figure, axes = plt.subplots(1, 2, figsize=(13, 6.2), layout="constrained", sharex=True, sharey=True)
    low, high = np.nanpercentile(z, [1, 99])
    light = LightSource(315, 45).hillshade(np.nan_to_num(z, nan=low), vert_exag=4, dx=city.resolution_m, dy=city.resolution_m)
    heights = axes[0].imshow(z, extent=extent, cmap="terrain", vmin=low, vmax=high)
    axes[0].imshow(light, extent=extent, cmap="gray", alpha=0.35)
    axes[0].set_title(f"{seen.sum():_} squares of {city.resolution_m:g} m from {city.points:_} points".replace("_", " "))
    figure.colorbar(heights, ax=axes[0], label="height, m", shrink=0.8)

    axes[1].set_facecolor("#5c5464")
    costs = axes[1].imshow(cost, extent=extent, cmap="YlOrRd", vmin=0, vmax=1)
    axes[1].set_title("What crossing costs a car; dark: it can't")
    figure.colorbar(costs, ax=axes[1], label="cost", shrink=0.8)

    route = city.route(ends[:2], ends[2:])
    print(f"route: {route['status']}, {route['length_m']:.0f} m")
    for axis in axes:
        axis.plot(*route["points"][:, :2].T, color="white", linewidth=4)
        axis.plot(*route["points"][:, :2].T, color="#1a5ad6", linewidth=2)
        axis.set_xlabel("x, m")
    axes[0].set_ylabel("y, m")
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    if len(sys.argv) not in (3, 7):
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2], [float(a) for a in sys.argv[3:]] or [215.0, 95.0, 390.0, 280.0])
