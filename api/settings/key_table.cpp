#include "api/settings/key_table.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>

namespace axisd::settings {

std::expected<std::string, std::string> text_of_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const auto failed = [] { return std::unexpected(std::string("cannot be read: ") + std::strerror(errno)); };
  if (!file.is_open()) return failed();
  std::string text(config::largest_text + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (file.bad()) return failed();  // it is a folder, say
  if (text.empty()) return std::unexpected("is empty");
  return text;
}

}  // namespace axisd::settings
