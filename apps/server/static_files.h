// The viewer's files, read once when the server starts: no text from a client ever becomes a path.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "apps/server/message.h"

namespace btms {

class StaticFiles {
 public:
  // All regular files below `folder`, links excluded; a page that says how to build the viewer where there is no
  // folder. Throws Error(kUsage) for a folder without index.html, Error(kFailed) when one can't be read.
  explicit StaticFiles(const std::filesystem::path& folder);

  struct File {
    std::string content_type, etag;
    Body body;
  };
  // nullptr when there is none; "" is index.html.
  const File* find(const std::string& path) const;

 private:
  void add(const std::string& name, std::string_view bytes);
  std::map<std::string, File> files_;
};

}  // namespace btms
