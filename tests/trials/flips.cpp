// Wrong bytes are never served as terrain: a map is damaged in every way that disks know, and each time it is either
// noticed, by a message that names the tile or the file, or changes no answer. Then shards are forged by somebody who
// makes every hash right again, and opened as an unknown author's map is. Every attempt runs in a child process: one
// that crashes or hangs is a failed trial.
#include <hdf5.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <functional>
#include <map>
#include <random>

#include "engine/error.h"
#include "engine/model/surface.h"
#include "io/store/hash.h"
#include "io/store/map_check.h"
#include "io/store/map_folder.h"
#include "tests/cli/program.h"

namespace btms {
namespace {

namespace fs = std::filesystem;
using test::read_text;
using test::write_text;
using Random = std::mt19937_64;

constexpr unsigned kMost_s = 60;  // an attempt that takes longer hangs
constexpr int kQueries = 300;

// How an attempt ended, as the child says by its exit status.
enum class End { kHarmless = 0, kDetected = 10, kContained, kUnnamed, kWrong, kCrash, kHang };

struct Totals {
  std::map<End, int> ends;
  int attempts = 0;
  int of(End end) const {
    const auto at = ends.find(end);
    return at == ends.end() ? 0 : at->second;
  }
  int bad() const { return attempts - of(End::kHarmless) - of(End::kDetected) - of(End::kContained); }
};

const char* name_of(End end) {
  switch (end) {
    case End::kHarmless:
      return "harmless";
    case End::kDetected:
      return "detected";
    case End::kContained:
      return "broke the sandboxed reader";
    case End::kUnnamed:
      return "DETECTED WITHOUT A NAME";
    case End::kWrong:
      return "WRONG";
    case End::kCrash:
      return "CRASH";
    case End::kHang:
      return "HANG";
  }
  return "?";
}

// What the undamaged map says.
struct Truth {
  Digest digest;
  std::vector<std::array<double, 2>> places;
  std::vector<SurfacePoint> answers;
};

bool same(const SurfacePoint& a, const SurfacePoint& b) {
  return a.state == b.state && a.z_m == b.z_m && a.sd_m == b.sd_m && a.weight == b.weight && a.count == b.count &&
         a.cost == b.cost && a.clearance_m == b.clearance_m && a.step_m == b.step_m && a.roughness_m == b.roughness_m;
}

Truth truth_of(const fs::path& folder, Random& random) {
  const auto map = MapReader::open(folder);
  Truth truth;
  CellBox box;
  for (const TileId id : map->tiles()) {
    const auto tile = map->load(id);
    truth.digest += digest(*tile);
    box = box.hull(tile->box);
  }
  const double r = map->layout().lattice.resolution_m();
  std::uniform_real_distribution<double> x(box.col0 * r, box.col1 * r), y(box.row0 * r, box.row1 * r);
  for (int i = 0; i < kQueries; ++i) truth.places.push_back({x(random), y(random)});
  // By tile, so that a reader decodes each once.
  std::sort(truth.places.begin(), truth.places.end());
  for (const auto& [px, py] : truth.places) truth.answers.push_back(surface_at(*map, px, py));
  return truth;
}

// All of a map, read and asked, in memory once.
class LoadedMap final : public TileSource {
 public:
  explicit LoadedMap(const MapReader& map) : layout_(map.layout()) {
    for (const TileId id : map.tiles()) {
      const auto tile = map.load(id);
      digest += btms::digest(*tile);
      tiles_.emplace(id, tile);
    }
  }
  Digest digest;
  const MapLayout& layout() const override { return layout_; }
  std::vector<TileId> tiles() const override { return {}; }
  std::shared_ptr<const TerrainTile> load(TileId id) const override {
    const auto at = tiles_.find(id);
    return at == tiles_.end() ? nullptr : at->second;
  }

