#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "config/configuration.hpp"
#include "tests/support/source_tree.hpp"

namespace axisd::config {

inline std::filesystem::path source_path(const std::string& relative) {
  return test::in_source_tree(relative);
}

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// All findings, one per line.
inline std::string findings(const LoadResult& result) {
  std::string text;
  for (const auto& diagnostic : result.diagnostics) text += to_string(diagnostic) + "\n";
  return text;
}

}  // namespace axisd::config
