// The architecture as a test: includes point downwards, and a library's header has one home.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

struct Include {
  std::string file;    // "engine/tiling/build.cpp"
  std::string header;  // "engine/error.h", "tbb/parallel_for.h"
};

std::vector<Include> all_includes() {
  const std::regex line_rule(R"re(^\s*#\s*include\s*[<"]([^>"]+)[>"].*)re");
  const fs::path root(BTMS_SOURCE_DIR);
  std::vector<Include> includes;
  for (const char* layer : {"engine", "io", "apps"})
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / layer)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".h" && extension != ".cpp") continue;
      std::ifstream file(entry.path());
      std::smatch match;
      for (std::string line; std::getline(file, line);)
        if (std::regex_match(line, match, line_rule))
          includes.push_back({fs::relative(entry.path(), root).string(), match[1]});
    }
  return includes;
}

// "engine/tiling" for "engine/tiling/build.h", "engine" for "engine/error.h".
std::string folder_of(const std::string& path) { return path.substr(0, path.find_last_of('/')); }
std::string layer_of(const std::string& path) { return path.substr(0, path.find('/')); }

// Folders a folder may include, itself always; headers in engine/ itself are everyone's.
const std::map<std::string, std::set<std::string>>& allowed() {
  static const std::map<std::string, std::set<std::string>> rules = {
      {"engine", {}},
      {"engine/lattice", {}},
      {"engine/terrain", {"engine/lattice"}},
      {"engine/model", {"engine/lattice", "engine/terrain"}},
      {"engine/tiling", {"engine/lattice", "engine/terrain", "engine/model"}},
      {"engine/query", {"engine/lattice", "engine/terrain", "engine/model"}},
      {"engine/routing", {"engine/lattice", "engine/terrain", "engine/model", "engine/query"}},
      {"engine/metrics", {"engine/lattice", "engine/model"}},
      {"engine/scenes", {"engine/lattice"}},
      {"engine/accumulation", {"engine/lattice", "engine/terrain", "engine/tiling"}},
  };
  return rules;
}

TEST(Layers, IncludesPointDownwards) {
  const std::map<std::string, int> height = {{"engine", 0}, {"io", 1}, {"apps", 2}};
  const auto includes = all_includes();
  ASSERT_GT(includes.size(), 100u) << "the sources were not found";
  for (const Include& i : includes) {
    const auto target = height.find(layer_of(i.header));
    if (target == height.end() || i.header.find('/') == std::string::npos) continue;
    EXPECT_LE(target->second, height.at(layer_of(i.file))) << i.file << " includes " << i.header;
  }
}

TEST(Layers, InsideTheEngineLatticeTerrainModelTiling) {
  for (const Include& i : all_includes()) {
    if (layer_of(i.file) != "engine" || layer_of(i.header) != "engine") continue;
    const std::string from = folder_of(i.file), to = folder_of(i.header);
    if (from == to || to == "engine") continue;
    const auto rule = allowed().find(from);
    ASSERT_NE(rule, allowed().end()) << from << " is a new folder: say above what it may include";
    EXPECT_TRUE(rule->second.contains(to)) << i.file << " includes " << i.header;
  }
}

// Where each library's header is included.
std::set<std::string> homes(const std::regex& header, bool by_file) {
  std::set<std::string> places;
  for (const Include& i : all_includes())
    if (std::regex_search(i.header, header)) places.insert(by_file ? i.file : folder_of(i.file));
  return places;
}

TEST(Layers, ALibraryHeaderHasOneHome) {
  const std::pair<const char*, std::regex> libraries[] = {
      {"oneTBB", std::regex("^(tbb|oneapi)/")},
      {"HDF5", std::regex("^(hdf5|hdf5_hl|H5.*)\\.h$")},
      {"nanoflann", std::regex("^nanoflann\\.hpp$")},
  };
  for (const auto& [name, header] : libraries) {
    const auto places = homes(header, false);
    EXPECT_LE(places.size(), 1u) << name << " is included in " << testing::PrintToString(places);
  }
  // The server and its client: no one else talks to strangers.
  for (const std::string& place : homes(std::regex("^boost/"), false))
    EXPECT_TRUE(place == "apps/server" || place == "io/client") << "Boost is included in " << place;
  const auto sockets = homes(std::regex("^sys/socket\\.h$"), true);
  EXPECT_LE(sockets.size(), 1u) << "sockets are used in " << testing::PrintToString(sockets);
}

}  // namespace
