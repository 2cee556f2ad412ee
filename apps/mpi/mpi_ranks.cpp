#include "apps/mpi/mpi_ranks.h"

#include <mpi.h>

#include <algorithm>
#include <climits>
#include <cstdint>
#include <utility>

namespace btms {
namespace {

constexpr std::uint64_t kPiece_bytes = std::uint64_t{256} << 20;  // counts are int
constexpr int kTag = 1;

class MpiRanks final : public Ranks {
 public:
  MpiRanks() {
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
  }
  int rank() const override { return rank_; }
  int size() const override { return size_; }

 private:
  std::vector<Bytes> do_exchange(std::vector<Bytes> out) override {
    const auto n = static_cast<std::size_t>(size_), own = static_cast<std::size_t>(rank_);
    std::vector<std::uint64_t> to_send(n), to_receive(n);
    for (std::size_t r = 0; r < n; ++r) to_send[r] = out[r].size();
    MPI_Alltoall(to_send.data(), 1, MPI_UINT64_T, to_receive.data(), 1, MPI_UINT64_T, MPI_COMM_WORLD);
    std::vector<Bytes> in(n);
    std::vector<MPI_Request> requests;
    for (std::size_t r = 0; r < n; ++r) {
      if (r == own) continue;
      in[r].resize(to_receive[r]);
      each_piece(in[r], [&](std::uint8_t* at, int bytes) {
        MPI_Irecv(at, bytes, MPI_BYTE, static_cast<int>(r), kTag, MPI_COMM_WORLD, &requests.emplace_back());
      });
    }
    for (std::size_t step = 1; step < n; ++step) {  // not everybody to rank 0 first
      const std::size_t r = (own + step) % n;
      each_piece(out[r], [&](std::uint8_t* at, int bytes) {
        MPI_Isend(at, bytes, MPI_BYTE, static_cast<int>(r), kTag, MPI_COMM_WORLD, &requests.emplace_back());
      });
    }
    MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
    in[own] = std::move(out[own]);
    return in;
  }

  std::vector<Bytes> do_share(Bytes mine) override {
    const auto n = static_cast<std::size_t>(size_);
    const std::uint64_t size = mine.size();
    std::vector<std::uint64_t> sizes(n);
    MPI_Allgather(&size, 1, MPI_UINT64_T, sizes.data(), 1, MPI_UINT64_T, MPI_COMM_WORLD);
    std::uint64_t total = 0;
    std::vector<int> counts(n), starts(n);
    for (std::size_t r = 0; r < n; ++r) {
      counts[r] = static_cast<int>(sizes[r]);
      starts[r] = static_cast<int>(total);
      total += sizes[r];
    }
    if (total > INT_MAX) return do_exchange(std::vector<Bytes>(n, mine));  // MPI counts with int
    Bytes all(total);
    MPI_Allgatherv(mine.data(), static_cast<int>(size), MPI_BYTE, all.data(), counts.data(), starts.data(), MPI_BYTE,
                   MPI_COMM_WORLD);
    std::vector<Bytes> by_rank(n);
    for (std::size_t r = 0; r < n; ++r) by_rank[r].assign(all.begin() + starts[r], all.begin() + starts[r] + counts[r]);
    return by_rank;
  }

  template <class Fn>
  static void each_piece(Bytes& bytes, const Fn& fn) {
    for (std::uint64_t at = 0; at < bytes.size(); at += kPiece_bytes)
      fn(bytes.data() + at, static_cast<int>(std::min<std::uint64_t>(kPiece_bytes, bytes.size() - at)));
  }
  int rank_ = 0, size_ = 1;
};

}  // namespace

std::unique_ptr<Ranks> mpi_ranks() { return std::make_unique<MpiRanks>(); }

}  // namespace btms
