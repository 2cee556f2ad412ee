// Every structure in the files of a map has a checksum: only HDF5's format of 1.10 has.
#include <hdf5.h>

#include "tests/io/store/made_map.h"

namespace btms {
namespace {

struct Found {
  int objects = 0, old_headers = 0;
};

Found inspect(const std::filesystem::path& path) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  H5F_info2_t info;
  EXPECT_GE(H5Fget_info2(file, &info), 0);
  EXPECT_GE(info.super.version, 3u) << path;
  Found found;
  const auto visit = [](hid_t, const char*, const H5O_info_t* object, void* data) -> herr_t {
    auto& f = *static_cast<Found*>(data);
    ++f.objects;
    f.old_headers += object->hdr.version < 2;
    return 0;
  };
  EXPECT_GE(H5Ovisit2(file, H5_INDEX_NAME, H5_ITER_INC, visit, &found, H5O_INFO_HDR), 0);
  H5Fclose(file);
  return found;
}

TEST(Hdf5Format, ShardsAndViewHaveChecksumsOnAllMetadata) {
  const TemporaryFolder temporary;
  const auto folder = temporary / "a.btms";
  const MapLayout layout = layout_of(2000, 64);
  write_map(folder, layout, made_tiles(layout, {-10, -10, 70, 30}, noisy_tile), "EPSG:28992");
  std::vector<std::filesystem::path> files = files_in(folder / "shards");
  files.push_back(folder / "map.nc");
  for (const auto& file : files) {
    const Found found = inspect(file);
    EXPECT_GT(found.objects, 20) << file;
    EXPECT_EQ(found.old_headers, 0) << file;
  }
}

}  // namespace
}  // namespace btms
