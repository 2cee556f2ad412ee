#include "io/client/fresh_tiles.h"

#include <algorithm>
#include <limits>
#include <new>
#include <utility>

#include "engine/error.h"

namespace btms {
namespace {

constexpr double kMargin = 0.25;            // of the radius
constexpr std::size_t kMostTiles = 20'000;  // a diff has no more
constexpr std::size_t kBundle_bytes = std::size_t{4} << 20;
constexpr std::size_t kMostBundle = 32;
constexpr std::size_t kChangesKept = 1024;
constexpr int kRounds = 4;
constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr BoxM kEverywhere{-kFar, -kFar, kFar, kFar};

double distance2_m2(Place a, Place b) {
  const double dx = a.x_m - b.x_m, dy = a.y_m - b.y_m;
  return dx * dx + dy * dy;
}

}  // namespace

FreshTiles::FreshTiles(FreshOptions options)
    : options_(std::move(options)), fetcher_(options_.server, options_.map), listener_(options_.server, options_.map) {
  if (!(options_.radius_m > 0 && options_.radius_m <= 1e5) || options_.layers.empty())
    throw Error(ErrorCode::kUsage, "fresh tiles need a radius of up to 100 km and a layer");
  fetch_thread_ = std::thread([this] { fetch(); });
  listen_thread_ = std::thread([this] { listen(); });
}

FreshTiles::~FreshTiles() { stop(); }

void FreshTiles::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  fetcher_.stop();
  listener_.stop();
  if (fetch_thread_.joinable()) fetch_thread_.join();
  if (listen_thread_.joinable()) listen_thread_.join();
}

void FreshTiles::look_again() {
  wanted_ = true;
  changed_.notify_all();
}

void FreshTiles::move_to(Place place) {
  if (!on_plane(place)) throw Error(ErrorCode::kUsage, "a vehicle can't be where no map can be");
  const std::lock_guard lock(mutex_);
  place_ = place;
  const double margin_m = kMargin * options_.radius_m;
  if (snapshot_->number == 0 || distance2_m2(place, snapshot_->centre) > margin_m * margin_m) look_again();
}

std::shared_ptr<const TileSnapshot> FreshTiles::snapshot() const {
  const std::lock_guard lock(mutex_);
  return snapshot_;
}

Freshness FreshTiles::freshness() const {
  const std::lock_guard lock(mutex_);
  const double age_s = confirmed_ ? std::chrono::duration<double>(Clock::now() - *confirmed_).count() : kFar;
  return {age_s, streaming_, wrong_};
}

bool FreshTiles::wait_until_fresh(std::chrono::milliseconds most) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, most, [&] {
    return stopping_ || (snapshot_->number > 0 && !wanted_ && !fetching_);
  }) && !stopping_;
}

std::shared_ptr<const TileSnapshot> FreshTiles::wait_for_change(const Watch& watch, std::uint64_t after_number,
                                                                std::chrono::milliseconds most) {
  std::unique_lock lock(mutex_);
  std::uint64_t seen = after_number;
  const auto found = [&] {
    if (after_number < forgotten_) return true;
    for (const Change& change : changes_)
      if (change.number > seen && watch.meets(change.box_m)) return true;
    seen = std::max(seen, snapshot_->number);
    return false;
  };
  bool any = false;
  changed_.wait_for(lock, most, [&] { return stopping_ || (any = found()); });
  return any ? snapshot_ : nullptr;
}

// Waits with the lock given up; false when it is time to stop.
bool FreshTiles::pause(std::chrono::milliseconds time) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, time, [&] { return stopping_; });
  return !stopping_;
}

// What is to be brought is brought, or tried again.
void FreshTiles::fetch() {
  std::chrono::milliseconds retry = options_.retry;
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return stopping_ || (wanted_ && place_); });
    if (stopping_) return;
    wanted_ = false;
    fetching_ = true;
    const auto before = snapshot_;
    const Place centre = *place_;
    const bool describe = std::exchange(connected_anew_, false);
    const std::vector<TileId> told = std::exchange(told_, {});
    const bool told_all = std::exchange(told_all_, false);
    const Clock::time_point began = Clock::now();
    lock.unlock();
    std::optional<TileSnapshot> next;
    std::string wrong;
    try {
      TileSnapshot start = *before;
      if (describe || start.number == 0) start.form = form_of_level();
      if (start.form.cell_m != before->form.cell_m) start.tiles.clear();
      next = brought(start, centre);
    } catch (const Error& error) {
      wrong = error.what();
    } catch (const std::bad_alloc&) {
      wrong = kOutOfMemory;
    }
    lock.lock();
    fetching_ = false;
    wrong_ = wrong;
    if (next) {
      confirmed_ = std::max(began, confirmed_.value_or(began));
      retry = options_.retry;
      publish(*std::move(next), told, told_all);
      continue;
    }
    wanted_ = true;
    connected_anew_ = connected_anew_ || describe;
    told_.insert(told_.end(), told.begin(), told.end());
    told_all_ = told_all_ || told_all;
    back_ = false;
    changed_.notify_all();
    changed_.wait_for(lock, retry, [&] { return stopping_ || back_; });
    retry = std::min(2 * retry, options_.longest_retry);
  }
}

TileForm FreshTiles::form_of_level() {
  const MapDescription map = fetcher_.description();
  if (options_.level < 0 || static_cast<std::size_t>(options_.level) >= map.levels.size())
    throw Error(ErrorCode::kUsage, "the map has no level " + std::to_string(options_.level));
  return {options_.level, map.levels[static_cast<std::size_t>(options_.level)].cell_m, options_.layers};
}

