// What the manual of a model says, from tests/conformance/manual (see README.md there).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace axisd::conformance {

/// A register of chapter 6.1, or an object of chapter 7.
struct ManualParameter {
  std::uint32_t address = 0;  ///< register, or index << 8 | sub-index
  std::string type;           ///< U8, I8, U16, I16, U32, I32
  std::string access;         ///< RO, RW, RW/S, WO
  std::int64_t minimum = 0, maximum = 0;
  std::optional<std::int64_t> default_value;
  std::string unit, title, note;

  /// Bits that it has in the drive.
  [[nodiscard]] std::int64_t mask() const { return (std::int64_t{1} << std::stoi(type.substr(1))) - 1; }
};

class Manual {
 public:
  /// Throws std::runtime_error: there is none for this model, or it cannot be read.
  explicit Manual(std::string model);

  /// Of a drive of this model that another maker built: without a table of parameters, and with `changed`
  /// abilities in place of its own (nothing: it has none). `skipped`: scenarios that there is nothing for,
  /// and why.
  [[nodiscard]] Manual of_make(std::string make,
                               const std::map<std::string, std::optional<std::string>>& changed,
                               std::map<std::string, std::string, std::less<>> skipped) const;

  [[nodiscard]] const std::string& model() const { return model_; }
  /// The make, where the model has several.
  [[nodiscard]] const std::string& name() const { return make_.empty() ? model_ : make_; }
  [[nodiscard]] bool is_a_make() const { return !make_.empty(); }
  /// Why this scenario is left out; nullptr: it is not.
  [[nodiscard]] const std::string* skipped(std::string_view scenario) const;
  [[nodiscard]] const std::vector<ManualParameter>& parameters() const { return parameters_; }
  /// nullptr: the manual has none.
  [[nodiscard]] const ManualParameter* find(std::uint32_t address) const;
  [[nodiscard]] const ManualParameter* find_title(std::string_view title) const;
  /// Throws std::out_of_range for an ability without a row.
  [[nodiscard]] const std::string& text(const std::string& ability) const { return abilities_.at(ability); }
  [[nodiscard]] std::vector<std::string> list(const std::string& ability) const;
  [[nodiscard]] std::int64_t number(const std::string& ability) const {
    return std::stoll(text(ability), nullptr, 0);
  }
  [[nodiscard]] std::vector<std::string> all_skipped() const;
  /// Where the drive's data sheet lies, of a model that has one.
  [[nodiscard]] std::string data_sheet() const;
  /// Of a motor revolution, as the scenarios have it.
  [[nodiscard]] std::int64_t counts() const { return has("counts") ? number("counts") : 1000; }
  [[nodiscard]] bool has(const std::string& ability) const { return abilities_.contains(ability); }
  /// The model has nothing that the scenario could be about; its abilities name such scenarios.
  [[nodiscard]] bool lacks(std::string_view scenario) const;
  /// The only terminal that can have this function of the drive; empty: any can.
  [[nodiscard]] std::string terminal_of(const std::string& function) const;
  [[nodiscard]] bool says_yes(const std::string& ability) const { return text(ability) == "yes"; }
  /// Of an ability like "16..127": both ends are within.
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> range(const std::string& ability) const;
  /// Keys after "alarm.": code -> reset rule.
  [[nodiscard]] std::map<int, std::string> alarms() const;
  /// Names by code, of `input_function` or `output_function`.
  [[nodiscard]] std::map<int, std::string> functions(const std::string& prefix) const;
  /// What is spoken on its wire, as the YAML names it: "modbus_rtu", "canopen".
  [[nodiscard]] const std::string& bus() const { return text("bus"); }
  /// bit/s that its switches can be set to, or all that there are where there are no switches for it: the
  /// highest.
  [[nodiscard]] int highest_baud() const;

 private:
  std::string model_, make_;
  std::vector<ManualParameter> parameters_;
  std::map<std::string, std::string> abilities_;
  std::map<std::string, std::string, std::less<>> skipped_;
};

/// All models of drive_models(), in that order.
std::vector<std::string> models();
/// Manuals of all of them that are on the same kind of bus as `manual`, itself among them. A
/// drive that only its data sheet describes does not say which model it is: it stands alone.
std::vector<Manual> same_bus(const Manual& manual);

}  // namespace axisd::conformance
