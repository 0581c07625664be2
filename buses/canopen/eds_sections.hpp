// The text of an EDS file as sections of keys and values, whatever editor or program wrote it. Used by
// eds.cpp.
#pragma once

#include <expected>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace axisd::canopen {

struct EdsEntry {
  std::string value;
  int line = 0;
};

/// Names and keys are in lower case (CiA 306 does not care).
struct EdsSection {
  int line = 0;
  std::map<std::string, EdsEntry> entries;
  [[nodiscard]] bool has(const std::string& key) const;
  /// Without blanks around it; empty: not there.
  [[nodiscard]] std::string text(const std::string& key) const;
  /// The same without a comment behind it: of numbers and single words.
  [[nodiscard]] std::string word(const std::string& key) const;
  /// Of the section where the key is not there.
  [[nodiscard]] int line_of(const std::string& key) const;
};

/// A line that says nothing, or something else than an earlier one, which stands.
struct EdsRemark {
  int line = 0;
  std::string section, key;  ///< `key`: whose value is doubtful; empty: nothing is lost
  std::string message;
};

struct EdsText {
  std::map<std::string, EdsSection> sections;
  std::vector<EdsRemark> remarks;
};

/// As ASCII, with '?' for each unit of UTF-16 beyond it; bytes of other encodings are left alone. Errors: why
/// it is no text of an EDS.
std::expected<std::string, std::string> decode_eds(std::string_view file);
/// Stops at `remark_limit` remarks and one more.
EdsText split_eds(std::string_view text, std::size_t remark_limit);

}  // namespace axisd::canopen
