// btms-mpi: one process a rank. Every one of them runs the whole command; the first speaks.
#include "apps/btms/process_group.h"

#include <mpi.h>

#include <chrono>
#include <cstdio>
#include <thread>

#include "apps/mpi/mpi_ranks.h"
#include "engine/error.h"

namespace btms {
namespace {

int rank_of_this() {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  return rank;
}

// A map that is not sound is no failure of the ranks that found it so: then they all get here.
bool all_are_here() {
  MPI_Request all = MPI_REQUEST_NULL;
  MPI_Ibarrier(MPI_COMM_WORLD, &all);
  int here = 0;
  for (int i = 0; i < 200 && !here; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    MPI_Test(&all, &here, MPI_STATUS_IGNORE);
  }
  return here != 0;
}

}  // namespace

ProcessGroup::ProcessGroup(int* argc, char*** argv) {
  int provided = 0;
  MPI_Init_thread(argc, argv, MPI_THREAD_FUNNELED, &provided);
  if (!is_first_process() && !std::freopen("/dev/null", "w", stdout)) MPI_Abort(MPI_COMM_WORLD, 1);
}

int ProcessGroup::end(int status) {
  int size = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  if (size > 1 && status != 0 && !(status == exit_status(ErrorCode::kVerification) && all_are_here()))
    MPI_Abort(MPI_COMM_WORLD, status);
  MPI_Finalize();
  return status;
}

bool is_first_process() { return rank_of_this() == 0; }

int processes_here(int) {
  MPI_Comm here = MPI_COMM_NULL;
  MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &here);
  int size = 1;
  MPI_Comm_size(here, &size);
  MPI_Comm_free(&here);
  return size;
}

void run_on_ranks(int ranks, const std::function<void(Ranks&)>& body) {
  if (ranks > 1)
    throw Error(ErrorCode::kUsage, "mpirun -n says how many ranks there are; leave out --executor ranks:N");
  const auto all = mpi_ranks();
  // What every process has looked up on its own is looked up before anybody changes it.
  all->exchange(std::vector<Bytes>(static_cast<std::size_t>(all->size())));
  body(*all);
}

}  // namespace btms
