#include "apps/ros1/scan_labeller.h"

#include "engine/tiling/scan_segmenter.h"

namespace btms {

class ScanLabeller::Impl {
 public:
  explicit Impl(const std::string& name) : segmenter(preset(name)) {}
  ScanSegmenter segmenter;
  std::vector<std::uint8_t> labels;
};

ScanLabeller::ScanLabeller(const std::string& preset) : impl_(std::make_unique<Impl>(preset)) {}
ScanLabeller::~ScanLabeller() = default;

const std::vector<std::uint8_t>& ScanLabeller::labels_of(const Columns& p) {
  impl_->labels.clear();
  for (const Label label : impl_->segmenter.segment({p.x_m, p.y_m, p.z_m, p.size, p.stride_bytes}))
    impl_->labels.push_back(static_cast<std::uint8_t>(label));
  return impl_->labels;
}

}  // namespace btms
