// Ranks that mpirun has started, on one machine or many.
#pragma once

#include <memory>

#include "engine/tiling/executor.h"

namespace btms {

// Of MPI_COMM_WORLD. MPI must have been started (at least MPI_THREAD_FUNNELED) and outlive it; exchange() is called by
// one thread, the one that started MPI. Messages of any size: they go in pieces, to and from those only who have
// something for each other. A rank that dies ends the job: MPI sees to that.
std::unique_ptr<Ranks> mpi_ranks();

}  // namespace btms
