#include "api/web/gateway/assets.hpp"

#include <fmt/format.h>
#include <sodium.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

namespace axisd::web {
namespace {

constexpr std::string_view index_path = "/index.html";
constexpr std::string_view immutable_folder = "/assets/";

constexpr std::array<std::pair<std::string_view, std::string_view>, 9> types{{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".json", "application/json"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".ico", "image/x-icon"},
    {".woff2", "font/woff2"},
    {".txt", "text/plain; charset=utf-8"},
}};

std::string_view type_of(std::string_view path) {
  const auto found =
      std::ranges::find_if(types, [&](const auto& type) { return path.ends_with(type.first); });
  return found == types.end() ? "application/octet-stream" : found->second;
}

std::string etag_of(std::string_view content) {
  std::array<unsigned char, 16> hash{};
  crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const unsigned char*>(content.data()),
                     content.size(), nullptr, 0);
  std::array<char, 2 * hash.size() + 1> hex{};
  return fmt::format("\"{}\"", sodium_bin2hex(hex.data(), hex.size(), hash.data(), hash.size()));
}

std::string read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

Result<Assets> Assets::load(const std::string& directory) {
  namespace fs = std::filesystem;
  Assets assets;
  std::error_code error;
  std::map<std::string, std::string, std::less<>> files;
  std::size_t size = 0;
  for (auto entry = fs::recursive_directory_iterator(directory, error);
       !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    if (!entry->is_regular_file(error)) continue;
    size += static_cast<std::size_t>(entry->file_size(error));
    if (size > largest)
      return fail(Reason::invalid_argument, fmt::format("{}: more than {} bytes", directory, largest),
                  "check 'files' in the configuration");
    files.emplace('/' + entry->path().lexically_relative(directory).generic_string(),
                  read_file(entry->path()));
  }
  if (error)
    return fail(Reason::invalid_argument, fmt::format("{}: cannot be read: {}", directory, error.message()),
                "check 'files' in the configuration");
  if (!files.contains(index_path))
    return fail(Reason::invalid_argument, fmt::format("{}: no page of axisd-web is there", directory),
                "check 'files' in the configuration");
  for (auto& [path, content] : files) {
    if (path.ends_with(".gz")) continue;
    const auto gzip = files.find(path + ".gz");
    assets.add(path, content, gzip == files.end() ? std::string() : gzip->second);
  }
  return assets;
}

void Assets::add(std::string path, std::string content, std::string gzip) {
  Asset asset{.content = std::move(content),
              .gzip = std::move(gzip),
              .type = type_of(path),
              .etag = {},
              .immutable = path.starts_with(immutable_folder)};
  asset.etag = etag_of(asset.content);
  assets_.insert_or_assign(std::move(path), std::move(asset));
}

const Asset* Assets::find(std::string_view path) const {
  const auto found = assets_.find(path.find('.') == std::string_view::npos ? index_path : path);
  return found == assets_.end() ? nullptr : &found->second;
}

}  // namespace axisd::web
