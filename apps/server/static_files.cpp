#include "apps/server/static_files.h"

#include "engine/error.h"
#include "io/files/read_file.h"
#include "io/store/hash.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxFile_bytes = std::uint64_t{32} << 20;

constexpr std::pair<const char*, const char*> kTypes[] = {
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript"},
    {".css", "text/css"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".json", "application/json"},
    {".woff2", "font/woff2"},
    {".ico", "image/x-icon"},
    {".txt", "text/plain; charset=utf-8"},
};

const char* type_of(const std::string& name) {
  const std::string extension = fs::path(name).extension().string();
  for (const auto& [known, type] : kTypes)
    if (extension == known) return type;
  return "application/octet-stream";
}

constexpr const char* kNoViewer =
    "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>B-TMS Engine</title>"
    "<h1>B-TMS Engine</h1><p>The tile service is running; its viewer was not built. Install npm "
    "(<code>cmake/install-deps.sh --viewer</code>) and build again, or ask the service itself:</p><ul>"
    "<li><a href=\"/v1/maps\">maps</a><li><a href=\"/openapi.json\">openapi.json</a>"
    "<li><a href=\"/metrics\">metrics</a></ul></html>\n";

}  // namespace

StaticFiles::StaticFiles(const fs::path& folder) {
  if (folder.empty()) {
    add("index.html", kNoViewer);
    return;
  }
  if (!fs::is_regular_file(folder / "index.html"))
    throw Error(ErrorCode::kUsage, "not a built viewer: no index.html in it", folder.string());
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_symlink() || !entry.is_regular_file()) continue;
    const auto bytes = read_file(entry.path(), kMaxFile_bytes, ErrorCode::kFailed);
    add(fs::relative(entry.path(), folder).generic_string(),
        {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
}

void StaticFiles::add(const std::string& name, std::string_view bytes) {
  File file{type_of(name), {}, body_of(bytes)};
  file.etag.append("\"").append(hex64(xxh3_64(*file.body))).append("\"");
  files_.emplace(name, std::move(file));
}

const StaticFiles::File* StaticFiles::find(const std::string& path) const {
  const auto it = files_.find(path.empty() ? "index.html" : path);
  return it == files_.end() ? nullptr : &it->second;
}

}  // namespace btms
