// The processes a run is made of: this one and what it forks (btms), or those that mpirun has started (btms-mpi). One
// of the two is linked: process_group.cpp, apps/mpi/process_group.cpp.
#pragma once

#include <functional>

#include "engine/tiling/executor.h"

namespace btms {

// As long as main() runs.
class ProcessGroup {
 public:
  ProcessGroup(int* argc, char*** argv);
  // Ends the others, too, when `status` is not 0; returns it.
  int end(int status);
};

// The one that speaks to the user. Others say only what went wrong with them.
bool is_first_process();
// Processes of the run on this machine, which share its cores; `ranks` as given to run_on_ranks().
int processes_here(int ranks);

// Runs body in every rank, collectively; `ranks` are forked, or what mpirun says and `ranks` is 1. Returns in the
// processes that were there before. Throws what run_forked_ranks() throws; Error(kUsage) for ranks of ranks.
void run_on_ranks(int ranks, const std::function<void(Ranks&)>& body);

}  // namespace btms
