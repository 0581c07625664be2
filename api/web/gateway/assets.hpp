// The page: files that are read once, at the start.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>

#include "buses/error.hpp"

namespace axisd::web {

struct Asset {
  std::string content;
  std::string gzip;  ///< the same, compressed; empty: there is no such file beside it
  std::string_view type;
  std::string etag;        ///< in quotes
  bool immutable = false;  ///< its name changes with its content
};

/// Thread: any, once it is loaded.
class Assets {
 public:
  static constexpr std::size_t largest = std::size_t{32} * 1024 * 1024;  ///< bytes of all

  /// Of every file below `directory`, NAME.gz for what NAME is compressed. Without such a directory there is
  /// no page, and that is no error. Blocks for the disk. Errors: storage, invalid_argument (too large).
  [[nodiscard]] static Result<Assets> load(const std::string& directory);

  /// For "/assets/page-1A2B.js": that file; for a path without a dot: the page itself. nullptr: there is
  /// none.
  [[nodiscard]] const Asset* find(std::string_view path) const;
  [[nodiscard]] std::size_t count() const { return assets_.size(); }

  void add(std::string path, std::string content, std::string gzip);

 private:
  std::map<std::string, Asset, std::less<>> assets_;  ///< by path, "/index.html"
};

}  // namespace axisd::web
