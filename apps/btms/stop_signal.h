// Ctrl-C: the handler sets a flag that the loops read at their next block or tile.
#pragma once

namespace btms {

// Catches SIGINT and SIGTERM from now on. Called by the subcommands that watch the flag; the others die at once.
void watch_stop_signals();

// True once one of them has arrived. Thread-safe.
bool stop_signalled();

// Throws Error(kCancelled) when one has arrived; for loops outside the engine.
void throw_if_stopped();

}  // namespace btms
