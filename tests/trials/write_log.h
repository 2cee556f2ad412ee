// What preload.cpp logs and trial_replay reads: a record a call, then its path, its other path and its data.
#pragma once

#include <cstdint>

namespace btms::test {

enum class WriteOp : std::uint8_t {
  kCreate,      // inode has come to be, as `path` or without a name
  kWrite,       // `data` at `offset` of inode
  kResize,      // inode has `offset` bytes
  kGrow,        // inode has at least `offset` bytes
  kSync,        // inode's content is on disk
  kSyncFolder,  // names in `path` are on disk
  kLink,        // `path` names inode
  kRename,      // `path` is called `other`
  kRemove,      // `path` is gone, a file or a folder
  kMakeFolder,  // `path` is a folder
};

struct WriteRecord {
  std::uint64_t inode, offset, data_size;
  std::uint32_t path_size, other_size;
  WriteOp op;
};

}  // namespace btms::test
