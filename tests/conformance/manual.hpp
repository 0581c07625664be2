// What the manual of a model says, from tests/conformance/manual (see README.md there).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace axisd::conformance {

/// A register of chapter 6.1.
struct ManualRegister {
  std::uint32_t address = 0;
  std::string access;  ///< RO, RW, RW/S, WO
  std::int64_t minimum = 0, maximum = 0;
  std::optional<std::int64_t> default_value;
  std::string unit, title, note;
};

class Manual {
 public:
  /// Throws std::runtime_error: there is none for this model, or it cannot be read.
  explicit Manual(std::string model);

  [[nodiscard]] const std::string& model() const { return model_; }
  [[nodiscard]] const std::vector<ManualRegister>& registers() const { return registers_; }
  [[nodiscard]] const ManualRegister* find(std::uint32_t address) const;
  /// Throws std::out_of_range for an ability without a row.
  [[nodiscard]] const std::string& text(const std::string& ability) const { return abilities_.at(ability); }
  [[nodiscard]] std::vector<std::string> list(const std::string& ability) const;
  [[nodiscard]] std::int64_t number(const std::string& ability) const { return std::stoll(text(ability)); }
  [[nodiscard]] bool says_yes(const std::string& ability) const { return text(ability) == "yes"; }
  /// Keys after "alarm.": code -> reset rule.
  [[nodiscard]] std::map<int, std::string> alarms() const;
  /// Names by code, of `input_function` or `output_function`.
  [[nodiscard]] std::map<int, std::string> functions(const std::string& prefix) const;

 private:
  std::string model_;
  std::vector<ManualRegister> registers_;
  std::map<std::string, std::string> abilities_;
};

}  // namespace axisd::conformance
