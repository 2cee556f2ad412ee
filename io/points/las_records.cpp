#include "io/points/las_records.h"

#include <algorithm>

#include "io/points/little_endian.h"

namespace btms {
namespace {

struct Layout {
  const char* name;
  std::size_t head_bytes;
  bool wide_length;  // 64 bit
};
constexpr Layout kVlr{"VLR", 54, false};
constexpr Layout kEvlr{"EVLR", 60, true};

// Real files have a handful. Walking the millions that a damaged count may claim would take minutes.
constexpr std::uint32_t kMostRecords = 100'000;

// Walks `count` records in [at, end) and returns where the last one ends.
std::uint64_t walk(const InputFile& file, const InputFile::Session& session, const Layout& layout, std::uint64_t at,
                   std::uint64_t end, std::uint64_t count, std::vector<LasRecord>& records) {
  const std::string name = layout.name;
  if (count > kMostRecords || count * layout.head_bytes > end - at) {
    file.refuse("header declares " + std::to_string(count) + " " + name + "s, found room for " +
                    std::to_string(std::min<std::uint64_t>(kMostRecords, (end - at) / layout.head_bytes)),
                at);
  }
  for (std::uint64_t i = 0; i < count; ++i) {
    std::uint8_t head[60];
    if (end - at < layout.head_bytes)
      file.refuse(name + " " + std::to_string(i + 1) + " of " + std::to_string(count) + " does not fit", at);
    session.read(at, {head, layout.head_bytes});
    const std::uint64_t bytes = layout.wide_length ? load<std::uint64_t>(head + 20) : load<std::uint16_t>(head + 20);
    const std::uint64_t content = at + layout.head_bytes;
    if (bytes > end - content) {
      file.refuse(name + " " + std::to_string(i + 1) + " declares " + std::to_string(bytes) +
                      " bytes, found room for " + std::to_string(end - content),
                  at + 20);
    }
    const auto* user = reinterpret_cast<const char*>(head + 2);
    records.push_back(
        {std::string(user, std::find(user, user + 16, '\0')), load<std::uint16_t>(head + 18), content, bytes});
    at = content + bytes;
  }
  return at;
}

}  // namespace

void find_vlrs(const InputFile& file, const InputFile::Session& session, std::uint32_t count, LasHeader& header) {
  walk(file, session, kVlr, header.header_bytes, header.points_offset, count, header.records);
}

std::uint64_t find_evlrs(const InputFile& file, const InputFile::Session& session, std::uint64_t start,
                         std::uint32_t count, LasHeader& header) {
  constexpr std::uint64_t kStartField = 235;
  if (start < header.points_end() || start > file.size()) {
    file.refuse("EVLRs start at byte " + std::to_string(start) + ", expected " + std::to_string(header.points_end()) +
                    " (end of the points) to " + std::to_string(file.size()) + " (end of the file)",
                kStartField);
  }
  return walk(file, session, kEvlr, start, file.size(), count, header.records);
}

}  // namespace btms
