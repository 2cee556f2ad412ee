#include "io/store/sandboxed_layers.h"

#include "io/store/hdf5.h"
#include "io/store/sandbox.h"

namespace btms {
namespace {

template <class T>
std::span<const std::uint8_t> bytes_of(const T& value) {
  return {reinterpret_cast<const std::uint8_t*>(&value), sizeof value};
}

// What the child sends first: entries of the lists. Then the layers, nothing but their rasters.
using UpperCount = std::uint64_t;

// Once, so that no child is forked while another thread is inside the library: its lock would stay closed in there.
void start_hdf5() {
  static const bool started = [] {
    const QuietHdf5 quiet;
    return hdf5_check(H5open(), "start") >= 0;
  }();
  static_cast<void>(started);
}

SandboxLimits limits_for(const StoredShard& shard) {
  constexpr std::uint64_t kBase_bytes = std::uint64_t{256} << 20, kCell_bytes = 128;
  const auto cells = static_cast<std::uint64_t>(shard.box.cells());
  return {kBase_bytes + 4 * shard.bytes.size() + kCell_bytes * cells,
          static_cast<int>(10 + shard.bytes.size() / (std::size_t{10} << 20) + cells / 1'000'000)};
}

}  // namespace

void read_layers_sandboxed(const StoredShard& shard, Wanted wanted, const std::optional<Crs>& crs,
                           const LayerSink& sink) {
  if (shard.box.cells() > kMostUntrustedCells)
    throw Error(ErrorCode::kVerification, "it claims " + std::to_string(shard.box.cells()) +
                                              " squares; of an untrusted shard at most " +
                                              std::to_string(kMostUntrustedCells) + " are read");
  start_hdf5();
  const auto work = [&](SandboxOutput& out) {
    bool first = true;
    read_layers(shard, wanted, crs, [&](const LayerInfo&, std::size_t upper, std::vector<std::uint8_t>&& raster) {
      if (std::exchange(first, false)) out.write(bytes_of(UpperCount{upper}));
      out.write(raster);
    });
  };
  const auto consume = [&](SandboxInput& in) {
    constexpr std::uint64_t kMostDeflated = 1032;  // bytes from one
    UpperCount upper = 0;
    in.read({reinterpret_cast<std::uint8_t*>(&upper), sizeof upper});
    if (upper > shard.bytes.size() * kMostDeflated)
      throw Error(ErrorCode::kVerification, "the lists of further surfaces are longer than what is stored of them");
    for (const LayerInfo& layer : layer_table()) {
      if (!is_read(layer, wanted, upper)) continue;
      std::vector<std::uint8_t> raster(layer_shape(layer, shard.box, upper).elements() * element_bytes(layer.element));
      in.read(raster);
      sink(layer, upper, std::move(raster));
    }
  };
  run_sandboxed(limits_for(shard), work, consume);
}

}  // namespace btms
