// Maps from files, with progress.

#include <chrono>
#include <mutex>
#include <thread>

#include "apps/btms/continuation.h"
#include "apps/btms/reference_system.h"
#include "apps/python/module.h"
#include "engine/error.h"
#include "engine/tiling/build.h"
#include "io/points/point_file.h"
#include "io/store/map_store.h"

namespace btms::python {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// Calls Python ten times a second at most, and stops the build when Python says False, raises, or is interrupted.
class CallbackProgress final : public Progress {
 public:
  explicit CallbackProgress(py::object callback) : callback_(std::move(callback)) {}

  void begin(std::string_view phase, std::uint64_t total, std::string_view) override {
    const std::lock_guard lock(mutex_);
    phase_ = phase;
    total_ = total;
    done_ = 0;
  }
  void advance(std::uint64_t done) override {
    const std::lock_guard lock(mutex_);
    done_ += done;
  }
  // Asked on the calling thread, too, which is the one that may call Python.
  bool stop_requested() const override {
    if (stop_ || std::this_thread::get_id() != caller_ || Clock::now() - told_ < std::chrono::milliseconds(100))
      return stop_;
    told_ = Clock::now();
    const auto [phase, done, total] = now();
    const py::gil_scoped_acquire python;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (!callback_.is_none()) stop_ = callback_(phase, done, total).is(py::bool_(false));
    } catch (py::error_already_set& error) {
      raised_ = std::make_unique<py::error_already_set>(error);
      stop_ = true;
    }
    return stop_;
  }
  void rethrow() const {
    if (raised_) throw py::error_already_set(*raised_);
  }

 private:
  std::tuple<std::string, std::uint64_t, std::uint64_t> now() const {
    const std::lock_guard lock(mutex_);
    return {phase_, done_, total_};
  }
  const py::object callback_;
  const std::thread::id caller_ = std::this_thread::get_id();
  mutable std::mutex mutex_;
  std::string phase_;
  std::uint64_t done_ = 0, total_ = 0;
  mutable Clock::time_point told_{};
  mutable std::atomic<bool> stop_{false};
  mutable std::unique_ptr<py::error_already_set> raised_;
};

struct Built {
  BuildSummary summary;
  std::vector<std::string> warnings;
};

Built build(const std::vector<std::string>& inputs, const fs::path& output, const std::string& preset_name,
            const Parameters& parameters, const std::string& crs, int threads, std::uint64_t memory_bytes,
            CallbackProgress& progress) {
  Built built;
  const InputList list = expand_inputs(inputs);
  PointFiles files = open_all(list.paths);
  built.warnings = list.warnings;
  MapInfo info;
  info.crs_wkt = agree_on_crs(files, {crs, {}}, built.warnings);
  info.crs_given = !crs.empty();
  info.parameters = parameters;
  info.preset = preset_name;
  std::vector<const PointSource*> sources;
  for (const auto& file : files) {
    sources.push_back(file.get());
    info.inputs.push_back(input_record(*file, output));
  }
  BuildOptions options;
  options.parameters = parameters;
  options.spill_folder = output.has_parent_path() ? output.parent_path() : fs::path(".");
  if (memory_bytes > 0) options.memory_bytes = memory_bytes;
  std::unique_ptr<MapWriter> writer;
  const auto sink = [&](const MapLayout& layout) -> TileSink& {
    writer = MapWriter::create(output, layout, {.crs = info.crs_wkt});
    return *writer;
  };
  const auto runner = threads == 1 ? serial_threads() : tbb_threads(threads);
  const auto rank = single_rank();
  built.summary = build_map(sources, options, *runner, *rank, sink, progress);
  const auto entries = writer->finish();
  info.layout = built.summary.layout;
  info.digest = built.summary.digest;
  info.points = built.summary.points;
  info.dropped = built.summary.not_finite + built.summary.out_of_range + built.summary.strays;
  writer->publish(info, {entries});
  return built;
}

py::dict summary_dict(const Built& built) {
  const BuildSummary& s = built.summary;
  py::dict nodes, phases;
  for (const auto& [name, n] : {std::pair{"observed", s.observed},
                                {"predicted", s.predicted},
                                {"obstacle", s.obstacle},
                                {"filled", s.filled},
                                {"unknown", s.unknown}})
    nodes[name] = n;
  for (const PhaseTime& phase : s.phases) phases[py::str(phase.phase)] = phase.seconds;
  py::dict dict;
  dict["digest"] = s.digest.hex();
  dict["points"] = s.points;
  dict["dropped"] = s.not_finite + s.out_of_range + s.strays;
  dict["tiles"] = s.tiles;
  dict["nodes"] = nodes;
  dict["seconds"] = phases;
  dict["warnings"] = built.warnings;
  return dict;
}

}  // namespace

void add_build(py::module_& module) {
  module.def(
      "build",
      [](const py::object& inputs, const fs::path& output, const std::string& preset_name, const std::string& crs,
         int threads, std::uint64_t memory_bytes, const py::object& progress, const py::kwargs& changes) {
        std::vector<std::string> paths;
        if (py::isinstance<py::str>(inputs) || py::hasattr(inputs, "__fspath__"))
          paths.push_back(py::str(inputs).cast<std::string>());
        else
          for (const auto& input : inputs) paths.push_back(py::str(input).cast<std::string>());
        Parameters p = preset(preset_name);
        for (const auto& [key, value] : changes)
          set_parameter(p, py::str(key).cast<std::string>(), py::str(value).cast<std::string>());
        check(p);
        CallbackProgress told(progress);
        Built built;
        try {
          const py::gil_scoped_release others;
          const int count = threads > 0 ? threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
          built = build(paths, output, preset_name, p, crs, count, memory_bytes, told);
        } catch (const Error&) {
          told.rethrow();
          throw;
        }
        return summary_dict(built);
      },
      py::arg("inputs"), py::arg("output"), py::kw_only(), py::arg("preset") = "city", py::arg("crs") = "",
      py::arg("threads") = 0, py::arg("memory_bytes") = 0, py::arg("progress") = py::none(),
      "Builds a map of point files, folders or globs, as `btms build` does with the same parameters: the digest is "
      "the\n"
      "same. `progress(phase, done, total)` is called while it works; when it returns False the build stops and "
      "nothing\n"
      "changes. Parameters of the preset can be given by name: build('tiles/', 'city.btms', resolution_m=1).\n"
      "Returns what was built: digest, points, tiles, nodes, seconds a phase, warnings.");
}

}  // namespace btms::python
