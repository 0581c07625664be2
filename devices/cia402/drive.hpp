// One CiA 402 drive on its CANopen network.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "buses/canopen/canopen_bus.hpp"
#include "buses/canopen/pdo_configuration.hpp"
#include "buses/signal.hpp"
#include "devices/cia402/model.hpp"
#include "devices/cia402/object_setting.hpp"
#include "devices/descriptor.hpp"
#include "devices/drive.hpp"

namespace axisd::cia402 {

/// Thread: core.
///
/// The canary: 607Ah, 6081h, 6083h, 6084h and the start speed live in RAM. What stands there after a power-up
/// is never what this class last wrote, so reading them proves that the drive has not been restarted since
/// (M6, M7), beside boot-up message and heartbeat.
class Cia402Drive final : public Drive {
 public:
  Cia402Drive(const Model& model, DriveContext context);
  ~Cia402Drive() override;
  Cia402Drive(const Cia402Drive&) = delete;

  // drive_connection.cpp
  Task<Result<DriveIdentity>> identify(TransactionClass transaction_class) override;
  Task<Result<void>> configure() override;
  [[nodiscard]] bool moves_by_itself() const override { return false; }
  [[nodiscard]] bool closed_loop() const override;

  // drive_state.cpp
  Task<Result<DriveSample>> read_state(TransactionClass transaction_class) override;

  // drive_canary.cpp
  Task<Result<void>> check_continuity(TransactionClass transaction_class) override;
  [[nodiscard]] std::optional<ContinuityMark> continuity_mark() const override;
  void expect_mark(const ContinuityMark& mark) override;

  // drive_power.cpp, drive_motion.cpp, drive_stop.cpp
  Task<Result<void>> enable(MotionGuard guard) override;
  Task<Result<void>> disable(MotionGuard guard) override;
  Task<Result<void>> start_move(MoveProfile profile, MotionGuard guard) override;
  Task<Result<void>> start_velocity(VelocityProfile profile, MotionGuard guard) override;
  Task<Result<void>> start_homing(HomingProfile profile, MotionGuard guard) override;
  Task<Result<void>> stop(StopKind kind) override;
  Task<Result<void>> clear_alarm() override;
  Task<Result<void>> clear_position(MotionGuard guard) override;

  // drive_parameters.cpp
  std::uint64_t take_eeprom_writes() override { return std::exchange(eeprom_writes_, 0); }
  Task<Result<Drift>> check_drift(TransactionClass transaction_class) override;
  [[nodiscard]] std::string configured_by(std::uint32_t address) const override;
  Task<Result<std::vector<ParameterValue>>> read_parameters(std::vector<std::uint32_t> addresses) override;
  Task<Result<std::vector<ParameterValue>>> write_parameters(std::vector<ParameterValue> values) override;
  Task<Result<DriveSegments>> read_segments() override;
  Task<Result<void>> write_segments(DriveSegments segments) override;
  Task<Result<void>> save_parameters() override;
  Task<Result<std::string>> restore_factory(std::vector<std::uint8_t> taken) override;
  Task<Result<std::string>> change_serial(SerialChange change) override;

 private:
  using Object = canopen::Object;
  using SdoOptions = canopen::SdoOptions;
  /// What the canary's objects hold, in the order of canary_objects().
  using MotionBlock = std::array<std::int32_t, 5>;

  // drive_access.cpp
  /// The object's value, with its sign where its type has one. Learns the object's size.
  Task<Result<std::int64_t>> read_object(Object object, SdoOptions options);
  /// Writes the object in the size that this drive takes: `bytes` at first, after an abort 0607001xh the size
  /// that the drive reports or another one, which is remembered.
  Task<Result<void>> write_object(Object object, std::int64_t value, std::uint8_t bytes, SdoOptions options);
  [[nodiscard]] std::unexpected<Error> failed(Error error) const;
  [[nodiscard]] Error error_at(Reason reason, Object object, std::string message, std::string remedy) const;
  [[nodiscard]] Error lost_memory() const;

  // drive_canary.cpp
  [[nodiscard]] MotionBlock fresh_neutral_block() const;
  /// Keeps a block off every content that a power-up could leave.
  [[nodiscard]] MotionBlock distinct(MotionBlock block) const;
  /// A content that a power-up may leave: never a canary.
  void note_power_up_block(const MotionBlock& block);
  Task<Result<void>> write_canary(MotionBlock block, SdoOptions options);
  /// Reads the block and compares it. The time: when the first of it was asked for.
  Task<Result<TimePoint>> read_canary(SdoOptions options);

  // drive_parameters.cpp
  /// Writes what differs, each part saved or not as it says, and verifies all of it.
  Task<Result<void>> bring_to(std::vector<ObjectSetting> required);
  /// Sets the EEPROM switch (200Ch of the YSS-C), if it is not so already.
  Task<Result<void>> save_writes(bool saved);
  [[nodiscard]] bool saves_at_rest() const;

  const Model* model_;
  Clock* clock_;
  canopen::CanopenBus* bus_;
  canopen::RemoteNode node_;
  DriveSetup setup_;
  std::vector<ObjectSetting> required_;  ///< by the setup; empty if it cannot be had (configure() says why)
  std::optional<Error> setup_error_;
  std::map<std::uint32_t, std::uint8_t> sizes_;  ///< of objects, as this drive was seen to have them

  /// What the motion block may hold: one entry, two after a write whose reply was lost.
  std::vector<MotionBlock> expected_;
  std::vector<MotionBlock> power_up_blocks_;  ///< what a power-up may leave; the newest last

  std::optional<bool> saving_;        ///< the EEPROM switch, if it is known
  std::optional<bool> found_closed_;  ///< loop mode as it was before this power cycle's first write
  std::set<std::uint32_t> unsaved_;   ///< saved objects that did not hold what was written
  std::uint64_t eeprom_writes_ = 0;
};

std::unique_ptr<Drive> make_drive(const Model& model, DriveContext context);

}  // namespace axisd::cia402