 private:
  MapLayout layout_;
  std::map<TileId, std::shared_ptr<const TerrainTile>> tiles_;
};

// Reading and asking: harmless when every answer is the truth's, detected when an error names the damaged file.
End use(const fs::path& folder, const Truth& truth, const std::set<std::string>& damaged, Trust trust) {
  const auto named = [&](const std::string& text) {
    return std::any_of(damaged.begin(), damaged.end(),
                       [&](const std::string& file) { return text.find(file) != std::string::npos; });
  };
  bool noticed = false, contained = false;
  try {
    Progress progress;
    const MapCheck check = check_map(folder, read_manifest(folder), trust, *serial_threads(), *single_rank(), progress);
    noticed = !check.problems.empty();
    for (const MapProblem& p : check.problems) {
      if (!named(p.file)) return End::kUnnamed;
      contained = contained || p.what.find("the sandboxed reader was") != std::string::npos;
    }
  } catch (const Error& e) {
    if (!named(e.what())) return End::kUnnamed;
    noticed = true;
  }
  try {
    const LoadedMap map(*MapReader::open(folder, trust));
    if (map.digest != truth.digest) return End::kWrong;
    for (std::size_t i = 0; i < truth.places.size(); ++i)
      if (!same(surface_at(map, truth.places[i][0], truth.places[i][1]), truth.answers[i])) return End::kWrong;
  } catch (const Error& e) {
    if (!named(e.what())) return End::kUnnamed;
    noticed = true;
  }
  return contained ? End::kContained : noticed ? End::kDetected : End::kHarmless;
}

End run_in_child(const std::function<End()>& attempt) {
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::alarm(kMost_s);
    int status = static_cast<int>(End::kWrong);
    try {
      status = static_cast<int>(attempt());
    } catch (const std::exception& e) {
      std::fprintf(stderr, "flips: %s\n", e.what());
    }
    ::_exit(status);
  }
  int status = 0;
  ::waitpid(pid, &status, 0);
  if (WIFSIGNALED(status)) return WTERMSIG(status) == SIGALRM ? End::kHang : End::kCrash;
  return static_cast<End>(WEXITSTATUS(status));
}

struct MapFile {
  std::string name;  // inside the map
  std::string good;
};

class Trial {
 public:
  Trial(const fs::path& folder, std::uint64_t seed)
      : folder_(folder), random_(seed), truth_(truth_of(folder, random_)) {
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.is_regular_file())
        files_.push_back({fs::relative(entry.path(), folder).string(), read_text(entry.path())});
    std::sort(files_.begin(), files_.end(), [](const MapFile& a, const MapFile& b) { return a.name < b.name; });
  }

  std::uint64_t bytes() const {
    std::uint64_t sum = 0;
    for (const MapFile& file : files_) sum += file.good.size();
    return sum;
  }
  std::size_t files() const { return files_.size(); }
  Totals& totals() { return totals_; }

  // Every second one by size, the others by file.
  void flip_bit() {
    const auto [file, at] = anywhere();
    std::string bad = files_[file].good;
    bad[at] = static_cast<char>(bad[at] ^ (1 << random_() % 8));
    attempt("a flipped bit", {{file, bad}});
  }

  void damage_page() {
    constexpr std::size_t kPage = 4096;
    const auto [file, at] = anywhere();
    std::string bad = files_[file].good;
    const std::size_t page = at / kPage * kPage, n = std::min(kPage, bad.size() - page);
    switch (random_() % 3) {
      case 0:
        std::fill_n(bad.begin() + static_cast<std::ptrdiff_t>(page), n, '\0');
        break;
      case 1:
        std::fill_n(bad.begin() + static_cast<std::ptrdiff_t>(page), n, '\xff');
        break;
      default: {  // swapped with another page, maybe of another file
        const auto [other, where] = anywhere();
        const std::string& source = files_[other].good;
        const std::size_t from = where / kPage * kPage, m = std::min({kPage, source.size() - from, n});
        std::string bad_other = other == file ? bad : source;
        for (std::size_t i = 0; i < m; ++i) {
          char& a = bad[page + i];
          char& b = other == file ? bad[from + i] : bad_other[from + i];
          std::swap(a, b);
        }
        if (other != file) return attempt("swapped pages", {{file, bad}, {other, bad_other}});
        return attempt("swapped pages", {{file, bad}});
      }
    }
    attempt("a page of 00 or FF", {{file, bad}});
  }

  void swap_files() {
    const std::size_t a = random_() % files_.size(), b = random_() % files_.size();
    attempt("swapped files", {{a, files_[b].good}, {b, files_[a].good}});
  }

  void cut_file() {
    const auto [file, at] = anywhere();
    attempt("a file cut off", {{file, files_[file].good.substr(0, at)}});
  }

  void remove_file() {
    const std::size_t file = random_() % files_.size();
    attempt("a file gone", {{file, {}}}, true);
  }

