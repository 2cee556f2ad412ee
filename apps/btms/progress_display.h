// Draws the engine's progress on stderr: phase, share done, rate, time left, memory. With a plan, share and time left
// are those of the whole run.
#pragma once

#include <atomic>

#include <chrono>
#include <mutex>
#include <string>

#include "apps/btms/run_plan.h"
#include "engine/tiling/progress.h"

namespace btms {

enum class ProgressStyle {
  kBar,    // one line, redrawn in place
  kLines,  // a line every few seconds, and one per finished phase that lasted
  kJson,   // the same as JSON objects, one a line
  kNone,
};

// Starts no thread: it draws from within advance(), so it can be made before ranks are forked.
class ProgressDisplay final : public Progress {
 public:
  explicit ProgressDisplay(ProgressStyle style, RunPlan plan = {});
  ~ProgressDisplay() override { finish(); }
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  void begin(std::string_view phase, std::uint64_t total, std::string_view unit) override;
  void advance(std::uint64_t done) override;
  bool stop_requested() const override;

  // Ends the last phase and leaves the line clean for what is printed next.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;

  void draw(bool last);
  void end_phase();
  void find_step();
  // Of the whole run where there is a plan, else of the phase; `phase_share` of the phase is done.
  double share_done(double phase_share) const;

  const ProgressStyle style_;
  const RunPlan plan_;
  double planned_ = 0;  // sum of its weights
  std::atomic<std::uint64_t> done_{0};
  std::mutex mutex_;  // guards what follows
  std::string phase_, unit_;
  std::uint64_t total_ = 0;
  std::size_t steps_begun_ = 0;  // of the plan
  bool in_plan_ = false;         // the phase is the last of these
  double behind_ = 0;            // weights of the steps before
  Clock::time_point run_begun_{}, begun_{}, drawn_{};
};

}  // namespace btms
