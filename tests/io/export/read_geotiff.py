"""What GDAL finds in rasters: read_geotiff.py FILE... prints JSON, a line a file; band values go to FILE.f32."""
import json
import sys

from osgeo import gdal, osr

gdal.UseExceptions()
for name in sys.argv[1:]:
    data = gdal.Open(name)
    spatial = data.GetSpatialRef()
    bands = [data.GetRasterBand(i + 1) for i in range(data.RasterCount)]
    with open(name + ".f32", "wb") as values:
        for band in bands:
            values.write(band.ReadRaster(buf_type=gdal.GDT_Float32))
    utm = osr.SpatialReference()
    utm.ImportFromEPSG(25832)
    print(json.dumps({
        "driver": data.GetDriver().ShortName,
        "size": [data.RasterXSize, data.RasterYSize],
        "frame": data.GetGeoTransform(),
        "area": data.GetMetadataItem("AREA_OR_POINT"),
        "structure": data.GetMetadata("IMAGE_STRUCTURE"),
        "nodata": [str(band.GetNoDataValue()) for band in bands],
        "types": [gdal.GetDataTypeName(band.DataType) for band in bands],
        "names": [band.GetDescription() for band in bands],
        "units": [band.GetUnitType() for band in bands],
        "block": bands[0].GetBlockSize(),
        "overviews": bands[0].GetOverviewCount(),
        "crs": spatial.GetName() if spatial else None,
        "epsg": spatial.GetAuthorityCode(None) if spatial else None,
        "parts": [spatial.GetAuthorityCode(p) for p in ("PROJCS", "VERT_CS")] if spatial else None,
        "proj4": spatial.ExportToProj4() if spatial else None,
        "is_utm32": bool(spatial and spatial.IsSame(utm)),
    }))