  // A shard changed at will by somebody who then makes all hashes right. Every second time in the format of HDF5 before
  // 1.10, which has no checksums that would keep its parser from what was changed.
  void forge(const std::vector<std::string>& old_format) {
    std::vector<std::size_t> shards;
    for (std::size_t f = 0; f < files_.size(); ++f)
      if (files_[f].name.starts_with(kShardFolder)) shards.push_back(f);
    const std::size_t pick = random_() % shards.size(), file = shards[pick];
    std::string bad = random_() % 2 == 0 ? files_[file].good : old_format[pick];
    mutate(bad);
    Manifest manifest = read_manifest(folder_);
    for (ShardEntry& shard : manifest.shards)
      if (files_[file].name == std::string(kShardFolder) + "/" + shard.file) {
        shard.bytes = bad.size();
        shard.file_xxh3 = xxh3_64({reinterpret_cast<const std::uint8_t*>(bad.data()), bad.size()});
      }
    const auto manifest_file =
        std::find_if(files_.begin(), files_.end(), [](const MapFile& f) { return f.name == kManifest; });
    attempt("a forged shard",
            {{file, bad}, {static_cast<std::size_t>(manifest_file - files_.begin()), manifest_text(manifest)}}, false,
            Trust::kUntrusted);
  }

  void print_state(int done, int of) const {
    std::printf("%d of %d", done, of);
    for (const auto& [end, count] : totals_.ends) std::printf(", %d %s", count, name_of(end));
    std::printf("\n");
    std::fflush(stdout);
  }

 private:
  using Changes = std::map<std::size_t, std::string>;  // file, its new bytes

  std::pair<std::size_t, std::size_t> anywhere() {
    std::size_t file = random_() % files_.size();
    if (random_() % 2 == 0) {
      std::uint64_t at = random_() % bytes();
      for (file = 0; at >= files_[file].good.size(); ++file) at -= files_[file].good.size();
    }
    return {file, random_() % files_[file].good.size()};
  }

  void mutate(std::string& bytes) {
    const std::size_t head = std::min<std::size_t>(bytes.size(), random_() % 4 == 0 ? bytes.size() : 16384);
    switch (random_() % 4) {
      case 0:  // wild bytes
        for (std::uint64_t n = 1 + random_() % 8; n > 0; --n) bytes[random_() % head] = static_cast<char>(random_());
        break;
      case 1: {  // extreme numbers
        constexpr std::uint64_t kExtreme[] = {0, 1, 0x7f, 0xff, 0xffff, 0x7fffffff, 0xffffffff, INT64_MAX, UINT64_MAX};
        const std::uint64_t value = kExtreme[random_() % std::size(kExtreme)];
        const std::size_t size = std::size_t{1} << random_() % 4;
        std::memcpy(bytes.data() + random_() % (head - 8), &value, size);
        break;
      }
      case 2:  // cut off
        bytes.resize(1 + random_() % bytes.size());
        break;
      default: {  // a piece moved
        const std::size_t n = 1 + random_() % 512, from = random_() % (head - n), to = random_() % (head - n);
        std::memmove(bytes.data() + to, bytes.data() + from, n);
      }
    }
  }

  void attempt(const char* what, const Changes& changes, bool gone = false, Trust trust = Trust::kTrusted) {
    std::set<std::string> damaged;
    for (const auto& [file, bytes] : changes) {
      if (bytes == files_[file].good && !gone) continue;
      damaged.insert(files_[file].name);
      fs::remove(folder_ / files_[file].name);
      if (!gone) write_text(folder_ / files_[file].name, bytes);
    }
    const End end = run_in_child([&] { return use(folder_, truth_, damaged, trust); });
    ++totals_.attempts;
    ++totals_.ends[end];
    if (end == End::kUnnamed || end == End::kWrong || end == End::kCrash || end == End::kHang) {
      std::printf("%s: %s:", name_of(end), what);
      for (const std::string& file : damaged) std::printf(" %s", file.c_str());
      std::printf(" (attempt %d)\n", totals_.attempts);
    }
    for (const auto& entry : changes) {
      fs::remove(folder_ / files_[entry.first].name);
      write_text(folder_ / files_[entry.first].name, files_[entry.first].good);
    }
  }

  const fs::path folder_;
  Random random_;
  const Truth truth_;
  std::vector<MapFile> files_;
  Totals totals_;
};

