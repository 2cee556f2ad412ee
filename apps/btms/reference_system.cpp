#include "apps/btms/reference_system.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>

#include "engine/error.h"
#include "io/crs/crs.h"
#include "io/crs/crs_units.h"

namespace btms {
namespace {

// PROJ would also look a text up among names, and find something for many a slip of the pen.
std::string code_or_wkt(const std::string& text) {
  const auto all_digits = [](std::string_view s) {
    return !s.empty() && s.find_first_not_of("0123456789") == std::string_view::npos;
  };
  if (all_digits(text)) return "EPSG:" + text;
  const std::size_t colon = text.find(':');
  const bool is_code = colon != std::string::npos && colon > 0 && colon + 1 < text.size();
  if (is_code || text.find('[') != std::string::npos) return text;
  throw Error(ErrorCode::kUsage, fmt::format("--crs: found `{}`, expected EPSG:n or WKT", text));
}

void warn_of_contradictions(const PointFiles& files, const std::string& crs, std::vector<std::string>& warnings) {
  std::map<std::string, bool> agrees;  // tiles of one survey repeat the same text
  for (const auto& file : files) {
    const std::string& stated = file->info().crs;
    if (stated.empty() || !agrees.try_emplace(stated, same_horizontal_crs(stated, crs)).second || agrees[stated])
      continue;
    warnings.push_back(
        fmt::format("{}: declares the coordinate reference system {}, but --crs says {}; --crs wins, "
                    "coordinates are not converted",
                    file->name(), crs_title(stated), crs_title(crs)));
  }
}

// Metres between two boxes on the plane.
double gap_m(const std::array<double, 6>& a, const std::array<double, 6>& b) {
  const auto along = [&](std::size_t i) { return std::max({0.0, a[i] - b[i + 3], b[i] - a[i + 3]}); };
  return std::max(along(0), along(1));
}

// Walks from the first file to all that are near one already reached; a long corridor of tiles is no oddity.
void warn_of_distance(const PointFiles& files, std::vector<std::string>& warnings) {
  constexpr double kFar_m = 100'000;
  std::vector<const PointFile*> left, reached;
  for (const auto& file : files)
    if (file->info().declared_bounds_m) left.push_back(file.get());
  if (left.empty()) return;
  reached.push_back(left.front());
  left.erase(left.begin());
  for (std::size_t i = 0; i < reached.size(); ++i) {
    const auto near = [&](const PointFile* f) {
      return gap_m(*f->info().declared_bounds_m, *reached[i]->info().declared_bounds_m) <= kFar_m;
    };
    const auto rest = std::stable_partition(left.begin(), left.end(), [&](const PointFile* f) { return !near(f); });
    reached.insert(reached.end(), rest, left.end());
    left.erase(rest, left.end());
  }
  if (!left.empty())
    warnings.push_back(
        fmt::format("{} and {} are more than 100 km apart and name no coordinate reference system: are "
                    "they in the same one?",
                    reached.front()->name(), left.front()->name()));
}

}  // namespace

std::string crs_title(const std::string& text) {
  if (text.empty()) return "not named";
  const std::size_t open = text.find('"'), close = text.find('"', open + 1);
  if (close == std::string::npos) return text;
  std::string title = text.substr(open + 1, close - open - 1);
  constexpr std::string_view kId = "ID[\"EPSG\",";
  const std::size_t id = text.rfind(kId), end = text.find(']', id);
  if (id != std::string::npos && end + 2 == text.size())
    title += " (EPSG:" + text.substr(id + kId.size(), end - id - kId.size()) + ")";
  return title;
}

std::string metric_crs(const std::string& text) {
  if (text.empty()) return {};
  const Crs crs = describe_crs(code_or_wkt(text));
  if (crs.is_geographic || crs.linear_unit_m != 1)
    throw Error(ErrorCode::kUsage,
                fmt::format("--crs {}: its unit is not the metre, but the map's coordinates are metres; "
                            "name a projected system in metres",
                            text));
  return crs.wkt;
}

std::vector<std::string> convert_to(PointFiles& files, const std::string& crs) {
  if (crs.empty()) return {};
  struct Converted {
    std::string first;
    std::size_t files = 0;
  };
  std::map<std::string, Converted> converted;  // by what they named
  std::map<std::string, bool> fits;            // tiles of one survey repeat the same text
  for (auto& file : files) {
    const std::string stated = file->info().crs;
    if (stated.empty()) continue;
    const auto [entry, is_new] = fits.try_emplace(stated, true);
    if (is_new) entry->second = same_horizontal_crs(stated, crs);
    if (entry->second) continue;
    Converted& kind = converted[stated];
    if (kind.files++ == 0) kind.first = file->name();
    file = open_points(file->path(), {.crs = crs, .columns = {}});
  }
  std::vector<std::string> said;
  for (const auto& [stated, kind] : converted)
    said.push_back(fmt::format("{}{}: converted from {} to {}", kind.first,
                               kind.files > 1 ? fmt::format(" and {} more", kind.files - 1) : "",
                               crs_title(normalise_crs(stated)), crs_title(crs)));
  return said;
}

std::string agree_on_crs(PointFiles& files, const CrsChoice& choice, std::vector<std::string>& warnings) {
  if (!choice.taken_to_be.empty()) {
    const std::string crs = metric_crs(choice.taken_to_be);
    warn_of_contradictions(files, crs, warnings);
    return crs;
  }
  std::map<std::string, bool> is_sound;  // tiles of one survey repeat the same text
  const PointFile* named = nullptr;
  const PointFile* unnamed = nullptr;
  const PointFile* with_heights = nullptr;
  for (const auto& file : files) {
    const std::string& stated = file->info().crs;
    const auto [entry, is_new] = is_sound.try_emplace(stated, !stated.empty());
    if (is_new && entry->second) {
      try {
        describe_crs(stated);
      } catch (const Error& error) {
        entry->second = false;
        warnings.push_back(
            fmt::format("{}: its coordinate reference system is left out: {}", file->name(), error.what()));
      }
    }
    if (!entry->second) {
      unnamed = file.get();
      continue;
    }
    if (named == nullptr) named = file.get();
    if (vertical_system(stated).empty()) continue;
    if (with_heights == nullptr) with_heights = file.get();
    if (vertical_system(stated) != vertical_system(with_heights->info().crs))
      throw Error(
          ErrorCode::kBadInput,
          fmt::format("{} and {} measure heights above different surfaces ({}, {}); convert one of them, or say "
                      "with --crs EPSG:n which system holds for all",
                      with_heights->name(), file->name(), vertical_system(with_heights->info().crs),
                      vertical_system(stated)));
  }
  if (named != nullptr && unnamed != nullptr)
    warnings.push_back(fmt::format("{} names no coordinate reference system; taken to be in that of {}",
                                   unnamed->name(), named->name()));
  if (unnamed != nullptr) warn_of_distance(files, warnings);
  std::string crs =
      choice.converted_to.empty() ? (named ? normalise_crs(named->info().crs) : "") : metric_crs(choice.converted_to);
  if (with_heights != nullptr) {
    if (vertical_system(crs).empty())
      crs = normalise_crs(with_heights_of(crs, with_heights->info().crs));
    else if (vertical_system(crs) != vertical_system(with_heights->info().crs))
      throw Error(ErrorCode::kUsage,
                  fmt::format("heights stay what they are: above {} by {}, not {}",
                              vertical_system(with_heights->info().crs), with_heights->name(), vertical_system(crs)));
  }
  for (std::string& sentence : convert_to(files, crs)) warnings.push_back(std::move(sentence));
  return crs;
}

}  // namespace btms
