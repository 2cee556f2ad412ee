"""B-TMS Engine: terrain from point clouds.

    import btms
    btms.build("tiles/", "city.btms")
    city = btms.open("city.btms")
    city.heights([[200.0, 150.0]])
    city.to_xarray(["elevation", "slope"]).elevation.plot()
    btms.segment(points)            # (N, 3) array -> labels, 1 where terrain
"""

from ._core import (
    BELOW,
    DROPPED,
    OBSTACLE,
    TERRAIN,
    Error,
    Map as _Map,
    Segmenter,
    __version__,
    build,
    parameters,
    presets,
)

__all__ = [
    "BELOW",
    "DROPPED",
    "OBSTACLE",
    "TERRAIN",
    "Error",
    "Map",
    "Segmenter",
    "__version__",
    "build",
    "open",
    "parameters",
    "presets",
    "segment",
]


class Map(_Map):
    """One revision of a map, read-only; threads may share it."""

    def to_xarray(self, names=("elevation",), bbox=None, resolution=None):
        """Layers as an xarray.Dataset over y (north first) and x; needs xarray."""
        import xarray

        layers = self.layers(list(names), bbox, resolution)
        x, y = layers.pop("x"), layers.pop("y")
        dataset = xarray.Dataset(
            {name: (("y", "x"), values) for name, values in layers.items()},
            coords={"y": ("y", y, {"units": "m"}), "x": ("x", x, {"units": "m"})},
            attrs={"digest": self.digest, "revision": self.revision},
        )
        if self.crs_wkt:
            dataset.attrs["crs_wkt"] = self.crs_wkt
        return dataset


def open(folder, cache_bytes=512 << 20, untrusted=False):
    """Opens a map made by build() or `btms build`."""
    return Map(folder, cache_bytes, untrusted)


def segment(points, preset="single-scan", **parameters):
    """Labels (N,) uint8 of one scan (N, 3 or more): TERRAIN, OBSTACLE, BELOW, or DROPPED. For many scans keep a Segmenter."""
    return Segmenter(preset, **parameters).segment(points)
