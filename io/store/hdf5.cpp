#include "io/store/hdf5.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

namespace btms {
namespace {

constexpr std::size_t kGrowth_bytes = 1 << 18;
constexpr std::size_t kSuperblockEof = 28;  // offset of the end-of-file address in superblocks 2 and 3

// The core driver takes files of equal name for one and the same: name each after an address that is alive. It looks
// whether a file has that name, and where relative ones begin: no file can have this one.
std::string unique_name(const void* address) {
  char text[64];
  std::snprintf(text, sizeof text, "/dev/null/image-%p", address);
  return text;
}

}  // namespace

void require_hdf5_memory() {
  constexpr std::size_t kSession_bytes = std::size_t{8} << 20;  // more than HDF5 takes for one file but for its image
  void* block = ::operator new(kSession_bytes);
  *static_cast<volatile char*>(block) = 0;  // or the compiler would leave it all out
  ::operator delete(block);
}

std::string hdf5_message() {
  std::string text;
  const auto keep_innermost = [](unsigned, const H5E_error2_t* e, void* out) -> herr_t {
    auto& t = *static_cast<std::string*>(out);
    if (t.empty() && e->desc) t = e->desc;
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_innermost, &text);
  H5Eclear2(H5E_DEFAULT);
  return text.empty() ? "unknown reason" : text;
}

// Where the driver leaves the file's bytes when it closes it. (H5Fget_file_image is no alternative: in 1.10 it returns
// a superblock whose checksum is wrong.)
struct Hdf5Image::Memory {
  void* bytes = nullptr;
  std::size_t allocated = 0;

  static void* allocate(std::size_t size, H5FD_file_image_op_t, void* self) {
    static_cast<Memory*>(self)->allocated = size;
    return std::malloc(size);
  }
  static void* reallocate(void* old, std::size_t size, H5FD_file_image_op_t, void* self) {
    static_cast<Memory*>(self)->allocated = size;
    return std::realloc(old, size);
  }
  static void* copy(void* to, const void* from, std::size_t size, H5FD_file_image_op_t, void*) {
    return std::memcpy(to, from, size);
  }
  static herr_t release(void* bytes, H5FD_file_image_op_t op, void* self) {
    if (op == H5FD_FILE_IMAGE_OP_FILE_CLOSE)
      static_cast<Memory*>(self)->bytes = bytes;
    else
      std::free(bytes);
    return 0;
  }
  static void* share(void* self) { return self; }
  static herr_t unshare(void*) { return 0; }
};

H5FD_file_image_callbacks_t Hdf5Image::callbacks(Memory* memory) {
  return {Memory::allocate, Memory::copy, Memory::reallocate, Memory::release, Memory::share, Memory::unshare, memory};
}

Hdf5Image::Hdf5Image() : memory_(new Memory) {
  const Hdf5Properties access(H5Pcreate(H5P_FILE_ACCESS), "create file properties");
  hdf5_check(H5Pset_fapl_core(access.get(), kGrowth_bytes, false), "select the memory driver");
  H5FD_file_image_callbacks_t hooks = callbacks(memory_);
  hdf5_check(H5Pset_file_image_callbacks(access.get(), &hooks), "set image callbacks");
  // Only the 1.10 format has checksums on all metadata.
  hdf5_check(H5Pset_libver_bounds(access.get(), H5F_LIBVER_V110, H5F_LIBVER_V110), "set the file version");
  const Hdf5Properties create(H5Pcreate(H5P_FILE_CREATE), "create file properties");
  constexpr unsigned kOrder = H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED;  // netCDF wants it everywhere
  hdf5_check(H5Pset_link_creation_order(create.get(), kOrder), "set link order");
  hdf5_check(H5Pset_attr_creation_order(create.get(), kOrder), "set attribute order");
  hdf5_check(H5Pset_obj_track_times(create.get(), false), "set times");
  file_ = Hdf5File(H5Fcreate(unique_name(memory_).c_str(), H5F_ACC_TRUNC, create.get(), access.get()), "create a file");
}

Hdf5Image::~Hdf5Image() {
  file_ = Hdf5File();
  if (memory_) std::free(memory_->bytes);
  delete memory_;
}

std::vector<std::uint8_t> Hdf5Image::finish() {
  hdf5_check(H5Fflush(file_.get(), H5F_SCOPE_GLOBAL), "flush a file");
  if (H5Fget_obj_count(file_.get(), H5F_OBJ_ALL) != 1)
    throw Error(ErrorCode::kFailed, "HDF5 file image finished while objects in it are open");
  file_.close();
  const auto* bytes = static_cast<const std::uint8_t*>(memory_->bytes);
  std::uint64_t size = 0;
  if (bytes && memory_->allocated >= kSuperblockEof + sizeof size)
    std::memcpy(&size, bytes + kSuperblockEof, sizeof size);
  if (size == 0 || size > memory_->allocated) throw Error(ErrorCode::kFailed, "HDF5 left no file image");
  return {bytes, bytes + size};
}

Hdf5File open_image(std::span<const std::uint8_t> bytes) {
  const Hdf5Properties access(H5Pcreate(H5P_FILE_ACCESS), "create file properties");
  hdf5_check(H5Pset_fapl_core(access.get(), kGrowth_bytes, false), "select the memory driver");
  // HDF5 only reads from the pointer, it copies the image.
  hdf5_check(H5Pset_file_image(access.get(), const_cast<std::uint8_t*>(bytes.data()), bytes.size()), "set an image");
  return {H5Fopen(unique_name(bytes.data()).c_str(), H5F_ACC_RDONLY, access.get()), "open a file image"};
}

}  // namespace btms
