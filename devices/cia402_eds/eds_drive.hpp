// One CiA 402 drive as its EDS describes it: what a model folder has as tables, made from a file.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "buses/canopen/eds.hpp"
#include "devices/cia402/model.hpp"
#include "devices/cia402_eds/catalogue.hpp"
#include "devices/descriptor.hpp"

namespace axisd::cia402_eds {

/// What an EDS does not say of itself.
struct Conventions {
  cia402::Units units{.velocity = cia402::pulses_per_second,
                      .ramps = cia402::Ramps::rates,
                      .acceleration = cia402::pulses_per_second,
                      .velocity_source = cia402::UnitSource::configuration};
  bool closed_loop = true;  ///< 6064h is measured
};
/// Errors: of plan_units().
Result<Conventions> conventions_of(const canopen::Eds& eds,
                                   const std::map<std::string, SettingValue>& settings);

/// Lives as long as an axis refers to it; everything that it points to is its own or lives as long as the
/// program.
class EdsDrive final : public DriveDescriptor {
 public:
  /// Precondition: check_eds() found nothing.
  EdsDrive(const DriveDescriptor& base, const canopen::Eds& eds, const Conventions& conventions,
           std::vector<std::string> warnings_of_file = {});
  EdsDrive(const EdsDrive&) = delete;
  EdsDrive& operator=(const EdsDrive&) = delete;

  [[nodiscard]] const cia402::Model& model() const { return model_; }

 private:
  Catalogue catalogue_;
  std::vector<cia402::HomingCode> homing_codes_;
  std::vector<HomingNumber> homing_numbers_;
  std::string velocity_lack_;
  std::vector<std::string> warnings_;
  std::vector<canopen::Object> unit_objects_;
  cia402::Model model_;
};

/// Reads the file of the setting `eds`, with what the settings of its objects say in its place. Errors
/// (invalid_argument): none is named, it cannot be read, an object cannot be as its settings say,
/// check_eds() found something ("FILE:LINE: ..." one per line), or those of plan_units().
Result<std::shared_ptr<const DriveDescriptor>> specialise(
    const DriveDescriptor& base, const std::map<std::string, SettingValue>& settings);

}  // namespace axisd::cia402_eds
