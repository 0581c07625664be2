#include "tests/conformance/manual.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace axisd::conformance {

namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);)
    if (separator != ' ' || !part.empty()) parts.push_back(part);
  if (!text.empty() && text.back() == separator && separator != ' ') parts.emplace_back();
  return parts;
}

/// The rows below the heading.
std::vector<std::vector<std::string>> read(const std::string& name, std::size_t columns) {
  std::ifstream file(std::string(AXISD_SOURCE_DIR "/tests/conformance/manual/") + name);
  if (!file)
    throw std::runtime_error("tests/conformance/manual/" + name + " is missing: read the manual, write it");
  std::vector<std::vector<std::string>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    rows.push_back(split(line, ','));
    if (rows.back().size() != columns) throw std::runtime_error(name + ": " + line);
  }
  return rows;
}

}  // namespace

Manual::Manual(std::string model) : model_(std::move(model)) {
  for (const auto& row : read(model_ + ".csv", 9)) {
    ManualRegister one{.address = static_cast<std::uint32_t>(std::stoul(row[0], nullptr, 0)),
                       .access = row[1],
                       .minimum = std::stoll(row[2]),
                       .maximum = std::stoll(row[3]),
                       .default_value = {},
                       .unit = row[5],
                       .title = row[6],
                       .note = row[8]};
    if (!row[4].empty()) one.default_value = std::stoll(row[4]);
    registers_.push_back(std::move(one));
  }
  for (const auto& row : read(model_ + ".abilities.csv", 3)) abilities_.emplace(row[0], row[1]);
}

const ManualRegister* Manual::find(std::uint32_t address) const {
  const auto found = std::ranges::find(registers_, address, &ManualRegister::address);
  return found == registers_.end() ? nullptr : &*found;
}

std::vector<std::string> Manual::list(const std::string& ability) const { return split(text(ability), ' '); }

std::map<int, std::string> Manual::alarms() const { return functions("alarm"); }

std::map<int, std::string> Manual::functions(const std::string& prefix) const {
  std::map<int, std::string> named;
  for (const auto& [key, value] : abilities_)
    if (key.starts_with(prefix + ".")) named.emplace(std::stoi(key.substr(prefix.size() + 1)), value);
  return named;
}

}  // namespace axisd::conformance
