#include "tests/conformance/manual.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "devices/descriptor.hpp"
#include "tests/support/source_tree.hpp"

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

using Row = std::map<std::string, std::string>;

/// The rows below the heading, by its names.
std::vector<Row> read(const std::string& name) {
  std::ifstream file(test::in_source_tree("tests/conformance/manual/") + name);
  if (!file)
    throw std::runtime_error("tests/conformance/manual/" + name + " is missing: read the manual, write it");
  std::vector<Row> rows;
  std::string line;
  std::getline(file, line);
  const auto heading = split(line, ',');
  while (std::getline(file, line)) {
    const auto fields = split(line, ',');
    if (fields.size() != heading.size()) throw std::runtime_error(name + ": " + line);
    auto& row = rows.emplace_back();
    for (std::size_t i = 0; i < fields.size(); ++i) row.emplace(heading[i], fields[i]);
  }
  return rows;
}

std::uint32_t address_of(const Row& row) {
  const auto number = [&](const std::string& column) {
    return static_cast<std::uint32_t>(std::stoul(row.at(column), nullptr, 0));
  };
  return row.contains("index") ? number("index") << 8U | number("sub") : number("address");
}

/// A register's type is not printed: its range tells (manual/README.md).
std::string type_of(const Row& row, const ManualParameter& of) {
  if (row.contains("type")) return row.at("type");
  return of.minimum < 0 && of.maximum <= 32767 ? "I16" : "U16";
}

}  // namespace

Manual::Manual(std::string model) : model_(std::move(model)) {
  for (const auto& row : read(model_ + ".csv")) {
    ManualParameter one{.address = address_of(row),
                        .type = {},
                        .access = row.at("access"),
                        .minimum = std::stoll(row.at("minimum")),
                        .maximum = std::stoll(row.at("maximum")),
                        .default_value = {},
                        .unit = row.at("unit"),
                        .title = row.at("title"),
                        .note = row.at("note")};
    one.type = type_of(row, one);
    if (!row.at("default").empty()) one.default_value = std::stoll(row.at("default"));
    parameters_.push_back(std::move(one));
  }
  for (const auto& row : read(model_ + ".abilities.csv"))
    abilities_.emplace(row.at("ability"), row.at("value"));
}

Manual Manual::of_make(std::string make, const std::map<std::string, std::optional<std::string>>& changed,
                       std::map<std::string, std::string, std::less<>> skipped) const {
  auto other = *this;
  other.make_ = std::move(make);
  other.parameters_.clear();
  other.skipped_ = std::move(skipped);
  for (const auto& [ability, value] : changed) {
    other.abilities_.erase(ability);
    if (value) other.abilities_.emplace(ability, *value);
  }
  return other;
}

const std::string* Manual::skipped(std::string_view scenario) const {
  const auto found = skipped_.find(scenario);
  return found == skipped_.end() ? nullptr : &found->second;
}

std::vector<std::string> Manual::all_skipped() const {
  std::vector<std::string> names;
  for (const auto& [name, why] : skipped_) names.push_back(name);
  return names;
}

std::string Manual::data_sheet() const {
  const std::filesystem::path path(text("data_sheet"));
  return path.is_absolute() ? path.string() : test::in_source_tree(path.string());
}

const ManualParameter* Manual::find(std::uint32_t address) const {
  const auto found = std::ranges::find(parameters_, address, &ManualParameter::address);
  return found == parameters_.end() ? nullptr : &*found;
}

const ManualParameter* Manual::find_title(std::string_view title) const {
  const auto found = std::ranges::find(parameters_, title, &ManualParameter::title);
  return found == parameters_.end() ? nullptr : &*found;
}

std::vector<std::string> Manual::list(const std::string& ability) const { return split(text(ability), ' '); }

std::pair<std::int64_t, std::int64_t> Manual::range(const std::string& ability) const {
  const auto& ends = text(ability);
  const auto dots = ends.find("..");
  return {std::stoll(ends.substr(0, dots), nullptr, 0), std::stoll(ends.substr(dots + 2), nullptr, 0)};
}

int Manual::highest_baud() const {
  int highest = 0;
  const auto switched = list("bauds_dip");
  for (const auto& one : switched.empty() ? list("bauds_custom") : switched)
    highest = std::max(highest, std::stoi(one));
  return highest;
}

std::map<int, std::string> Manual::alarms() const { return functions("alarm"); }

std::map<int, std::string> Manual::functions(const std::string& prefix) const {
  std::map<int, std::string> named;
  for (const auto& [key, value] : abilities_)
    if (key.starts_with(prefix + ".")) named.emplace(std::stoi(key.substr(prefix.size() + 1)), value);
  return named;
}

bool Manual::lacks(std::string_view scenario) const {
  if (!has("lacks")) return false;
  const auto all = list("lacks");
  return std::ranges::find(all, scenario) != all.end();
}

std::string Manual::terminal_of(const std::string& function) const {
  const std::string prefix = "only_function.";
  for (const auto& [key, value] : abilities_)
    if (key.starts_with(prefix) && value == function) return key.substr(prefix.size());
  return {};
}

std::vector<std::string> models() {
  std::vector<std::string> all;
  for (const auto* model : drive_models()) all.emplace_back(model->model);
  return all;
}

std::vector<Manual> same_bus(const Manual& manual) {
  if (manual.has("data_sheet")) return {manual};
  std::vector<Manual> all;
  for (const auto& model : models())
    if (Manual one(model); one.bus() == manual.bus() && !one.has("data_sheet")) all.push_back(std::move(one));
  return all;
}

}  // namespace axisd::conformance
