// Files, folders and globs on the command line -> point files.
#include <glob.h>

#include <algorithm>
#include <memory>

#include "engine/error.h"
#include "io/points/point_file.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

bool has_extension(const fs::path& path, std::span<const std::string> extensions) {
  std::string text = path.extension().string();
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return std::find(extensions.begin(), extensions.end(), text) != extensions.end();
}

std::string joined(std::span<const std::string> words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::vector<fs::path> files_in(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  const std::vector<std::string> known = known_point_extensions();
  bool laz = false;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    // A folder that happens to be called x.las is not a point file; anything else of that name is for the reader to
    // judge.
    std::error_code ignored;
    if (it->is_directory(ignored)) continue;
    if (has_extension(it->path(), known)) files.push_back(it->path());
    laz = laz || has_extension(it->path(), std::array{std::string(".laz")});
  }
  if (error) throw Error(ErrorCode::kBadInput, "cannot read the folder: " + error.message(), folder.string());
  if (files.empty()) {
    throw Error(ErrorCode::kUsage,
                "no point files in this folder; known are " + joined(known) +
                    (laz ? ". Its .laz files are not supported in this build: decompress them to .las first" : ""),
                folder.string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<fs::path> matches_of(const std::string& pattern) {
  glob_t result{};
  const int status = ::glob(pattern.c_str(), GLOB_ERR, nullptr, &result);  // sorts, in the C locale's order
  const std::unique_ptr<glob_t, void (*)(glob_t*)> owner(&result, ::globfree);
  if (status != 0 && status != GLOB_NOMATCH) throw Error(ErrorCode::kFailed, "cannot search for matches", pattern);
  std::vector<fs::path> matches(result.gl_pathv, result.gl_pathv + result.gl_pathc);
  std::sort(matches.begin(), matches.end());
  return matches;
}

void append(const fs::path& path, std::vector<fs::path>& files) {
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    files.push_back(path);
    return;
  }
  const std::vector<fs::path> inside = files_in(path);
  files.insert(files.end(), inside.begin(), inside.end());
}

}  // namespace

std::vector<std::filesystem::path> expand_inputs(std::span<const std::string> arguments) {
  std::vector<fs::path> files;
  for (const std::string& argument : arguments) {
    // A name that exists is that file, whatever characters it has. symlink_status: a dangling link exists, too, and the
    // reader says what is wrong with it.
    std::error_code error;
    if (fs::exists(fs::symlink_status(argument, error))) {
      append(argument, files);
      continue;
    }
    const std::vector<fs::path> matches = matches_of(argument);
    if (matches.empty()) throw Error(ErrorCode::kUsage, "no such file, folder or pattern with matches", argument);
    for (const fs::path& match : matches) append(match, files);
  }
  return files;
}

}  // namespace btms
