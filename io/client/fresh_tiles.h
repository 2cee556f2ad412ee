// The tiles around a vehicle that moves, kept as the server has them.
//
// Two threads of its own: one listens to the map's events (a stream; asks for them again and again where there is
// none), the other asks for a diff whenever the vehicle has moved on or something has changed, fetches what is new and
// forgets what is outside. Readers get immutable snapshots; no lock is held while the network is waited for.
//
// While the server is gone the last snapshot stays; freshness() says how old it is. Both threads come back by
// themselves, waiting longer after every failure.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "io/client/map_client.h"
#include "io/client/tile_snapshot.h"
#include "io/client/watch.h"

namespace btms {

struct FreshOptions {
  ClientOptions server;
  std::string map;  // its name there
  int level = 0;
  std::vector<std::string> layers = {"elevation"};
  double radius_m = 300;
  // Of a snapshot's values. While a change is brought, what it replaces lives on, and what readers still hold.
  std::size_t budget_bytes = std::size_t{64} << 20;
  std::chrono::milliseconds retry{200}, longest_retry{5'000};  // after failures, doubling
  std::chrono::milliseconds poll{1'000};                       // where events don't stream
};

struct Freshness {
  // Since the server last said that there is nothing newer; infinite when it never has.
  double age_s = 0;
  bool streaming = false;  // changes are heard of at once
  std::string wrong;       // what went wrong last; empty when nothing is
};

// Thread-safe.
class FreshTiles {
 public:
  // The server need not be there yet. Throws Error(kUsage) for a URL that is none.
  explicit FreshTiles(FreshOptions options);
  ~FreshTiles();  // stop()
  FreshTiles(const FreshTiles&) = delete;

  // Where the vehicle is now. Tiles within the radius are kept, and a quarter more: most moves ask for nothing.
  void move_to(Place place);

  // Never null; number 0 and without tiles until the first has come.
  std::shared_ptr<const TileSnapshot> snapshot() const;
  Freshness freshness() const;

  // Waits until there is nothing left to bring for where the vehicle is; false when time runs out before.
  bool wait_until_fresh(std::chrono::milliseconds most);
  // Waits until something in the watch has changed since a snapshot: the snapshot that has the change, or nullptr when
  // time runs out. Squares in the tiles that are held; whole tiles elsewhere, as events tell of them, and everything
  // when it is not known any more what has changed.
  std::shared_ptr<const TileSnapshot> wait_for_change(const Watch& watch, std::uint64_t after_number,
                                                      std::chrono::milliseconds most);

  // Ends both threads, whatever they wait for, and wakes who waits above. Snapshots stay.
  void stop();

 private:
  using Clock = std::chrono::steady_clock;
  struct Change {
    std::uint64_t number;  // of the first snapshot that has it
    BoxM box_m;
  };

  void fetch();   // a thread
  void listen();  // the other
  void heard(const ClientEvents& events);
  void connected(bool streaming);
  void look_again();  // needs the lock
  TileForm form_of_level();
  TileSnapshot brought(const TileSnapshot& before, Place centre);
  void publish(TileSnapshot next, std::span<const TileId> told, bool told_all);  // needs the lock
  bool pause(std::chrono::milliseconds time);

  const FreshOptions options_;
  MapClient fetcher_, listener_;
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::shared_ptr<const TileSnapshot> snapshot_ = std::make_shared<const TileSnapshot>();
  std::deque<Change> changes_;
  std::uint64_t forgotten_ = 0;  // changes up to this number are not kept any more
  std::vector<TileId> told_;     // that events told of since the last fetch began
  bool told_all_ = false;        // or what has changed is not known
  std::optional<Place> place_;
  std::optional<Clock::time_point> confirmed_;
  std::string wrong_;
  bool wanted_ = false, fetching_ = false, streaming_ = false, stopping_ = false;
  bool connected_anew_ = true;  // ask for the description, too
  bool back_ = false;           // the server is there again: no need to wait any longer
  std::thread fetch_thread_, listen_thread_;
};

}  // namespace btms
