#include "buses/canopen/eds_sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "buses/canopen/eds_values.hpp"

namespace axisd::canopen {

namespace {

/// Every second byte is the high half of a character.
std::string narrowed(std::string_view text, bool high_first) {
  std::string narrow;
  narrow.reserve(text.size() / 2);
  for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
    const char high = text[high_first ? i : i + 1], low = text[high_first ? i + 1 : i];
    narrow += high == '\0' && static_cast<unsigned char>(low) < 0x80U ? low : '?';
  }
  return narrow;
}

/// Up to a line feed, a carriage return, or both.
std::string_view take_line(std::string_view& text) {
  const auto end = std::min(text.find_first_of("\r\n"), text.size());
  const auto line = text.substr(0, end);
  const bool both = text.substr(end).starts_with("\r\n");
  text.remove_prefix(std::min(end + (both ? 2 : 1), text.size()));
  return line;
}

/// Lower case; of an object always the same: "1018sub1" also for "0x1018 Sub01".
std::string canonical(std::string_view name) {
  const auto object = parse_object_section(name);
  if (!object) return lower_case(name);
  const auto [index, sub] = object->object;
  return object->has_sub ? fmt::format("{:04x}sub{:x}", index, sub) : fmt::format("{:04x}", index);
}

class Splitter {
 public:
  explicit Splitter(std::size_t remark_limit) : limit_(remark_limit) {}
  EdsText split(std::string_view text) {
    while (!text.empty() && result_.remarks.size() <= limit_) {
      ++line_;
      const auto line = trimmed(take_line(text));
      if (line.empty() || line.front() == ';' || line.front() == '#') continue;
      if (line.front() == '[')
        open(line.substr(1));
      else
        add(line);
    }
    return std::move(result_);
  }

 private:
  void remark(std::string key, std::string message) {
    result_.remarks.push_back({line_, name_, std::move(key), std::move(message)});
  }

  void open(std::string_view rest) {
    const auto end = rest.find(']');
    name_ = canonical(trimmed(rest.substr(0, end)));
    const auto [at, added] = result_.sections.try_emplace(name_);
    section_ = &at->second;
    repeated_ = !added;
    if (added) section_->line = line_;
    if (end == std::string_view::npos) remark("", fmt::format("[{} has no ]", name_));
    if (!added)
      remark("", fmt::format("section [{}] stands there twice, first in line {}", name_, at->second.line));
  }

  void add(std::string_view line) {
    const auto equals = line.find('=');
    if (section_ == nullptr) {
      remark("", "a line before the first section is left out");
      return;
    }
    const auto key = lower_case(trimmed(line.substr(0, std::min(equals, line.find_first_of(" \t")))));
    if (equals == std::string_view::npos) {
      remark(key, fmt::format("{}: neither [section] nor key=value", line));
      return;
    }
    const auto whole = lower_case(trimmed(line.substr(0, equals)));
    const std::string value(trimmed(line.substr(equals + 1)));
    const auto [at, added] = section_->entries.try_emplace(whole, EdsEntry{value, line_});
    if (added) return;
    const bool same = lower_case(at->second.value) == lower_case(value);
    if (same && repeated_) return;  // told of the section
    remark(same ? "" : whole, fmt::format("{}={} stands there twice, first as {} in line {}", whole, value,
                                          at->second.value, at->second.line));
  }

  std::size_t limit_;
  int line_ = 0;
  std::string name_;
  EdsSection* section_ = nullptr;
  bool repeated_ = false;
  EdsText result_;
};

}  // namespace

bool EdsSection::has(const std::string& key) const { return entries.contains(key); }

std::string EdsSection::text(const std::string& key) const {
  const auto found = entries.find(key);
  return found == entries.end() ? std::string() : found->second.value;
}

std::string EdsSection::word(const std::string& key) const {
  const auto all = text(key);
  return std::string(trimmed(std::string_view(all).substr(0, all.find(';'))));
}

int EdsSection::line_of(const std::string& key) const {
  const auto found = entries.find(key);
  return found == entries.end() ? line : found->second.line;
}

std::expected<std::string, std::string> decode_eds(std::string_view file) {
  constexpr char end_of_file = '\x1A';  // of CP/M and DOS
  std::string text;
  if (file.starts_with("\xFF\xFE") || file.starts_with("\xFE\xFF"))
    text = narrowed(file.substr(2), file.front() == '\xFE');
  else if (file.size() >= 2 && (file[0] == '\0') != (file[1] == '\0'))
    text = narrowed(file, file[0] == '\0');
  else
    text = file.substr(file.starts_with("\xEF\xBB\xBF") ? 3 : 0);
  while (text.ends_with(end_of_file)) text.pop_back();
  if (text.find('\0') != std::string::npos) return std::unexpected("the file is not a text file");
  if (trimmed(text).starts_with('<'))
    return std::unexpected("the file is XML (XDD or XDC, CiA 311), of which nothing is read");
  return text;
}

EdsText split_eds(std::string_view text, std::size_t remark_limit) {
  return Splitter(remark_limit).split(text);
}

}  // namespace axisd::canopen