// The same datasets, written by HDF5 as it was before 1.10; nobody needs their attributes.
std::string in_old_format(const fs::path& shard, const fs::path& scratch) {
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  H5Pset_libver_bounds(access, H5F_LIBVER_EARLIEST, H5F_LIBVER_V18);
  const hid_t from = H5Fopen(shard.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  hid_t to = H5Fcreate(scratch.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
  const auto copy = [](hid_t root, const char* name, const H5O_info_t* info, void* target) -> herr_t {
    const hid_t file = *static_cast<hid_t*>(target);
    if (std::string_view(name) == ".") return 0;
    if (info->type == H5O_TYPE_GROUP) return H5Gclose(H5Gcreate2(file, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    const hid_t data = H5Dopen2(root, name, H5P_DEFAULT), type = H5Dget_type(data), space = H5Dget_space(data);
    // Its layout has a version, so the properties are made anew.
    const hid_t had = H5Dget_create_plist(data), properties = H5Pcreate(H5P_DATASET_CREATE);
    if (H5Pget_layout(had) == H5D_CHUNKED) {
      hsize_t chunk[3];
      H5Pset_chunk(properties, H5Pget_chunk(had, 3, chunk), chunk);
      if (H5Tget_size(type) > 1) H5Pset_shuffle(properties);
      H5Pset_deflate(properties, 1);
      H5Pset_fletcher32(properties);
    }
    std::vector<char> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)) * H5Tget_size(type));
    const hid_t copied = H5Dcreate2(file, name, type, space, H5P_DEFAULT, properties, H5P_DEFAULT);
    herr_t good = H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    if (good >= 0) good = H5Dwrite(copied, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    H5Dclose(copied), H5Pclose(properties), H5Pclose(had), H5Sclose(space), H5Tclose(type), H5Dclose(data);
    return good;
  };
  const herr_t good = H5Ovisit(from, H5_INDEX_NAME, H5_ITER_INC, copy, &to);
  H5Fclose(to), H5Fclose(from), H5Pclose(access);
  if (good < 0) throw std::runtime_error("HDF5 could not write the old format");
  return read_text(scratch);
}

struct Counts {
  int bits = 10000, pages = 1000, forged = 1000;
  std::uint64_t seed = 1;
};

int run(const Counts& counts) {
  const test::TempFolder temporary;
  const std::string points = temporary / "city", map = temporary / "city.btms";
  if (test::run({"synth", "--scene", "city", "--points", "180000", "--origin", "60,30", "-o", points, "-q"}).status !=
          0 ||
      test::run({"build", points, "-o", map, "--resolution", "4", "--tile-cells", "2", "-q"}).status != 0) {
    std::printf("could not make a map to damage\n");
    return 1;
  }
  Trial trial(map, counts.seed);
  std::printf("a map of %zu tiles in %zu files, %.0f kB; seed %llu\n", MapReader::open(map)->tiles().size(),
              trial.files(), static_cast<double>(trial.bytes()) / 1000, static_cast<unsigned long long>(counts.seed));
  const auto begun = std::chrono::steady_clock::now();
  const int damages = counts.bits + counts.pages + counts.pages / 10, all = damages + counts.forged;
  int done = 0;
  const auto tick = [&] {
    if (++done % 500 == 0) trial.print_state(done, all);
  };
  for (int i = 0; i < counts.bits; ++i, tick()) trial.flip_bit();
  for (int i = 0; i < counts.pages; ++i, tick()) trial.damage_page();
  for (int i = 0; i < counts.pages / 10; ++i, tick()) {
    if (i % 3 == 0) trial.swap_files();
    if (i % 3 == 1) trial.cut_file();
    if (i % 3 == 2) trial.remove_file();
  }
  const Totals damage = std::exchange(trial.totals(), {});
  std::vector<std::string> old_format;
  for (const ShardEntry& shard : read_manifest(map).shards)
    old_format.push_back(in_old_format(fs::path(map) / kShardFolder / shard.file, temporary / "old.nc"));
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  for (int i = 0; i < counts.forged; ++i, tick()) trial.forge(old_format);
  const Totals& forged = trial.totals();
  const auto seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  std::printf(
      "damage: %d attempts: %d detected, %d harmless, %d failed; forged shards: %d attempts: %d detected, of "
      "which %d broke the sandboxed reader, %d harmless, %d failed; %.0f s\n",
      damage.attempts, damage.of(End::kDetected), damage.of(End::kHarmless), damage.bad(), forged.attempts,
      forged.of(End::kDetected) + forged.of(End::kContained), forged.of(End::kContained), forged.of(End::kHarmless),
      forged.bad(), seconds);
  return damage.bad() + forged.bad() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace btms

int main(int argc, char** argv) {
  btms::Counts counts;
  CLI::App app("Damages a small map in many ways: each must be noticed, or change no answer.", "trial_flips");
  app.add_option("bits", counts.bits, "Single bits flipped")->capture_default_str();
  app.add_option("pages", counts.pages, "Pages set to 00 or FF, or swapped; and a tenth of that whole files")
      ->capture_default_str();
  app.add_option("forged", counts.forged, "Shards forged, every hash right again, opened as untrusted")
      ->capture_default_str();
  app.add_option("--seed", counts.seed, "Other numbers, other damage")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return btms::run(counts);
}
