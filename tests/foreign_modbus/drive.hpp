// The driver of the ACME S1.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "buses/modbus_rtu/node.hpp"
#include "devices/canary.hpp"
#include "devices/descriptor.hpp"
#include "devices/drive.hpp"

namespace axisd::acme_s1 {

/// The canary is the tag: two words that no power-up leaves (M6, M7). Thread: core.
class ServoDrive final : public Drive, public MarksFacet {
 public:
  explicit ServoDrive(DriveContext context);

  Task<Result<DriveIdentity>> identify(TransactionClass transaction_class) override;
  Task<Result<void>> configure() override;
  using Drive::read_state;
  Task<Result<DriveSample>> read_state(TransactionClass transaction_class, TimePoint awaited_from) override;
  Task<Result<void>> check_continuity(TransactionClass transaction_class) override;
  [[nodiscard]] bool closed_loop() const override { return true; }
  [[nodiscard]] std::int64_t position_window() const override { return 8; }
  [[nodiscard]] std::optional<ContinuityMark> continuity_mark() const override;
  void expect_marks(const std::vector<ContinuityMark>& marks) override;
  [[nodiscard]] std::vector<ContinuityMark> marks_until(const MoveProfile& start) const override;
  [[nodiscard]] std::vector<ContinuityMark> marks_until(const VelocityProfile& start) const override;
  Task<Result<void>> enable(MotionGuard guard) override;
  Task<Result<void>> disable(MotionGuard guard) override;
  Task<Result<void>> start_move(MoveProfile profile, MotionGuard guard) override;
  Task<Result<void>> start_velocity(VelocityProfile profile, MotionGuard guard) override;
  Task<Result<void>> start_homing(HomingProfile profile, MotionGuard guard) override;
  Task<Result<void>> stop(StopKind kind) override;
  Task<Result<void>> clear_alarm(MotionGuard guard) override;
  Task<Result<void>> clear_position(MotionGuard guard) override;

 private:
  using Tag = std::array<std::uint16_t, 2>;
  struct Setting {
    std::uint16_t address;
    std::uint16_t value;
    std::string key;
  };
  struct Start {
    std::uint16_t first;  ///< register of the block
    std::vector<std::uint16_t> block;
    std::uint16_t command;
  };

  Task<Result<void>> write_tag();
  /// When it was asked for.
  Task<Result<TimePoint>> read_tag(TransactionOptions options);
  Task<Result<std::vector<std::uint16_t>>> read_settings(TransactionOptions options) const;
  Task<Result<void>> start(Start start, MotionGuard guard);
  Task<Result<void>> start_once(Start start, MotionGuard guard);
  [[nodiscard]] std::unexpected<Error> failed(Error error) const;
  [[nodiscard]] Error error_at(Reason reason, std::uint16_t address, std::string message,
                               std::string remedy) const;
  [[nodiscard]] Error lost_memory() const;

  Clock* clock_;
  modbus_rtu::Node node_;
  DriveSetup setup_;
  std::vector<Setting> wanted_;  ///< from reg::counts on, without a hole
  std::optional<Error> setup_error_;
  Canary<Tag> canary_{Tag{}};
};

}  // namespace axisd::acme_s1
