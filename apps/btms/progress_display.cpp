#include "apps/btms/progress_display.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>

#include "apps/btms/report.h"
#include "apps/btms/stop_signal.h"

namespace btms {
namespace {

constexpr std::chrono::milliseconds kBarEvery{100};
constexpr std::chrono::milliseconds kJsonEvery{1000};
constexpr std::chrono::milliseconds kLineEvery{5000};
constexpr double kShortPhase_s = 1.0;  // shorter phases get no closing line
constexpr int kBarWidth = 24;
// Steps of a plan that a run may leave out. Less than a round, whose phases come again under the same names.
constexpr std::ptrdiff_t kLookAhead = 4;

std::string bar(double share) {
  const int filled = static_cast<int>(share * kBarWidth);
  return '[' + std::string(static_cast<std::size_t>(filled), '#') +
         std::string(static_cast<std::size_t>(kBarWidth - filled), '.') + ']';
}

std::string duration_text(double seconds) {
  const auto s = static_cast<long>(seconds + 0.5);
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{}:{:02} min", s / 60, s % 60);
  return fmt::format("{}:{:02} h", s / 3600, s / 60 % 60);
}

void put(const std::string& text) {
  std::fputs(text.c_str(), stderr);
  std::fflush(stderr);
}

}  // namespace

ProgressDisplay::ProgressDisplay(ProgressStyle style, RunPlan plan)
    : style_(style), plan_(std::move(plan)), run_begun_(Clock::now()), drawn_(run_begun_) {
  for (const PlannedPhase& phase : plan_) planned_ += phase.weight;
}

void ProgressDisplay::begin(std::string_view phase, std::uint64_t total, std::string_view unit) {
  const std::lock_guard lock(mutex_);
  end_phase();
  phase_ = phase;
  unit_ = unit;
  total_ = total;
  done_ = 0;
  begun_ = Clock::now();
  find_step();
}

void ProgressDisplay::find_step() {
  const auto from = plan_.begin() + static_cast<std::ptrdiff_t>(steps_begun_);
  const auto to = from + std::min<std::ptrdiff_t>(kLookAhead, plan_.end() - from);
  const auto step = std::find_if(from, to, [&](const PlannedPhase& p) { return p.name == phase_; });
  in_plan_ = step != to;
  if (!in_plan_) return;
  steps_begun_ = static_cast<std::size_t>(step - plan_.begin()) + 1;
  behind_ = std::accumulate(plan_.begin(), step, 0.0, [](double sum, const PlannedPhase& p) { return sum + p.weight; });
}

double ProgressDisplay::share_done(double phase_share) const {
  if (plan_.empty()) return phase_share;
  if (steps_begun_ == 0) return 0;
  return (behind_ + plan_[steps_begun_ - 1].weight * (in_plan_ ? phase_share : 1)) / planned_;
}

void ProgressDisplay::advance(std::uint64_t done) {
  done_.fetch_add(done, std::memory_order_relaxed);
  if (style_ == ProgressStyle::kNone) return;
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock.owns_lock()) return;  // someone is drawing already
  const auto every = style_ == ProgressStyle::kBar    ? kBarEvery
                     : style_ == ProgressStyle::kJson ? kJsonEvery
                                                      : kLineEvery;
  if (Clock::now() - drawn_ >= every) draw(false);
}

bool ProgressDisplay::stop_requested() const { return stop_signalled(); }

void ProgressDisplay::finish() {
  const std::lock_guard lock(mutex_);
  end_phase();
  phase_.clear();
}

void ProgressDisplay::end_phase() {
  if (phase_.empty() || style_ == ProgressStyle::kNone) return;
  if (style_ == ProgressStyle::kBar) return put("\r\033[K");
  if (Clock::now() - begun_ >= std::chrono::duration<double>(kShortPhase_s) || style_ == ProgressStyle::kJson)
    draw(true);
}

void ProgressDisplay::draw(bool last) {
  drawn_ = Clock::now();
  const double seconds = std::chrono::duration<double>(drawn_ - begun_).count();
  const std::uint64_t done = done_.load(std::memory_order_relaxed);
  const double phase_share = total_ == 0 ? 1.0 : std::min(1.0, static_cast<double>(done) / static_cast<double>(total_));
  const double rate = seconds > 0 ? static_cast<double>(done) / seconds : 0;
  const double share = share_done(phase_share);
  const double run_seconds = plan_.empty() ? seconds : std::chrono::duration<double>(drawn_ - run_begun_).count();
  const double left = share > 0 ? run_seconds * (1 - share) / share : 0;
  if (style_ == ProgressStyle::kJson) {
    nlohmann::ordered_json line{{"phase", phase_}};
    if (!plan_.empty()) line.update({{"step", steps_begun_}, {"steps", plan_.size()}});
    line.update({{"done", done},
                 {"total", total_},
                 {"unit", unit_},
                 {"seconds", seconds},
                 {"rate", rate},
                 {"share", share},
                 {"eta_seconds", left},
                 {"rss_bytes", rss_bytes()},
                 {"finished", last}});
    return put(line.dump() + '\n');
  }
  const std::string what = fmt::format("{} {}/s", rounded(rate), unit_);
  const std::string memory = bytes_text(rss_bytes());
  if (style_ == ProgressStyle::kBar)
    return put(fmt::format("\r{:<10} {} {:3.0f} %  {}  ETA {}  {}\033[K", phase_, bar(share), 100 * share, what,
                           duration_text(left), memory));
  if (last)
    return put(
        fmt::format("{}: {} {} in {}, {}, {}\n", phase_, grouped(done), unit_, duration_text(seconds), what, memory));
  const std::string of_run = plan_.empty() ? "" : fmt::format("{:.0f} % of the run, ", 100 * share);
  put(fmt::format("{}: {:.0f} % of {} {}, {}, {}ETA {}, {}\n", phase_, 100 * phase_share, grouped(total_), unit_, what,
                  of_run, duration_text(left), memory));
}

}  // namespace btms