// One revision around the centre. The map may change between the diff and the tiles: then once more, with what has
// come already.
TileSnapshot FreshTiles::brought(const TileSnapshot& before, Place centre) {
  TileSnapshot next = before;
  next.centre = centre;
  next.radius_m = (1 + kMargin) * options_.radius_m;
  const std::size_t most = std::min(options_.budget_bytes / tile_bytes(next.form), kMostTiles);
  const std::size_t bundle = std::clamp<std::size_t>(kBundle_bytes / tile_bytes(next.form), 1, kMostBundle);
  const auto near = [&](TileId a, TileId b) {
    const auto from = [&](TileId id) {
      const BoxM box = tile_bounds_m(next.form, id);
      return distance2_m2(centre, {(box[0] + box[2]) / 2, (box[1] + box[3]) / 2});
    };
    return from(a) != from(b) ? from(a) < from(b) : a < b;
  };
  for (int round = 0; round < kRounds; ++round) {
    std::map<TileId, std::string> have, wanted;
    for (const auto& [id, tile] : next.tiles) have[id] = tile->etag;
    const TileDiff diff = fetcher_.diff(next.form, centre, next.radius_m, have);
    for (const TileId id : diff.remove) next.tiles.erase(id);
    std::vector<TileId> ids;
    for (const auto& entry : next.tiles) ids.push_back(entry.first);
    for (const TileDiff::Added& tile : diff.add) {
      wanted[tile.id] = tile.etag;
      if (!next.tiles.contains(tile.id)) ids.push_back(tile.id);
    }
    std::sort(ids.begin(), ids.end(), near);
    next.all = ids.size() <= most;
    for (std::size_t i = most; i < ids.size(); ++i) next.tiles.erase(ids[i]);
    ids.resize(std::min(ids.size(), most));
    std::erase_if(ids, [&](TileId id) { return !wanted.contains(id); });
    bool same_revision = true;
    for (std::size_t at = 0; at < ids.size(); at += bundle) {
      const std::span<const TileId> some = std::span(ids).subspan(at, std::min(bundle, ids.size() - at));
      for (ClientTile& tile : fetcher_.bundle(next.form, some)) {
        same_revision = same_revision && tile.etag == wanted[tile.id];
        const TileId id = tile.id;
        next.tiles[id] = std::make_shared<const ClientTile>(std::move(tile));
      }
    }
    next.revision = diff.revision;
    if (same_revision) return next;
  }
  throw Error(ErrorCode::kFailed, "the map changes faster than its tiles arrive", options_.server.url);
}

void FreshTiles::publish(TileSnapshot next, std::span<const TileId> told, bool told_all) {
  next.number = snapshot_->number + 1;
  const TileSnapshot& before = *snapshot_;
  std::vector<BoxM> boxes;
  if (told_all || (before.number > 0 && before.form.cell_m != next.form.cell_m)) {
    boxes = {kEverywhere};
  } else {
    boxes = differences(before, next);
    // Of tiles that are not held nothing is known but that they have changed.
    for (const TileId id : told)
      if (!before.tiles.contains(id) || !next.tiles.contains(id)) boxes.push_back(tile_bounds_m(next.form, id));
  }
  for (const BoxM& box : boxes) changes_.push_back({next.number, box});
  while (changes_.size() > kChangesKept) {
    forgotten_ = changes_.front().number;
    changes_.pop_front();
  }
  snapshot_ = std::make_shared<const TileSnapshot>(std::move(next));
  // The vehicle may have moved on meanwhile.
  const double margin_m = kMargin * options_.radius_m;
  if (distance2_m2(*place_, snapshot_->centre) > margin_m * margin_m) wanted_ = true;
  changed_.notify_all();
}

void FreshTiles::heard(const ClientEvents& events) {
  const std::lock_guard lock(mutex_);
  if (events.revision == 0 && !events.reset) {
    if (wanted_ || fetching_) return;
    confirmed_ = Clock::now();
    wrong_.clear();
    return;
  }
  for (const auto& [level, id] : events.tiles)
    if (level == options_.level) told_.push_back(id);
  told_all_ = told_all_ || events.reset || told_.size() > kMostTiles;
  if (told_all_) told_.clear();
  connected_anew_ = connected_anew_ || events.reset;
  look_again();
}

// It may be another server by now: one diff, whatever it says of revisions.
void FreshTiles::connected(bool streaming) {
  const std::lock_guard lock(mutex_);
  streaming_ = streaming;
  connected_anew_ = back_ = true;
  look_again();
}

// Hears of changes as long as there is a server.
void FreshTiles::listen() {
  std::chrono::milliseconds retry = options_.retry;
  bool lost = false;  // since it could last be asked
  while (true) {
    std::uint64_t revision = 0;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return stopping_ || snapshot_->number > 0; });
      if (stopping_) return;
      revision = snapshot_->revision;
    }
    bool begun = false;
    try {
      listener_.listen(revision, [&](const ClientEvents& events) {
        if (!begun) connected(true);
        begun = true;
        lost = false;
        heard(events);
        return true;
      });
    } catch (const Error&) {  // what follows says whether the server is gone
    }
    {
      const std::lock_guard lock(mutex_);
      streaming_ = false;
    }
    // There may be no way for a stream, through a proxy, say.
    try {
      const ClientEvents events = listener_.events(revision);
      if (std::exchange(lost, false)) connected(false);
      heard(events);
      retry = options_.retry;
      if (!pause(options_.poll)) return;
    } catch (const Error& error) {
      {
        const std::lock_guard lock(mutex_);
        wrong_ = error.what();
      }
      lost = true;
      if (!pause(retry)) return;
      retry = std::min(2 * retry, options_.longest_retry);
    }
  }
}

}  // namespace btms
