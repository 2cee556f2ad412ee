// Files, folders and globs on the command line -> point files.
#include <glob.h>

#include <algorithm>
#include <cerrno>
#include <map>
#include <memory>

#include "engine/error.h"
#include "io/points/input_file.h"
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
  const std::vector<std::string> known = point_extensions_in_folders();
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    // A folder that happens to be called x.las is not a point file; anything else of that name is for the reader to
    // judge.
    std::error_code ignored;
    if (it->is_directory(ignored)) continue;
    if (has_extension(it->path(), known)) files.push_back(it->path());
  }
  if (error) throw_input_error(error.value(), "read the folder", folder);
  if (files.empty())
    throw Error(ErrorCode::kUsage, "no point files in this folder; known are " + joined(known), folder.string());
  std::sort(files.begin(), files.end());
  return files;
}

// A folder on the way that is not there means no matches, like a name that is not there.
int stop_globbing(const char*, int error) { return error != ENOENT && error != ENOTDIR; }

std::vector<fs::path> matches_of(const std::string& pattern) {
  glob_t result{};
  const int status = ::glob(pattern.c_str(), 0, stop_globbing, &result);  // sorts, in the C locale's order
  const std::unique_ptr<glob_t, void (*)(glob_t*)> owner(&result, ::globfree);
  if (status != 0 && status != GLOB_NOMATCH) throw Error(ErrorCode::kFailed, "cannot search for matches", pattern);
  std::vector<fs::path> matches(result.gl_pathv, result.gl_pathv + result.gl_pathc);
  std::sort(matches.begin(), matches.end());
  return matches;
}

void append(const fs::path& path, InputList& list) {
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    list.paths.push_back(path);
    return;
  }
  const std::vector<fs::path> inside = files_in(path);
  list.paths.insert(list.paths.end(), inside.begin(), inside.end());
}

// Points that count twice would weigh twice.
void drop_repeated(InputList& list) {
  std::map<fs::path, fs::path> first_name;
  std::vector<fs::path> kept;
  for (const fs::path& path : list.paths) {
    std::error_code error;
    const fs::path real = fs::canonical(path, error);
    const auto [first, is_new] = first_name.emplace(error ? path : real, path);
    if (is_new)
      kept.push_back(path);
    else
      list.warnings.push_back(path.string() + ": given more than once" +
                              (first->second == path ? "" : " (also as " + first->second.string() + ")") +
                              ", used once");
  }
  list.paths = std::move(kept);
}

}  // namespace

InputList expand_inputs(std::span<const std::string> arguments) {
  InputList list;
  for (const std::string& argument : arguments) {
    // A name that exists is that file, whatever characters it has. symlink_status: a dangling link exists, too, and the
    // reader says what is wrong with it.
    std::error_code error;
    if (fs::exists(fs::symlink_status(argument, error))) {
      append(argument, list);
      continue;
    }
    const std::vector<fs::path> matches = matches_of(argument);
    if (matches.empty()) throw Error(ErrorCode::kUsage, "no such file, folder or pattern with matches", argument);
    for (const fs::path& match : matches) append(match, list);
  }
  drop_repeated(list);
  return list;
}

}  // namespace btms
